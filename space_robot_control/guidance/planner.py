"""The plan of a mission: a course of the joints and one of the base for each of its segments."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from space_robot_model.elementary.spline import CubicSpline
from space_robot_model.robot import Robot
from space_robot_msgs_py.config.columns import read_columns
from space_robot_msgs_py.errors import InputError

from .checks import FARTHEST, LONGEST_S, check_piece
from .courses import BentLeg, Course, Piece, QuinticLeg, Slew, knots, quintic, turn_between
from .durations import shortest_duration
from .free_base import free_attitude
from .limits import MissionLimits, shown_unit
from .reactionless import reactionless_path
from .segments import Segment, ToolGoal
from .spline_courses import SplineCourse
from .tool_courses import SegmentStart, ToolCourses
from .tool_path import ToolFollower
from .trajectory_table import TrajectoryTable

Array = NDArray[np.float64]

TRIAL_S = 10.0
"""Duration that a fast segment is tried with."""

MOST_AWAY = 4.0 * np.pi
"""Largest way of a joint in a reactionless motion, rad or m; its steps would be too long."""

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
        """Origin of the inertial frame, that of the base's frame at t = 0, from the robot's CoM."""

    @np.errstate(all="ignore")  # numbers that overflow are refused, in one line
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
                if piece.end - begin > LONGEST_S:
                    raise InputError(f"all together last more than {LONGEST_S:g} s (11 days)")
            except InputError as error:
                raise InputError(f"segment {number}: {error}") from None
            pieces.append(piece)
            self._time, self._joints, self._quaternion = piece.end, piece.goal, piece.attitude
        return pieces

    def _piece(self, segment: Segment) -> Piece:
        if (columns := segment.trajectory) is None and segment.file is not None:
            columns = read_columns(Path(segment.file))
        if columns is not None:
            trajectory = TrajectoryTable(columns, self._robot.joint_names)
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
        turn = self._turn(segment)
        if segment.tool is None:
            make = self._joint_maker(segment, turn)
        else:
            courses = self._tool_courses(segment.tool)
            if segment.is_base_free and segment.tool.frame != "base":
                return courses.free
            make = partial(courses.led, turn)
        return self._freed(make) if segment.is_base_free else make

    def _tool_courses(self, goal: ToolGoal) -> ToolCourses:
        follower = self._tools.setdefault(goal.link, ToolFollower(self._robot, goal.link))
        start = SegmentStart(self._time, self._joints, self._quaternion)
        return ToolCourses(self._robot, follower, goal, start, self._origin)

    def _freed(self, make: Maker) -> Maker:
        """Return a maker of the same course of the joints, while the base turns freely."""
        begin, quaternion = self._time, self._quaternion

        def freed(span: float) -> tuple[Course, Course]:
            joints, _ = make(span)
            return joints, free_attitude(self._robot, joints, quaternion, begin, knots(span))

        return freed

    def _joint_maker(self, segment: Segment, turn: Callable[[float], Slew]) -> Maker:
        if segment.reactionless_deg is not None:
            path = self._reactionless(segment.reactionless_deg)
            return lambda span: (self._along(path, span), turn(span))
        goal = self._joints
        if segment.joints_deg is not None:
            goal = self._of_degrees(segment.joints_deg, "joints_deg")
        begin, start = self._time, self._joints
        if segment.bends_deg is not None:
            bends = np.array([self._of_degrees(bend, "bends_deg") for bend in segment.bends_deg])
            return lambda span: (BentLeg(begin, span, start, goal - start, bends), turn(span))
        return lambda span: (QuinticLeg(begin, span, start, goal - start), turn(span))

    def _of_degrees(self, values: Sequence[float], key: str) -> Array:
        if len(values) != self._robot.n:
            raise InputError(f"{key}: {self._robot.n} values were expected, got {len(values)}")
        positions = self._robot.from_degrees(values)
        if (far := np.abs(positions)).max() > FARTHEST:
            joint = int(np.argmax(far))
            scale, unit = shown_unit(self._robot, joint)
            raise InputError(
                f"{key}: joint {self._robot.joint_names[joint]!r}: at most {FARTHEST * scale:.6g} "
                f"{unit} can be flown, got {values[joint]:g}"
            )
        return positions

    def _turn(self, segment: Segment) -> Callable[[float], Slew]:
        begin, start, axis, angle = self._time, self._quaternion, np.array([1.0, 0.0, 0.0]), 0.0
        if segment.base is not None:
            axis, angle = turn_between(start, segment.base.unit_quaternion)
        return lambda span: Slew(begin, span, start, axis, angle)

    def _reactionless(self, values: Sequence[float]) -> CubicSpline:
        goal = self._of_degrees(values, "reactionless")
        if (away := np.abs(goal - self._joints)).max() > MOST_AWAY:
            name = self._robot.joint_names[int(np.argmax(away))]
            raise InputError(
                f"reactionless: joint {name!r} is {away.max():.4g} rad or m away, at most "
                f"{MOST_AWAY:.4g} are planned"
            )
        return reactionless_path(self._robot, self._quaternion, self._joints, goal)

    def _along(self, path: CubicSpline, span: float) -> SplineCourse:
        """Return the course along a path over (0, 1), quintic in time."""
        times = knots(span)
        share, _, _ = quintic(times / span)
        return SplineCourse(self._time, CubicSpline(times, path.at(share)[:, 0]))
