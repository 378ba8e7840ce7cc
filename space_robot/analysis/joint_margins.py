"""How near a planned motion comes to the limits of the joints."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from space_robot_control.guidance.demand import MotionDemand
from space_robot_model.robot import Robot

Array = NDArray[np.float64]


def joint_margins(robot: Robot, demands: Sequence[MotionDemand]) -> dict[str, Any]:
    """Return the joints that come nearest to their limits of position, velocity and effort.

    Args:
        robot: with limits of its joints.
        demands: of the segments of a mission.

    Returns:
        By kind of limit ``joint``, ``time_s`` and ``share``: 1 at the limit; positions count from
        the middle of the joint's range. A kind that no joint has a limit of is missing.
    """
    time = np.concatenate([part.time for part in demands])
    joints = np.concatenate([part.joints for part in demands])
    effort = np.concatenate([part.torque[:, 3:] for part in demands])
    lower, upper, fastest, strongest = (
        np.array([getattr(limits, name) for limits in robot.limits])
        for name in ("lower", "upper", "velocity", "effort")
    )
    has_range = np.isfinite(upper - lower)
    middle = 0.5 * (np.where(has_range, lower, 0.0) + np.where(has_range, upper, 0.0))
    shares = {
        "position": (joints[:, 0] - middle) / np.where(has_range, upper - middle, np.inf),
        "velocity": joints[:, 1] / fastest,
        "effort": effort / strongest,
    }
    margins = {}
    for kind, limits in zip(shares, (upper - lower, fastest, strongest), strict=True):
        if np.isfinite(limits).any():
            values = np.abs(shares[kind])
            k, joint = np.unravel_index(int(np.argmax(values)), values.shape)
            margins[kind] = {
                "joint": robot.joint_names[int(joint)],
                "time_s": float(time[k]),
                "share": float(values[k, joint]),
            }
    return margins
