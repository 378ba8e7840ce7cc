"""The environment acts on the robot beside its actuators: friction, disturbances, payload."""
