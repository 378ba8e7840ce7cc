"""The tool's distance from the path that its mission leads along, on inertial axes.

The wanted path follows from the reference: with zero momentum the robot's centre of mass does not
move, so attitude and joints give the pose of the tool by the masses that the flight software
assumes. The true pose follows from the base's true position and attitude and the true joints. So it
includes what the flight software does not know of masses and angular momentum, such as a payload.

Nothing on board can hold the common centre of mass where drag, thrusters or a captured target move
it, so the path moves with it; by how much is a number of its own.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from space_robot_control.guidance.mission import Mission, MissionSettings
from space_robot_model.elementary.matrices import norms, unit_rows
from space_robot_model.robot import Robot
from space_robot_model.robot.momentum import Motion, robot_momentum
from space_robot_model.robot.placements import tool_pose
from space_robot_msgs_py.bag.flight_log import FlightLog, Metric
from space_robot_msgs_py.config.validation import validate
from space_robot_msgs_py.errors import InputError
from space_robot_sim.environment.captures import Captures

from .described import assumed_robot_of, captures_of
from .metrics import AxisMaximum, AxisRms
from .momentum import happens_in
from .plot_series import tick_times
from .pointing import rotation_angle

Array = NDArray[np.float64]

Poses = tuple[Array, Array]
"""Orientations (N, 3, 3) and positions (N, 3), m, inertial axes."""
CHANGED = 1e-9
"""Difference of a reference from that of its mission, rad, m or 1, that has another cause than
rounding."""


class ToolPath:
    """The path that a mission leads the first tool along, on inertial axes, block by block."""

    def __init__(self, log: FlightLog, captures: Captures, assumed: Robot) -> None:
        """Take the place where the path begins.

        The flight software knows where the base is, and places it by the frame of the assumed
        robot, which is not the true one's if the true base's centre of mass is elsewhere.

        Args:
            log: the first rows; the assumed base's frame is at the path's origin at the first one.
            captures: of the robot that flew, payload included.
            assumed: robot as the flight software knows it.
        """
        self._robot, self._captures = assumed.nominal, captures
        first = log.rows(0, 1)
        true = captures.robot_at(first.first_tick - 1)  # the first tick's events follow
        reference = unit_rows(first.reference_base[:, :4]), first.reference_joints[:, 0]
        rest = [[spring.rest for spring in true.springs]]
        _, known = tool_pose(self._robot, *reference)
        _, place = tool_pose(true, reference[0], np.hstack([reference[1], rest]))
        self._origin = first.base_position + (place - known) + _centre(self._robot, *reference)
        self._begin = _true_centre(true, first)
        """Where the common centre of mass of what flies would be without `drift`."""

    def poses(self, log: FlightLog) -> tuple[Array, Array, Array]:
        """Return orientations and positions that are wanted, and the `drift` that they have."""
        quaternion, joints = unit_rows(log.reference_base[:, :4]), log.reference_joints[:, 0]
        orientation, place = tool_pose(self._robot, quaternion, joints)
        drift = self._drift(log)
        wanted = self._origin + place - _centre(self._robot, quaternion, joints) + drift
        return orientation, wanted, drift

    def _drift(self, log: FlightLog) -> Array:
        """Return (N, 3) m, how far the common centre of mass has moved since the first row.

        A capture or a release changes which bodies it is of, and moves none of them.
        """
        start, stop = log.first_tick, log.first_tick + log.ticks
        drift = np.empty((log.ticks, 3))
        events = self._captures.ticks(start, stop)
        for begin, end in pairwise(sorted({start, *events, stop})):
            rows = log.rows(begin - start, end - start)
            if begin in events:
                row = rows.rows(0, 1)
                before = _true_centre(self._captures.robot_at(begin - 1), row) - self._begin
                for exchange in self._captures.at(begin):
                    happens_in(self._captures, exchange, row)
                self._begin = _true_centre(self._captures.robot_at(begin), row) - before
            centre = _true_centre(self._captures.robot_at(begin), rows)
            drift[begin - start : end - start] = centre - self._begin
        return drift


def _centre(robot: Robot, quaternion: Array, joints: Array) -> Array:
    """Return (N, 3) m, the robot's centre of mass from its base's frame, inertial axes."""
    still = np.zeros((len(quaternion), 3)), np.zeros_like(joints)
    return robot_momentum(robot, Motion(quaternion, still[0], joints, still[1])).centre_of_mass


def _true_centre(robot: Robot, log: FlightLog) -> Array:
    return log.base_position + _centre(robot, unit_rows(log.quaternion), log.all_positions)


class ToolError(Metric):
    """Takes RMS and maximum of the tool's error in position and rotation."""

    def __init__(self, log: FlightLog, captures: Captures, assumed: Robot) -> None:
        """Take the place where the path begins; see `ToolPath`."""
        self._robot = captures.robot_at(log.first_tick)
        self._path = ToolPath(log, captures, assumed)
        self._rms, self._maximum, self._drift = AxisRms(2), AxisMaximum(2), 0.0

    def add(self, log: FlightLog, error: Array) -> None:
        """Take further rows."""
        values = self.errors(log)
        self._rms.add(values)
        self._maximum.add(values)

    def errors(self, log: FlightLog) -> Array:
        """Return (N, 2): distance, m, and angle of the one rotation between both frames, rad."""
        desired, wanted, drift = self._path.poses(log)
        self._drift = max(self._drift, float(norms(drift).max()))
        actual, offset = tool_pose(self._robot, unit_rows(log.quaternion), log.all_positions)
        away = log.base_position + offset - wanted
        return np.column_stack((norms(away), rotation_angle(actual, desired)))

    def result(self) -> dict[str, float]:
        """``rms_m``, ``largest_m``, ``rms_deg``, ``largest_deg``, and ``drift_m`` of the path."""
        rms, largest = self._rms.value, self._maximum.value
        return {
            "rms_m": float(rms[0]),
            "largest_m": float(largest[0]),
            "rms_deg": float(np.degrees(rms[1])),
            "largest_deg": float(np.degrees(largest[1])),
            "drift_m": self._drift,
        }


def leads_tool(log: FlightLog) -> bool:
    """Return whether the mission of a bag leads the tool, or was changed in flight.

    One of the joints only does not; the bag tells whether it was flown as planned.
    """
    scenario = log.flight.get("scenario")
    planned = scenario.get("mission") if isinstance(scenario, dict) else None
    if not isinstance(planned, dict) or not log.ticks:
        return False
    try:
        own = {key: planned[key] for key in MissionSettings.model_fields if key in planned}
        settings = validate(MissionSettings, own, "mission of the bag")
        period, last = log.timebase.period, float(tick_times(log)[-1])
        mission = Mission(assumed_robot_of(log), settings, period)
        if mission.leads_tool:
            return True
        reference = mission.chunk(round(last / period), 1)
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
        orientation, position, _ = ToolPath(log, captures_of(log), assumed_robot_of(log)).poses(log)
        return orientation, position
    except InputError:
        return None
