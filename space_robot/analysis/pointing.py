"""The end effector's pointing in the inertial frame, which the mission is flown for.

The tool's pose follows from base attitude and joint angles (`space_robot_model.robot.tool`), once
with the measured ones and once with the desired ones. The base's position is free in this mission
("semi-floating"), so both poses share it and its drift is given separately.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from space_robot_model.elementary.arctangent import arctan2
from space_robot_model.elementary.matrices import unit_rows
from space_robot_model.robot import Robot
from space_robot_model.robot.tool import tool_pose
from space_robot_msgs_py.bag.blocks import Metric
from space_robot_msgs_py.bag.flight_log import FlightLog

from .metrics import AxisMaximum, AxisRms, Table

Array = NDArray[np.float64]

ARCSEC = np.pi / 180.0 / 3600.0
"""rad."""


class PointingError(NamedTuple):
    """The end effector's error, tick by tick."""

    boresight: Array
    """(N,) rad, between the measured and the desired direction of the tool's z axis."""
    rotation: Array
    """(N,) rad, of the one rotation that turns the desired frame into the measured one."""
    position: Array
    """(N,) m, between measured and desired position, the base at its measured position in both."""
    base_drift: Array
    """(N,) m, of the base's CoM from where it was at the first tick."""


class Pointing(Metric):
    """Takes RMS, maximum and last value of each number of a `PointingError`."""

    def __init__(self, log: FlightLog, robot: Robot) -> None:
        """``log``: the first rows; the base's drift counts from there."""
        self._robot, self._start = robot, log.base_position[:1].copy()
        figures = len(PointingError._fields)
        self._rms, self._maximum = AxisRms(figures), AxisMaximum(figures)
        self._end: Array = np.empty(0)

    def add(self, log: FlightLog, error: Array) -> None:
        """Take further rows."""
        values = np.stack(pointing_error(log, self._robot, self._start)).T
        self._rms.add(values)
        self._maximum.add(values)
        self._end = values[-1]

    def result(self) -> Table:
        """``rms``, ``max`` and ``end`` by figure."""
        names = ("boresight_rad", "rotation_rad", "tool_position_m", "base_drift_m")
        kinds = {"rms": self._rms.value, "max": self._maximum.value, "end": self._end}
        return {
            name: {kind: float(values[i]) for kind, values in kinds.items()}
            for i, name in enumerate(names)
        }


def pointing_error(log: FlightLog, robot: Robot, start: Array | None = None) -> PointingError:
    """Compute the error of the tool's pose at every tick of a flight of ``robot``.

    Joints without motors are desired to be at rest where their springs hold them.
    ``start``: (1, 3) m, where the base was when the flight began (None: at the first tick here).
    """
    start = log.base_position[:1] if start is None else start
    actual, place = tool_pose(robot, unit_rows(log.quaternion), log.all_positions)
    rest = np.broadcast_to([spring.rest for spring in robot.springs], log.passive_positions.shape)
    joints = np.hstack([log.reference_joints[:, 0], rest])
    desired, wanted = tool_pose(robot, unit_rows(log.reference_base[:, :4]), joints)
    return PointingError(
        boresight=angle_between(actual[:, :, 2], desired[:, :, 2]),
        rotation=rotation_angle(actual, desired),
        position=np.linalg.norm(place - wanted, axis=1),
        base_drift=np.linalg.norm(log.base_position - start, axis=1),
    )


def angle_between(first: Array, second: Array) -> Array:
    """(N,) rad between unit vectors (N, 3), as exact for small angles as for large ones."""
    across = np.linalg.norm(np.cross(first, second), axis=1)
    return arctan2(across, np.sum(first * second, axis=1))


def rotation_angle(first: Array, second: Array) -> Array:
    """(N,) rad of the rotation ``first second^T`` (N, 3, 3), exact for small angles.

    ``sin = |vee(R - R^T)| / 2``, ``cos = (trace(R) - 1) / 2``.
    """
    axes = [(first[:, :, k], second[:, :, k]) for k in range(3)]
    # vee(a b^T - b a^T) = b x a for each pair of columns; trace(R) is the sum of their products
    sine = 0.5 * np.linalg.norm(sum(np.cross(b, a) for a, b in axes), axis=1)
    cosine = 0.5 * (sum(np.sum(a * b, axis=1) for a, b in axes) - 1.0)
    return arctan2(sine, cosine)
