"""The tool's distance from the path that its mission leads along, on inertial axes.

The wanted path follows from the reference: with zero momentum the robot's centre of mass does not
move, so attitude and joints give the pose of the tool by the masses that the flight software
assumes. The true pose follows from the base's true position and attitude and the true joints. So it
includes what the flight software does not know of masses and angular momentum, such as a payload.

Nothing on board can hold the common centre of mass where drag, thrusters or a captured target move
it, so the path moves with it; by how much is a number of its own.
"""

from __future__ import annotations

from contextlib import suppress
from itertools import pairwise

import numpy as np

from space_robot_control.guidance.mission import Mission
from space_robot_model.elementary.matrices import Array, norms, unit_rows
from space_robot_model.robot import Robot
from space_robot_model.robot.momentum import Motion, robot_momentum
from space_robot_model.robot.placements import tool_pose
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.errors import InputError

from .analysed_log import AnalysedLog
from .described import flown_captures, flown_settings
from .momentum import happens_in
from .pointing import rotation_angle
from .series import Definition, TimeSeries, series

Poses = tuple[Array, Array]
"""Orientations (N, 3, 3) and positions (N, 3), m, inertial axes."""
CHANGED = 1e-9
"""Difference of a reference from that of its mission, rad, m or 1, that has another cause than
rounding."""


class ToolPath:
    """The path that a mission leads the first tool along; rows are asked for in their order."""

    def __init__(self, log: FlightLog) -> None:
        """Take the place where the path begins; InputError: a robot is not known.

        The flight software knows where the base is, and places it by the frame of the assumed
        robot, which is not the true one's if the true base's centre of mass is elsewhere. That
        frame is at the path's origin at the first row.
        """
        self._log, self._captures = log, flown_captures(log)
        self._robot = flown_settings(log).robots.controller.nominal
        first = log.rows(0, 1)
        true = self._captures.robot_at(first.first_tick - 1)  # the first tick's events follow
        reference = unit_rows(first.reference_base[:, :4]), first.reference_joints[:, 0]
        rest = [[spring.rest for spring in true.springs]]
        _, known = tool_pose(self._robot, *reference)
        _, place = tool_pose(true, reference[0], np.hstack([reference[1], rest]))
        self._origin = first.base_position + (place - known) + _centre(self._robot, *reference)
        self._begin = _true_centre(true, first)
        """Where the common centre of mass of what flies would be without drift."""
        self._true = self._captures.robot_at(log.first_tick)

    def wanted(self, start: int, stop: int) -> tuple[Array, Array, Array]:
        """Return orientations and positions that are wanted, and the drift that they have."""
        rows = self._log.rows(start, stop)
        quaternion, joints = unit_rows(rows.reference_base[:, :4]), rows.reference_joints[:, 0]
        orientation, place = tool_pose(self._robot, quaternion, joints)
        drift = self._drift(rows)
        wanted = self._origin + place - _centre(self._robot, quaternion, joints) + drift
        return orientation, wanted, drift

    def errors(self, start: int, stop: int) -> Array:
        """Return distance, m, rotation, rad, and drift of the path, m, (stop - start, 3)."""
        desired, wanted, drift = self.wanted(start, stop)
        rows = self._log.rows(start, stop)
        actual, offset = tool_pose(self._true, unit_rows(rows.quaternion), rows.all_positions)
        away = rows.base_position + offset - wanted
        return np.column_stack([norms(away), rotation_angle(actual, desired), norms(drift)])

    def _drift(self, rows: FlightLog) -> Array:
        """Return (N, 3) m, how far the common centre of mass has moved since the first row.

        A capture or a release changes which bodies it is of, and moves none of them.
        """
        start, stop = rows.first_tick, rows.first_tick + rows.ticks
        drift = np.empty((rows.ticks, 3))
        events = self._captures.ticks(start, stop)
        for begin, end in pairwise(sorted({start, *events, stop})):
            part = rows.rows(begin - start, end - start)
            if begin in events:
                row = part.rows(0, 1)
                before = _true_centre(self._captures.robot_at(begin - 1), row) - self._begin
                for exchange in self._captures.at(begin):
                    happens_in(self._captures, exchange, row)
                self._begin = _true_centre(self._captures.robot_at(begin), row) - before
            centre = _true_centre(self._captures.robot_at(begin), part)
            drift[begin - start : end - start] = centre - self._begin
        return drift


def _centre(robot: Robot, quaternion: Array, joints: Array) -> Array:
    """Return (N, 3) m, the robot's centre of mass from its base's frame, inertial axes."""
    still = np.zeros((len(quaternion), 3)), np.zeros_like(joints)
    return robot_momentum(robot, Motion(quaternion, still[0], joints, still[1])).centre_of_mass


def _true_centre(robot: Robot, log: FlightLog) -> Array:
    return log.base_position + _centre(robot, unit_rows(log.quaternion), log.all_positions)


@series(
    "tool on its path",
    {
        "tool": Definition("m", "distance of the end effector from the path of its mission"),
        "tool_rotation": Definition("rad", "rotation of the end effector from its path"),
        "path_drift": Definition(
            "m",
            "of the path, with the common centre of mass that forces from outside move",
            ("max",),
        ),
    },
)
def tool(flight: AnalysedLog) -> TimeSeries:
    """Return the tool's error on inertial axes."""
    path = ToolPath(flight.log)
    return TimeSeries({"tool": [0], "tool_rotation": [1], "path_drift": [2]}, path.errors)


def leads_tool(log: FlightLog) -> bool:
    """Return whether the mission of a log leads the tool, or was changed in flight.

    One of the joints only does not; the bag tells whether it was flown as planned.
    """
    if log.scenario is not None:
        return bool(log.scenario.reference.leads_tool)
    if not log.flight.get("mission") or not log.ticks:
        return False
    try:
        settings, period, last = flown_settings(log), log.timebase.period, float(log.time[-1])
        mission = Mission(settings.robots.controller, settings.mission, period)
        if mission.leads_tool:
            return True
        reference = mission.chunk(round(last / period), 1)
    except InputError:
        return False
    away = np.abs(log.reference_joints[-1, 0] - reference.joints[0, 0])
    turned = np.abs(log.reference_base[-1, :4] - reference.base[0, :4])
    return bool(max(away.max(), turned.max()) > CHANGED)


def wanted_poses(log: FlightLog) -> Poses | None:
    """Return the poses that the tool was led through; None: none, or the robot is not known."""
    if leads_tool(log):
        with suppress(InputError):
            return ToolPath(log).wanted(0, log.ticks)[:2]
    return None
