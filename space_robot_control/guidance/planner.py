"""The plan of a mission: a course of the joints and one of the base for each of its segments."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from space_robot_model.elementary.matrices import norm
from space_robot_model.orbit.ephemeris import Ephemeris
from space_robot_model.robot import Robot
from space_robot_msgs_py.errors import InputError

from .courses import BaseMotion, Course, Piece, SegmentStart, Slew, at_rest, turn_between
from .goals import BaseTurn, PointingGoal
from .limits import LONGEST_S, MissionLimits, check_piece
from .segments import JointSegment, ReactionlessSegment, Segment, TableSegment, posture

Array = NDArray[np.float64]

TRIAL_S = 10.0
"""Duration that a fast segment is tried with."""


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
        ephemeris: Callable[[], Ephemeris | None],
    ) -> None:
        """Begin a plan.

        Args:
            robot: as the flight software knows it.
            joints: (n,) at t = 0, rad, or m of prismatic joints.
            quaternion: (4,) of the base at t = 0, unit.
            limits: of fast segments, beside those of the joints.
            ephemeris: returns that of the assumed orbit; None: there is none.
        """
        self._robot, self._limits, self._ephemeris = robot, limits, ephemeris
        self._first = quaternion, joints
        self.base = BaseMotion(quaternion)
        """How the base goes on after the last planned segment."""

    @cached_property
    def _origin(self) -> Array:
        from .tool_paths import ToolPoses

        position, from_base, _ = ToolPoses(self._robot, None).pose(*self._first)
        return position - from_base

    @np.errstate(all="ignore")  # numbers that overflow are refused, in one line
    def plan(
        self, begin: float, joints: Array, base: BaseMotion, segments: Sequence[Segment]
    ) -> list[Piece]:
        """Return the plan of segments that follow one another from a time, posture and attitude on.

        Raises:
            InputError: a segment cannot be flown; names it, with time, joint and amount.
        """
        pieces: list[Piece] = []
        time, self.base = begin, base
        for number, segment in enumerate(segments, 1):
            origin = lambda: self._origin  # noqa: E731
            start = SegmentStart(self._robot, time, joints, self.base, origin, self._ephemeris)
            try:
                piece, course = self._piece(segment, start)
                check_piece(self._robot, piece)
                # by name: what points is slow to import, and most missions do not
                if piece.mode and (check := getattr(course, "check", None)):
                    check(piece.begin, piece.end)
                if piece.end - begin > LONGEST_S:
                    raise InputError(f"all together last more than {LONGEST_S:g} s (11 days)")
            except InputError as error:
                raise InputError(f"segment {number}: {error}") from None
            pieces.append(piece)
            time, joints = piece.end, piece.goal
            self.base = BaseMotion(piece.attitude, course, piece.mode)
        return pieces

    def _piece(self, segment: Segment, start: SegmentStart) -> tuple[Piece, Course | None]:
        if isinstance(segment, TableSegment):
            from .trajectories import TrajectoryTable

            trajectory = TrajectoryTable(segment.columns, self._robot.joint_names)
            courses = trajectory.courses(start.time, start.joints, start.base)
            base = BaseMotion(start.base.quaternion) if trajectory.leads_base else start.base
            piece = _ended(segment, start.time, trajectory.duration, *courses)
            return piece._replace(mode=base.mode), base.course
        led = self._led(segment, start)
        make, span = segment.courses(start, led.make), segment.span
        if span is None:
            from .demand import shortest_duration

            trial = make(TRIAL_S)
            span = shortest_duration(self._robot, self._limits, *trial, start.time, TRIAL_S)
        piece = _ended(segment, start.time, span, *make(span))._replace(mode=led.mode)
        if isinstance(segment, JointSegment):  # to the last bit what is written
            goal = posture(self._robot, segment.joints_deg, segment.key)
            piece = piece._replace(goal=goal)
        return piece, led.course

    def _led(self, segment: Segment, start: SegmentStart) -> LedBase:
        begin, base = start.time, start.base
        goal = None if segment.base == "free" else segment.base
        quaternion, before = base.quaternion, base.before or base.course
        _check_turning(segment, base)
        if goal is None or goal == base.mode:  # it goes on as it moves
            return LedBase(lambda _: base.held, base.course, base.mode)
        if isinstance(goal, PointingGoal):
            from .matched_slew import MatchedSlew
            from .pointing import PointingCourse

            after = PointingCourse(goal, self._ephemeris(), begin, quaternion)
            leaves = before or at_rest(quaternion)
            return LedBase(lambda span: MatchedSlew(begin, span, leaves, after), after, goal)
        if isinstance(goal, BaseTurn):
            axis, angle = np.array(goal.axis) / norm(goal.axis), math.radians(goal.turn_deg)
        elif before is not None:
            from .matched_slew import MatchedSlew

            rest = at_rest(goal.unit_quaternion)
            return LedBase(lambda span: MatchedSlew(begin, span, before, rest))
        else:
            axis, angle = turn_between(quaternion, goal.unit_quaternion)
        return LedBase(lambda span: Slew(begin, span, quaternion, axis, angle))


def _ended(segment: Segment, begin: float, span: float, joints: Course, base: Course) -> Piece:
    end = np.array([begin + span])
    goal, attitude = joints.at(end)[0, 0], base.at(end)[0, :4]
    return Piece(begin, begin + span, joints, base, goal, attitude, segment.motion)


def _check_turning(segment: Segment, base: BaseMotion) -> None:
    goal = segment.base
    turns = f"it points at {base.mode.point}" if base.mode else "the start has a rate"
    needs = "needs a base at rest, which base: {rpy_deg: ...} leads to"
    is_leaving = base.before is not None and goal is not None
    is_pointing = isinstance(goal, PointingGoal)
    if segment.span is None and (base.course or (is_leaving and goal != "free") or is_pointing):
        turns = f"the base points at {goal.point}" if isinstance(goal, PointingGoal) else turns
        raise InputError(f"duration: fast is for motions from rest to rest, {turns}: give s")
    if isinstance(goal, BaseTurn) and (base.course or base.before):
        raise InputError(f"base.turn_deg {needs}: {turns}")
    if segment.is_base_free and (base.course or base.before):
        raise InputError(f"base: free {needs}: {turns}")
    if isinstance(segment, ReactionlessSegment) and base.course:
        raise InputError(f"reactionless {needs}: {turns}")
