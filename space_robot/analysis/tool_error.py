"""The tool's distance from the path that its mission leads along, on inertial axes.

The wanted path follows from the reference: with zero momentum the robot's centre of mass does not
move, so attitude and joints give the pose of the tool by the masses that the flight software
assumes. The true pose follows from the base's true position and attitude and the true joints. So it
includes what the flight software does not know: a payload, and momentum that something else has
brought in.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from space_robot_control.guidance.mission import Mission, MissionSettings
from space_robot_model.elementary.matrices import norms, unit_rows
from space_robot_model.robot import Robot
from space_robot_model.robot.momentum import Motion, robot_momentum
from space_robot_model.robot.tool import tool_pose
from space_robot_msgs_py.bag.blocks import Metric
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.config.validation import validate
from space_robot_msgs_py.errors import InputError

from .described import assumed_robot_of
from .metrics import AxisMaximum, AxisRms
from .plot_series import tick_times
from .pointing import rotation_angle

Array = NDArray[np.float64]

Poses = tuple[Array, Array]
"""Orientations (N, 3, 3) and positions (N, 3), m, inertial axes."""
CHANGED = 1e-9
"""Difference of a reference from that of its mission, rad, m or 1, that has another cause than
rounding."""


class ToolPath:
    """The path that a mission leads the first tool along, on inertial axes."""

    def __init__(self, log: FlightLog, assumed: Robot) -> None:
        """Take the place where the path begins.

        Args:
            log: the first rows; the base's centre of mass is at the path's origin at the first one.
            assumed: robot as the flight software knows it; its joints are all actuated.
        """
        self._robot = assumed.nominal
        self._origin = log.base_position[:1] + self._centre(log.rows(0, 1))

    def poses(self, log: FlightLog) -> Poses:
        """Return the poses that are wanted."""
        quaternion = unit_rows(log.reference_base[:, :4])
        orientation, place = tool_pose(self._robot, quaternion, log.reference_joints[:, 0])
        return orientation, self._origin + place - self._centre(log)

    def _centre(self, log: FlightLog) -> Array:
        """Return (N, 3) m, the assumed robot's centre of mass from its base's, in the reference."""
        base, joints = log.reference_base, log.reference_joints[:, 0]
        still = np.zeros((len(base), 3)), np.zeros_like(joints)
        motion = Motion(unit_rows(base[:, :4]), still[0], joints, still[1])
        return robot_momentum(self._robot, motion).centre_of_mass


class ToolError(Metric):
    """Takes RMS and maximum of the tool's error in position and rotation."""

    def __init__(self, log: FlightLog, robot: Robot, assumed: Robot) -> None:
        """Take the place where the path begins.

        Args:
            log: the first rows; the base's centre of mass is at the path's origin at the first one.
            robot: the true robot.
            assumed: as the flight software knows it; its joints are all actuated.
        """
        self._robot, self._path = robot, ToolPath(log, assumed)
        self._rms, self._maximum = AxisRms(2), AxisMaximum(2)

    def add(self, log: FlightLog, error: Array) -> None:
        """Take further rows."""
        values = self.errors(log)
        self._rms.add(values)
        self._maximum.add(values)

    def errors(self, log: FlightLog) -> Array:
        """Return (N, 2): distance, m, and angle of the one rotation between both frames, rad."""
        desired, wanted = self._path.poses(log)
        actual, offset = tool_pose(self._robot, unit_rows(log.quaternion), log.all_positions)
        away = log.base_position + offset - wanted
        return np.column_stack((norms(away), rotation_angle(actual, desired)))

    def result(self) -> dict[str, float]:
        """``rms_m``, ``largest_m``, ``rms_deg`` and ``largest_deg``."""
        rms, largest = self._rms.value, self._maximum.value
        return {
            "rms_m": float(rms[0]),
            "largest_m": float(largest[0]),
            "rms_deg": float(np.degrees(rms[1])),
            "largest_deg": float(np.degrees(largest[1])),
        }


def leads_tool(log: FlightLog) -> bool:
    """Return whether the mission of a bag has segments, or was changed in flight.

    A mission of waypoints only does not lead the tool; the bag tells whether it was flown as
    planned.
    """
    scenario = log.flight.get("scenario")
    planned = scenario.get("mission") if isinstance(scenario, dict) else None
    if not isinstance(planned, dict) or not log.ticks:
        return False
    try:
        own = {key: planned[key] for key in MissionSettings.model_fields if key in planned}
        settings = validate(MissionSettings, own, "mission of the bag")
        if settings.has_segments:
            return True
        period, last = log.timebase.period, float(tick_times(log)[-1])
        reference = Mission(assumed_robot_of(log), settings, period).chunk(round(last / period), 1)
    except InputError:
        return False
    away = np.abs(log.reference_joints[-1, 0] - reference.joints[0, 0])
    turned = np.abs(log.reference_base[-1, :4] - reference.base[0, :4])
    return bool(max(away.max(), turned.max()) > CHANGED)


def wanted_poses(log: FlightLog) -> Poses | None:
    """Return the poses that the tool was led through.

    None: see `leads_tool`, or the bag does not tell the robot.
    """
    if not leads_tool(log):
        return None
    try:
        return ToolPath(log, assumed_robot_of(log)).poses(log)
    except InputError:
        return None
