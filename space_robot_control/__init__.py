"""The flight software: control laws, controller, mission, and how flights are flown and judged."""
