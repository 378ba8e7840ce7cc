"""The plan of a mission: a course of the joints and one of the base for each of its segments."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from space_robot_model.elementary.matrices import norm
from space_robot_model.elementary.splines import CubicSpline
from space_robot_model.orbit.ephemeris import Ephemeris
from space_robot_model.robot import Robot
from space_robot_msgs_py.config.columns import read_columns
from space_robot_msgs_py.errors import InputError

from .checks import FARTHEST, LONGEST_S, check_piece
from .courses import (
    BaseMotion,
    BentLeg,
    Course,
    Piece,
    QuinticLeg,
    Slew,
    at_rest,
    knots,
    quintic,
    turn_between,
)
from .durations import shortest_duration
from .free_base import free_attitude
from .limits import MissionLimits, shown_unit
from .matched_slew import MatchedSlew
from .pointing import PointingCourse, PointingGoal
from .reactionless import reactionless_path
from .segments import BaseTurn, Segment, ToolGoal
from .spline_courses import SplineCourse
from .tool_courses import SegmentStart, ToolCourses
from .tool_path import ToolFollower
from .trajectory_table import TrajectoryTable

Array = NDArray[np.float64]

TRIAL_S = 10.0
"""Duration that a fast segment is tried with."""

MOST_AWAY = 4.0 * np.pi
"""Largest way of a joint in a reactionless motion, rad or m; its steps would be too long."""

ORBIT_AXES = PointingGoal(point="nadir")
"""The frame of tools' goals that turns with the orbit, as a base that points."""
NEEDS_ORBIT = "needs an orbit: choose one (--orbit NAME), or set mission.assumed_orbit"

Maker = Callable[[float], tuple[Course, Course]]
"""Makes the courses of joints and base of a segment of a duration in s."""


class LedBase(NamedTuple):
    """How a segment leads the base."""

    make: Callable[[float], Course]
    """Makes its course in a duration in s."""
    course: Course | None = None
    """What it goes on along after that; None: it is at rest."""
    mode: PointingGoal | None = None


class Planner:
    """Plans segments one after the other, each from where the one before ends."""

    def __init__(
        self,
        robot: Robot,
        joints: Array,
        quaternion: Array,
        limits: MissionLimits,
        ephemeris: Callable[[], Ephemeris | None] = lambda: None,
    ) -> None:
        """Begin a plan.

        Args:
            robot: as the flight software knows it.
            joints: (n,) at t = 0, rad, or m of prismatic joints.
            quaternion: (4,) of the base at t = 0, unit.
            limits: of fast segments, beside those of the joints.
            ephemeris: returns that of the assumed orbit; None: there is none.
        """
        self._robot, self._limits, self._ephemeris = robot.nominal, limits, ephemeris
        self._tools: dict[str | None, ToolFollower] = {}
        self._time, self._joints, self._base = 0.0, joints, BaseMotion(quaternion)
        pose = ToolFollower(self._robot, None).pose(quaternion, joints)
        self._origin = pose.position - pose.from_base
        """Origin of the inertial frame, that of the base's frame at t = 0, from the robot's CoM."""

    @property
    def base(self) -> BaseMotion:
        """How the base goes on after the last planned segment."""
        return self._base

    @np.errstate(all="ignore")  # numbers that overflow are refused, in one line
    def plan(
        self, begin: float, joints: Array, base: BaseMotion, segments: Sequence[Segment]
    ) -> list[Piece]:
        """Return the plan of segments that follow one another from a time, posture and attitude on.

        Raises:
            InputError: a segment cannot be flown; names it, with time, joint and amount.
        """
        pieces, self._time, self._joints, self._base = [], begin, joints, base
        for number, segment in enumerate(segments, 1):
            try:
                piece, course = self._piece(segment)
                check_piece(self._robot, piece)
                if isinstance(course, PointingCourse):
                    course.check(piece.begin, piece.end)
                if piece.end - begin > LONGEST_S:
                    raise InputError(f"all together last more than {LONGEST_S:g} s (11 days)")
            except InputError as error:
                raise InputError(f"segment {number}: {error}") from None
            pieces.append(piece)
            self._time, self._joints = piece.end, piece.goal
            self._base = BaseMotion(piece.attitude, course, piece.mode)
        return pieces

    def _piece(self, segment: Segment) -> tuple[Piece, Course | None]:
        """Return a planned segment, and what the base goes on along; None: it is at rest then."""
        if (columns := segment.trajectory) is None and segment.file is not None:
            columns = read_columns(Path(segment.file))
        if columns is not None:
            trajectory = TrajectoryTable(columns, self._robot.joint_names)
            courses = trajectory.courses(self._time, self._joints, self._base)
            base = BaseMotion(self._base.quaternion) if trajectory.leads_base else self._base
            piece = self._ended(trajectory.duration, *courses, segment.motion)
            return piece._replace(mode=base.mode), base.course
        led = self._led(segment)
        make = self._maker(segment, led.make)
        span = segment.hold or segment.duration
        if span is None:
            trial = make(TRIAL_S)
            span = shortest_duration(self._robot, self._limits, *trial, self._time, TRIAL_S)
        piece = self._ended(span, *make(span), segment.motion)
        return piece._replace(mode=led.mode), led.course

    def _ended(self, span: float, joints: Course, base: Course, motion: str) -> Piece:
        end = np.array([self._time + span])
        goal, attitude = joints.at(end)[0, 0], base.at(end)[0, :4]
        return Piece(self._time, self._time + span, joints, base, goal, attitude, motion)

    def _maker(self, segment: Segment, turn: Callable[[float], Course]) -> Maker:
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
        start = SegmentStart(self._time, self._joints, self._base.quaternion)
        axes: Course | None = None
        if goal.frame == "orbit":
            if (ephemeris := self._ephemeris()) is None:
                raise InputError(f"tool.frame: orbit {NEEDS_ORBIT}")
            axes = PointingCourse(ORBIT_AXES, ephemeris, self._time, self._base.quaternion)
        return ToolCourses(self._robot, follower, goal, start, self._origin, axes)

    def _freed(self, make: Maker) -> Maker:
        """Return a maker of the same course of the joints, while the base turns freely."""
        begin, quaternion = self._time, self._base.quaternion

        def freed(span: float) -> tuple[Course, Course]:
            joints, _ = make(span)
            return joints, free_attitude(self._robot, joints, quaternion, begin, knots(span))

        return freed

    def _joint_maker(self, segment: Segment, turn: Callable[[float], Course]) -> Maker:
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

    def _led(self, segment: Segment) -> LedBase:
        """Return how a segment leads the base: from rest to rest, or from rate to rate."""
        begin, base, goal = self._time, self._base, segment.base
        quaternion, before = base.quaternion, base.before or base.course
        self._check_turning(segment, goal)
        if goal is None or goal == base.mode:
            return LedBase(lambda _: base.held, base.course, base.mode)
        if isinstance(goal, BaseTurn):
            axis, angle = np.array(goal.axis) / norm(goal.axis), math.radians(goal.turn_deg)
        elif isinstance(goal, PointingGoal):
            after = PointingCourse(goal, self._ephemeris(), begin, quaternion)
            leaves = before or at_rest(quaternion)
            return LedBase(lambda span: MatchedSlew(begin, span, leaves, after), after, goal)
        elif before is not None:
            rest = at_rest(goal.unit_quaternion)
            return LedBase(lambda span: MatchedSlew(begin, span, before, rest))
        else:
            axis, angle = turn_between(quaternion, goal.unit_quaternion)
        return LedBase(lambda span: Slew(begin, span, quaternion, axis, angle))

    def _check_turning(self, segment: Segment, goal: object) -> None:
        """Check that nothing is asked of a base that turns which begins at rest."""
        base = self._base
        turns = f"it points at {base.mode.point}" if base.mode else "the start has a rate"
        needs = "needs a base at rest, which base: {rpy_deg: ...} leads to"
        is_leaving = base.before is not None and goal is not None
        if segment.fast and (base.course or is_leaving or isinstance(goal, PointingGoal)):
            turns = f"the base points at {goal.point}" if isinstance(goal, PointingGoal) else turns
            raise InputError(f"duration: fast is for motions from rest to rest, {turns}: give s")
        if isinstance(goal, BaseTurn) and (base.course or base.before):
            raise InputError(f"base.turn_deg {needs}: {turns}")
        if segment.is_base_free and (base.course or base.before):
            raise InputError(f"base: free {needs}: {turns}")
        if segment.reactionless_deg is not None and base.course:
            raise InputError(f"reactionless {needs}: {turns}")

    def _reactionless(self, values: Sequence[float]) -> CubicSpline:
        goal = self._of_degrees(values, "reactionless")
        if (away := np.abs(goal - self._joints)).max() > MOST_AWAY:
            name = self._robot.joint_names[int(np.argmax(away))]
            raise InputError(
                f"reactionless: joint {name!r} is {away.max():.4g} rad or m away, at most "
                f"{MOST_AWAY:.4g} are planned"
            )
        return reactionless_path(self._robot, self._base.quaternion, self._joints, goal)

    def _along(self, path: CubicSpline, span: float) -> SplineCourse:
        """Return the course along a path over (0, 1), quintic in time."""
        times = knots(span)
        share, _, _ = quintic(times / span)
        return SplineCourse(self._time, CubicSpline(times, path.at(share)[:, 0]))
