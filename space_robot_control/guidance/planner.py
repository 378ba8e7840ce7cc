"""The plan of a mission: a course of the joints and one of the base for each of its segments."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from space_robot_model.dynamics.attitude import rotation_matrix
from space_robot_model.elementary.matrices import norm, product
from space_robot_model.elementary.rotations import quaternion_of_rotation
from space_robot_model.elementary.spline import CubicSpline
from space_robot_model.robot import Robot
from space_robot_msgs_py.errors import InputError

from .checks import check_piece
from .courses import (
    AttitudeCourse,
    Course,
    Piece,
    QuinticLeg,
    Slew,
    SplineCourse,
    multiplied,
    quintic,
    turn_between,
    turned_by,
)
from .durations import MissionLimits, shortest_duration
from .free_base import free_attitude, twists_along, with_middles
from .reactionless import reactionless_path
from .segments import Segment, ToolGoal
from .tool_path import ToolFollower
from .trajectory_file import Trajectory, read_columns

Array = NDArray[np.float64]

KNOT_S = 0.01
"""Spacing of the knots of a spline along a path, s."""
FEWEST_KNOTS = 101
FREE_TOLERANCE = 1e-7
"""Largest error of a tool on its path with the base free, m and rad."""
TRIAL_S = 10.0
"""Duration that a fast segment is tried with."""


Maker = Callable[[float], tuple[Course, Course]]
"""Makes the courses of joints and base of a segment of a duration in s."""


class Planner:
    """Plans segments one after the other, each from where the one before ends."""

    def __init__(
        self, robot: Robot, joints: Array, quaternion: Array, limits: MissionLimits
    ) -> None:
        """Begin a plan.

        Args:
            robot: as the flight software knows it.
            joints: (n,) at t = 0, rad, or m of prismatic joints.
            quaternion: (4,) of the base at t = 0, unit.
            limits: of fast segments, beside those of the joints.
        """
        self._robot, self._limits = robot.nominal, limits
        self._tools: dict[str | None, ToolFollower] = {}
        self._time, self._joints, self._quaternion = 0.0, joints, quaternion
        pose = ToolFollower(self._robot, None).pose(quaternion, joints)
        self._origin = pose.position - pose.from_base
        """Origin of the inertial frame, the base's CoM at t = 0, from the robot's CoM."""

    def plan(
        self, begin: float, joints: Array, quaternion: Array, segments: Sequence[Segment]
    ) -> list[Piece]:
        """Return the plan of segments that follow one another from a time, posture and attitude on.

        Raises:
            InputError: a segment cannot be flown; names it, with time, joint and amount.
        """
        pieces, self._time, self._joints, self._quaternion = [], begin, joints, quaternion
        for number, segment in enumerate(segments, 1):
            try:
                piece = self._piece(segment)
                check_piece(self._robot, piece)
            except InputError as error:
                raise InputError(f"segment {number}: {error}") from None
            pieces.append(piece)
            self._time, self._joints, self._quaternion = piece.end, piece.goal, piece.attitude
        return pieces

    def _piece(self, segment: Segment) -> Piece:
        if (columns := segment.trajectory) is None and segment.file is not None:
            columns = read_columns(Path(segment.file))
        if columns is not None:
            trajectory = Trajectory(columns, self._robot.joint_names)
            courses = trajectory.courses(self._time, self._joints, self._quaternion)
            return self._ended(trajectory.duration, *courses, segment.motion)
        make = self._maker(segment)
        span = segment.hold or segment.duration
        if span is None:
            trial = make(TRIAL_S)
            span = shortest_duration(self._robot, self._limits, *trial, self._time, TRIAL_S)
        return self._ended(span, *make(span), segment.motion)

    def _ended(self, span: float, joints: Course, base: Course, motion: str) -> Piece:
        end = np.array([self._time + span])
        goal, attitude = joints.at(end)[0, 0], base.at(end)[0, :4]
        return Piece(self._time, self._time + span, joints, base, goal, attitude, motion)

    def _maker(self, segment: Segment) -> Maker:
        turn, goal = self._turn(segment), segment.tool
        if goal is not None:
            if segment.is_base_free and goal.frame != "base":
                return partial(self._follow_tool_freely, goal)
            make = partial(self._follow_tool, goal, turn)
        else:
            make = self._joint_maker(segment, turn)
        if not segment.is_base_free:
            return make

        def freed(span: float) -> tuple[Course, Course]:
            joints, _ = make(span)
            course = free_attitude(
                self._robot, joints, self._quaternion, self._time, _knots(span)
            )
            return joints, course

        return freed

    def _joint_maker(self, segment: Segment, turn: Callable[[float], Slew]) -> Maker:
        if segment.reactionless_deg is not None:
            path = self._reactionless(segment.reactionless_deg)
            return lambda span: (self._along(path, span), turn(span))
        goal = self._joints
        if segment.joints_deg is not None:
            goal = self._of_degrees(segment.joints_deg, "joints_deg")
        begin, start = self._time, self._joints
        return lambda span: (QuinticLeg(begin, span, start, goal - start), turn(span))

    def _of_degrees(self, values: Sequence[float], key: str) -> Array:
        if len(values) != self._robot.n:
            raise InputError(f"{key}: {self._robot.n} values were expected, got {len(values)}")
        return self._robot.from_degrees(values)

    def _turn(self, segment: Segment) -> Callable[[float], Slew]:
        begin, start, axis, angle = self._time, self._quaternion, np.array([1.0, 0.0, 0.0]), 0.0
        if segment.base is not None:
            axis, angle = turn_between(start, segment.base.unit_quaternion)
        return lambda span: Slew(begin, span, start, axis, angle)

    def _follow_tool(
        self, goal: ToolGoal, turn: Callable[[float], Slew], span: float
    ) -> tuple[Course, Course]:
        """Plan a straight line and the shortest turn of the tool, both quintic in time."""
        follower, times = self._follower(goal), _knots(span)
        slew, (share, _, _) = turn(span), quintic(times / span)
        attitudes = slew.at(self._time + times)[:, :4]
        positions, rotations = self._path(goal, follower, attitudes, share)
        from_base = goal.frame == "base"
        joints, reached = follower.follow(attitudes, positions, rotations, from_base, self._joints)
        if reached < len(times):
            pose = follower.pose(attitudes[reached], joints[reached])
            left = positions[-1] - (pose.from_base if from_base else pose.position)
            raise InputError(
                f"the tool cannot follow its path beyond t = {self._time + times[reached]:.2f} s, "
                f"{norm(left):.3g} m from its goal: out of reach, or a singular posture"
            )
        return SplineCourse(self._time, CubicSpline(times, joints)), slew

    def _follow_tool_freely(self, goal: ToolGoal, span: float) -> tuple[Course, Course]:
        """Plan the same while the base turns freely; goals are on inertial axes."""
        follower, times = self._follower(goal), _knots(span)
        share = with_middles(times) / span
        positions, rotations = self._path(goal, follower, np.empty((0, 4)), quintic(share)[0])
        twists = twists_along(positions, rotations, share, span)
        joints, attitudes, error = follower.follow_free(
            positions, rotations, twists, float(times[1]), self._joints, self._quaternion
        )
        if not error <= FREE_TOLERANCE:
            raise InputError(
                f"the tool cannot follow its path with the base free: {error:.3g} m or rad beside "
                "it; out of reach, or near a dynamic singularity"
            )
        base = AttitudeCourse(self._time, CubicSpline(times, attitudes))
        return SplineCourse(self._time, CubicSpline(times, joints)), base

    def _follower(self, goal: ToolGoal) -> ToolFollower:
        return self._tools.setdefault(goal.link, ToolFollower(self._robot, goal.link))

    def _path(
        self, goal: ToolGoal, follower: ToolFollower, attitudes: Array, share: Array
    ) -> tuple[Array, Array]:
        """Return positions (K, 3), and orientations (K, 3, 3) on inertial axes; (0, 3, 3): free."""
        here = follower.pose(self._quaternion, self._joints)
        turn = _matrix(goal.unit_quaternion) if goal.is_given else None
        xyz = None if goal.xyz is None else np.array(goal.xyz)
        if goal.frame == "base":
            axes = np.array([_matrix(attitude) for attitude in attitudes])
            first = product(axes[0].T, here.from_base)
            line = _line(first, first if xyz is None else xyz, share)
            positions = np.array([product(a, p) for a, p in zip(axes, line, strict=True)])
            if turn is None:
                return positions, np.empty((0, 3, 3))
            inner = _turned(product(axes[0].T, here.rotation), turn, share)
            return positions, np.array([product(a, r) for a, r in zip(axes, inner, strict=True)])
        end = here.position
        if xyz is not None:
            end = (here.position if goal.frame == "start" else self._origin) + xyz
        positions = _line(here.position, end, share)
        if turn is None:
            return positions, np.empty((0, 3, 3))
        last = product(turn, here.rotation) if goal.frame == "start" else turn
        return positions, _turned(here.rotation, last, share)

    def _reactionless(self, values: Sequence[float]) -> CubicSpline:
        goal = self._of_degrees(values, "reactionless")
        return reactionless_path(self._robot, self._quaternion, self._joints, goal)

    def _along(self, path: CubicSpline, span: float) -> SplineCourse:
        """Return the course along a path over (0, 1), quintic in time."""
        times = _knots(span)
        share, _, _ = quintic(times / span)
        return SplineCourse(self._time, CubicSpline(times, path.at(share)[:, 0]))


def _knots(span: float) -> Array:
    return np.linspace(0.0, span, max(FEWEST_KNOTS, math.ceil(span / KNOT_S) + 1))


def _matrix(quaternion: Array) -> Array:
    matrix = np.empty((3, 3))
    rotation_matrix(quaternion, matrix)
    return matrix


def _line(first: Array, last: Array, share: Array) -> Array:
    return first + (last - first) * share[:, np.newaxis]


def _turned(first: Array, last: Array, share: Array) -> Array:
    """Return rotations (K, 3, 3) on the shortest turn from ``first`` to ``last``."""
    start, goal = quaternion_of_rotation(first), quaternion_of_rotation(last)
    axis, angle = turn_between(start, goal)
    steps = multiplied(start, turned_by(axis, angle * share))
    return np.array([_matrix(step) for step in steps])
