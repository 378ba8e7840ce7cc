"""The mission: joints through waypoints, the base's attitude held, then segments of any kind."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING, Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from space_robot_model.elementary.matrices import direction_norm
from space_robot_model.orbit.ephemeris import AssumedOrbit, Ephemeris
from space_robot_model.robot import Robot
from space_robot_model.robot.mission_document import Rates
from space_robot_msgs_py.config.settings import Texts
from space_robot_msgs_py.config.validation import StrictModel
from space_robot_msgs_py.errors import InputError
from space_robot_msgs_py.samples import ReferenceChunk

from .checks import check_piece
from .courses import BaseMotion, Piece, QuinticLeg, SteadyTurn
from .limits import MissionLimits, check_positions
from .segments import read_pointing, read_segments

if TYPE_CHECKING:
    from .live import TrajectoryPoint
    from .planner import Planner
    from .pointing import PointingCourse, PointingGoal

Array = NDArray[np.float64]


ROUNDING = 1e-6
"""Ticks by which a time may miss the tick it means."""


class MissionSettings(StrictModel):
    """Waypoints as flat lists, as ROS parameters hold them, and segments that follow them."""

    waypoint_times: list[float] = Field(
        [0.0], description="time of each waypoint, s, increasing from 0", min_length=1
    )
    waypoints_deg: list[float] = Field(
        [0.0],
        description="positions of the actuated joints, waypoint by waypoint, degrees (prismatic "
        "joints: m)",
    )
    base_quaternion: Annotated[list[float], Field(min_length=4, max_length=4)] = Field(
        [1.0, 0.0, 0.0, 0.0], description="base attitude to hold: w, x, y, z"
    )
    base_rate_deg_s: Rates = Field(
        [0.0, 0.0, 0.0],
        description="angular velocity of the base at the start, degrees/s, base axes, with which a "
        "first segment that moves the base begins",
    )
    base_point: str = Field(
        "",
        description="what the base points at from the start on, in place of base_quaternion, as "
        "YAML text: {point: nadir}",
    )
    segments: Texts = Field(
        [""],
        description="segments that follow the last waypoint, each as YAML text: see the manual on "
        "missions",
    )
    limits: MissionLimits = MissionLimits()
    assumed_orbit: AssumedOrbit = AssumedOrbit()

    @property
    def has_segments(self) -> bool:
        """Whether there are segments, not waypoints only."""
        return bool(self.written_segments)

    @property
    def written_segments(self) -> list[str]:
        """The segments without empty texts."""
        return [text for text in self.segments if text.strip()]


class Mission:
    """The desired motion of joints and base, sampled at ticks.

    It leads through waypoints with a rest in each, then through segments. Before the first waypoint
    and after the end all is held.
    """

    def __init__(self, robot: Robot, settings: MissionSettings, period: float) -> None:
        """A mission for the joints with motors of ``robot``.

        Raises:
            InputError: the waypoints do not fit the times or the joints, or are beyond the limits
                of these; a segment is wrong or cannot be flown.
        """
        n, times = robot.n, np.array(settings.waypoint_times)
        if settings.has_segments and len(times) == 1 and len(settings.waypoints_deg) != n:
            raise InputError(
                f"the start has {len(settings.waypoints_deg)} joints; the robot has {n} with "
                f"motors: {', '.join(robot.joint_names)}"
            )
        if len(settings.waypoints_deg) != n * len(times):
            raise InputError(
                f"waypoints_deg has {len(settings.waypoints_deg)} values; "
                f"{len(times)} waypoint_times and {n} joints need {n * len(times)}"
            )
        if times[0] != 0.0 or np.any(np.diff(times) <= 0.0):
            raise InputError(f"waypoint_times must rise from 0, got {settings.waypoint_times}")
        length = direction_norm(settings.base_quaternion, "base_quaternion")
        waypoints = robot.from_degrees(np.reshape(settings.waypoints_deg, (len(times), n)))
        check_positions(robot, waypoints)
        self._assumed_orbit = settings.assumed_orbit
        base = self._base_at_start(settings, np.array(settings.base_quaternion) / length)
        self.period = period
        """s, of a tick."""
        self.pieces = [
            _leg(begin, end, start, goal, base)
            for (begin, end), (start, goal) in zip(
                pairwise(times), pairwise(waypoints), strict=True
            )
        ]
        """Legs between the waypoints, then the segments; at least one."""
        still = [] if self.pieces else [_leg(0.0, 1.0, waypoints[0], waypoints[0], base)]
        for leg in (*self.pieces, *still):
            check_piece(robot, leg, has_limits=False)  # flights warn of those of waypoints
        self._robot = robot.nominal
        self._start, self._limits = (waypoints[0].copy(), base.quaternion), settings.limits
        if segments := read_segments(settings.segments):
            if self.pieces:
                base = BaseMotion(self.pieces[-1].attitude, base.course, base.mode)
            planner = self._new_planner()
            self.pieces += planner.plan(float(times[-1]), waypoints[-1], base, segments)
            base = planner.base
        self._goes_on = base.course if base.mode else None
        self.duration = self.pieces[-1].end if self.pieces else 0.0
        """s, until the end of the last segment."""
        self.pieces = self.pieces or still
        self._first, self._begins = (
            waypoints[0].copy(),
            np.array([piece.begin for piece in self.pieces]),
        )

    def _new_planner(self) -> Planner:
        from .planner import Planner  # slow to import, and a mission of waypoints needs none

        return Planner(self._robot, *self._start, self._limits, lambda: self.ephemeris)

    @cached_property
    def ephemeris(self) -> Ephemeris | None:
        """The orbit that the mission is planned with; None: none is known."""
        return Ephemeris(self._assumed_orbit) if self._assumed_orbit.has_orbit else None

    @property
    def uses_orbit(self) -> bool:
        """Whether the reference depends on the assumed orbit."""
        return self.__dict__.get("ephemeris") is not None

    def _base_at_start(self, settings: MissionSettings, quaternion: Array) -> BaseMotion:
        if not settings.base_point.strip():
            rate = np.radians(settings.base_rate_deg_s)
            before = SteadyTurn(0.0, quaternion, rate) if rate.any() else None
            return BaseMotion(quaternion, before=before)
        mode, course = _pointing(settings, self.ephemeris)
        return BaseMotion(course.at(np.zeros(1))[0, :4], course, mode)

    def check_until(self, end: float) -> None:
        """Check that what the base points at after the mission's end stays defined until ``end``.

        Raises:
            InputError: it does not; names key and time.
        """
        from .pointing import PointingCourse  # slow to import, and most missions need none

        if isinstance(self._goes_on, PointingCourse) and end > self.duration:
            try:
                self._goes_on.check(self.duration, end)
            except InputError as error:
                raise InputError(f"after the mission's end: {error}") from None

    @property
    def times(self) -> Array:
        """(K,) s, of the waypoints and of the ends of the segments."""
        ends = [piece.end for piece in self.pieces] if self.duration else []
        return np.array([0.0, *ends])

    @property
    def waypoints(self) -> Array:
        """(K, n) desired positions at `times`, rad, or m of prismatic joints."""
        goals = [piece.goal for piece in self.pieces] if self.duration else []
        return np.array([self._first, *goals])

    def go_to(self, tick: int, segment: str) -> Piece:
        """Fly a segment, written as in a mission, from a tick on, in place of what was planned.

        Joints that move at that tick are brought to rest first, and so is the base, unless it
        points or is on its way there.

        Returns:
            The planned segment.

        Raises:
            InputError: the segment is wrong or cannot be flown; the mission is as it was.
        """
        from .live import braking, is_moving

        begin, joints, rates, base = self._state_at(tick)
        before = []
        if is_moving(joints, rates, base):
            before = [braking(begin, joints, rates, base)]
            check_piece(self._robot, before[0])
            begin, joints = before[0].end, before[0].goal[np.newaxis]
            base = base._replace(quaternion=before[0].attitude)
        segments = read_segments([segment])
        if not segments:
            raise InputError("a segment was expected, got an empty text")
        if segments[0].file is not None:  # whoever reaches the node could have it read any file
            raise InputError("file: no file is read in flight, give the columns as trajectory")
        pieces = self._new_planner().plan(begin, joints[0], base, segments)
        self._replace([*before, *pieces])
        return pieces[-1]

    def follow(
        self,
        tick: int,
        names: Sequence[str],
        points: Sequence[TrajectoryPoint],
        start: float | None = None,
    ) -> Piece:
        """Fly a trajectory of the joints in place of what was planned.

        Args:
            tick: the first one whose reference may change.
            names: see `joined`.
            points: see `joined`.
            start: s, simulated time of the trajectory's start; None: at ``tick``. What was planned
                is flown until then; a trajectory that has started already is joined.

        Raises:
            InputError: the trajectory is wrong; the mission is as it was.
        """
        from .live import START_WITHIN_S, braking, is_moving, joined

        late = 0.0
        if start is not None:
            if start > tick * self.period + START_WITHIN_S:
                raise InputError(
                    f"the start at t = {start:.9g} s is more than {START_WITHIN_S:g} s after now, "
                    f"t = {tick * self.period:.4f} s: stamps are of simulated time, or 0 for now"
                )
            tick = max(tick, math.ceil(start / self.period - ROUNDING))
            late = max(0.0, tick * self.period - start)
        piece = joined(self._robot, names, points, *self._state_at(tick), late)
        end = np.array([piece.end])
        joints, rates = piece.joints.at(end)[0], piece.base.at(end)[0]
        base = BaseMotion(rates[:4], piece.base if piece.mode else None, piece.mode)
        is_rolling = is_moving(joints, rates, base)
        after = [braking(piece.end, joints, rates, base)] if is_rolling else []
        for part in after:
            check_piece(self._robot, part)
        self._replace([piece, *after])
        return piece

    def _state_at(self, tick: int) -> tuple[float, Array, Array, BaseMotion]:
        """Return time, the reference of joints (3, n) and base (10,), and how the base goes on."""
        chunk, time = self.chunk(tick, 1), tick * self.period
        piece = self.pieces[int(np.searchsorted(self._begins[1:], time, side="right"))]
        base = BaseMotion(chunk.base[0, :4], piece.base if piece.mode else None, piece.mode)
        return time, chunk.joints[0], chunk.base[0], base

    def _replace(self, pieces: list[Piece]) -> None:
        """Put pieces in the place of all that begins later."""
        kept = [piece for piece in self.pieces if piece.begin < pieces[0].begin]
        self.pieces = [*kept, *pieces]
        self._begins = np.array([piece.begin for piece in self.pieces])
        self.duration = pieces[-1].end

    def chunk(self, start: int, length: int) -> ReferenceChunk:
        """The reference of ``length`` ticks from tick ``start`` on."""
        time = np.arange(start, start + length, dtype=np.float64) * self.period
        parts = np.split(time, np.searchsorted(time, self._begins[1:]))  # a piece has its begin
        flown = [pair for pair in zip(self.pieces, parts, strict=True) if len(pair[1])]
        flown = flown or [(self.pieces[0], time)]
        return ReferenceChunk(
            start,
            np.concatenate([piece.joints.at(part) for piece, part in flown]),
            np.concatenate([piece.base.at(part) for piece, part in flown]),
        )


def _leg(begin: float, end: float, start: Array, goal: Array, base: BaseMotion) -> Piece:
    """Return a leg of the joints between two waypoints; the attitude or what points is held."""
    attitude = base.held.at(np.array([float(end)]))[0, :4]
    course = QuinticLeg(begin, float(end - begin), start, goal - start)
    return Piece(float(begin), float(end), course, base.held, goal, attitude, mode=base.mode)


def pointing_start(settings: MissionSettings) -> tuple[list[float], list[float]]:
    """Return attitude (4,) and rate (3,), degrees/s, base axes, of a mission that starts pointing.

    Raises:
        InputError: what ``base_point`` says cannot be pointed at.
    """
    assumed = settings.assumed_orbit
    _, course = _pointing(settings, Ephemeris(assumed) if assumed.has_orbit else None)
    motion = course.at(np.zeros(1))[0]
    return motion[:4].tolist(), np.degrees(motion[4:7]).tolist()


def _pointing(
    settings: MissionSettings, ephemeris: Ephemeris | None
) -> tuple[PointingGoal, PointingCourse]:
    from .pointing import PointingCourse  # slow to import, and most missions need none

    mode = read_pointing(settings.base_point, "start.base")
    try:
        course = PointingCourse(mode, ephemeris, 0.0, np.array([1.0, 0.0, 0.0, 0.0]))
        course.check(0.0, settings.waypoint_times[-1])
    except InputError as error:
        raise InputError(f"start: {error}") from None
    return mode, course
