"""A straight line of the tool: with the base's attitude held, and with the base free.

With the attitude held, the pose of the tool is a function of the attitude and the joints, so a
closed path returns the joints to their start. A free base turns as the motion of the arm turns it:
the joints follow the generalised Jacobian, and the attitude at the end depends on the path.

    python examples/straight_line.py

prints:

    attitude held: tool within 0.2 nm of its line, base turned  0.00 deg, base torque  3.10 N m
    base free:     tool within 0.5 nm of its line, base turned 25.21 deg, base torque  0.00 N m
"""

from __future__ import annotations

import numpy as np

from space_robot import FlownFlight, Scenario

START = {"joints_deg": [0, 90, 200, 20, 30, 10]}
GOAL = {"xyz": [0.3, 0.1, -0.4], "rpy_deg": [0, 0, 0]}
"""A displacement on inertial axes, m; the orientation is held."""


def fly(is_free: bool) -> FlownFlight:
    """Fly the line in 15 s; a free base has no actuators."""
    segment = {"tool": GOAL, "duration": 15, **({"base": "free"} if is_free else {})}
    return Scenario(
        controller="ctc",
        mission={"start": START, "segments": [segment]},
        actuators="none" if is_free else "ideal",
        friction=False,
    ).fly()


def main() -> None:
    """Fly the line twice."""
    for title, is_free in (("attitude held:", False), ("base free:", True)):
        flight = fly(is_free)
        tool_m = flight.metrics["tool.max"]
        turned = 2.0 * np.degrees(np.arcsin(np.linalg.norm(flight.log.quaternion[-1, 1:])))
        torque = np.abs(flight.log.applied_torque[:, :3]).max()
        print(
            f"{title:14} tool within {1e9 * tool_m:.1f} nm of its line, "
            f"base turned {turned:5.2f} deg, base torque {torque:5.2f} N m"
        )


if __name__ == "__main__":
    main()
