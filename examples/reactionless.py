"""A motion of the arm that leaves the base alone.

Joint motions in the reaction null space have no angular momentum, so nothing has to be done about
the attitude. Seven joints have a null space of four dimensions: the arm comes as near to the wanted
posture as it leads. The plain motion to the same posture asks the base for a torque.

    python examples/reactionless.py

prints:

    reached: 17.5 34.7 33.5 75.2 29.3 85.5 99.8 deg
    reactionless: base torque 0.00001 N m
    plain:        base torque 0.02 N m
"""

from __future__ import annotations

from typing import Any

import numpy as np

from space_robot import FlownFlight, Scenario

START = [10, 30, 40, 50, 60, 70, 80]
WANTED = [40, 10, 55, 80, 30, 85, 100]
"""Angles of the seven joints, deg."""


def fly(segment: dict[str, Any]) -> FlownFlight:
    """Fly one segment of 15 s with the seven-joint robot."""
    mission = {"start": {"joints_deg": START}, "segments": [{**segment, "duration": 15}]}
    return Scenario(robot="seven_joint", controller="ctc", mission=mission, friction=False).fly()


def torque(flight: FlownFlight) -> float:
    """Return the largest torque on an axis of the base, N m."""
    return float(np.abs(flight.log.applied_torque[:, :3]).max())


def main() -> None:
    """Fly both motions between the same postures."""
    flight = fly({"reactionless": {"joints_deg": WANTED}})
    reached = np.degrees(flight.log.reference_joints[-1, 0])
    print(f"reached: {' '.join(f'{angle:.1f}' for angle in reached)} deg")
    print(f"reactionless: base torque {torque(flight):.5f} N m")
    print(f"plain:        base torque {torque(fly({'joints_deg': reached.tolist()})):.2f} N m")


if __name__ == "__main__":
    main()
