"""The mission: segments of any kind that follow one another from a start."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, ClassVar

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from space_robot_model.elementary.matrices import direction_norm
from space_robot_model.orbit.ephemeris import AssumedOrbit, Ephemeris
from space_robot_model.robot import Robot
from space_robot_model.robot.find import mission_layers
from space_robot_model.robot.mission_document import Rates, mission_layer
from space_robot_msgs_py.config.columns import read_columns
from space_robot_msgs_py.config.files import Tree
from space_robot_msgs_py.config.settings import NodeSettings, Texts, WaitFor
from space_robot_msgs_py.config.validation import StrictModel
from space_robot_msgs_py.config.yaml_text import YamlTextError, parse_yaml
from space_robot_msgs_py.errors import InputError
from space_robot_msgs_py.samples import ReferenceChunk
from space_robot_msgs_py.topics import REFERENCE_BASE, REFERENCE_JOINTS, Topic

from .courses import BaseMotion, Piece, SteadyTurn
from .goals import PointingGoal
from .limits import MissionLimits, check_start
from .planner import Planner
from .segments import FileSegment, HoldSegment, read_pointing, read_segments

if TYPE_CHECKING:
    from .live import TrajectoryPoint
    from .pointing import PointingCourse

Array = NDArray[np.float64]


ROUNDING = 1e-6
"""Ticks by which a time may miss the tick it means."""


class MissionSettings(StrictModel):
    """The start as flat lists, as ROS parameters hold them, and the segments from there on."""

    joints_deg: list[float] = Field(
        [0.0],
        description="positions of the joints with motors at the start, degrees (prismatic joints: "
        "m)",
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
        description="segments, one after the other, each as YAML text: see the manual on missions",
    )
    limits: MissionLimits = MissionLimits()
    assumed_orbit: AssumedOrbit = AssumedOrbit()

    @property
    def written_segments(self) -> list[str]:
        """The segments without empty texts."""
        return [text for text in self.segments if text.strip()]


class MissionNodeSettings(MissionSettings, NodeSettings):
    """Parameters of mission_node."""

    node: ClassVar[str] = "mission"
    selectors: ClassVar[tuple[str, ...]] = ("robot", "mission")
    sends: ClassVar[tuple[Topic, ...]] = (REFERENCE_JOINTS, REFERENCE_BASE)

    mission: str = Field(
        "",
        description="a mission of config/missions, or a path to its YAML or to a trajectory in "
        "CSV or Parquet (empty: the robot's)",
    )
    goto: str = Field(
        "",
        description="a segment to fly from now on in place of the mission, as YAML text, set in "
        "flight; the same text again is ignored",
    )
    chunk_ticks: Annotated[int, Field(ge=1, le=10_000)] = Field(
        100, description="ticks per message of the reference"
    )
    lead_ticks: Annotated[int, Field(ge=1, le=10_000)] = Field(
        1000, description="lead of the reference ahead of the plant, ticks"
    )
    wait_for: WaitFor = Field([""])

    @classmethod
    def layers(cls, selected: Mapping[str, str]) -> list[Path]:
        """The mission's own file over the graph's."""
        return [*super().layers(selected), *mission_layers(selected["robot"], selected["mission"])]

    @classmethod
    def read_layer(cls, path: Path, selected: Mapping[str, str]) -> Tree:
        """Read a parameter file, a mission's document, or a trajectory."""
        layer = mission_layer(path, cls.node, selected["robot"])
        if texts := layer.get("segments"):
            layer["segments"] = [with_columns(t, path.parent) if "file" in t else t for t in texts]
        return layer


def with_columns(text: str, folder: Path) -> str:
    """Return a segment's YAML text with its file's columns in place of the file's name.

    A relative path begins in ``folder``.
    """
    try:
        content = parse_yaml(text)
    except YamlTextError:
        return text  # refused where segments are read
    if not isinstance(content, dict) or not isinstance(name := content.get("file"), str):
        return text
    rest = {key: value for key, value in content.items() if key != "file"}
    return json.dumps({"trajectory": read_columns(folder / name), **rest})


class Mission:
    """The desired motion of joints and base, sampled at ticks.

    Before it begins and after its end all is held, unless the base points.
    """

    def __init__(self, robot: Robot, settings: MissionSettings, period: float) -> None:
        """A mission for the joints with motors of ``robot``.

        Raises:
            InputError: the start does not fit the joints, or is beyond their limits; a segment is
                wrong or cannot be flown.
        """
        if len(settings.joints_deg) != robot.n:
            raise InputError(
                f"the start has {len(settings.joints_deg)} joints; the robot has {robot.n} with "
                f"motors: {', '.join(robot.joint_names)}"
            )
        length = direction_norm(settings.base_quaternion, "base_quaternion")
        joints = robot.from_degrees(settings.joints_deg)
        check_start(robot, joints)
        self._assumed_orbit = settings.assumed_orbit
        base = self._base_at_start(settings, np.array(settings.base_quaternion) / length)
        self.period = period
        """s, of a tick."""
        self._robot, limits = robot.nominal, settings.limits
        planner = Planner(self._robot, joints, base.quaternion, limits, self._planned_with)
        self._planner, segments = planner, read_segments(settings.segments)
        self.pieces = planner.plan(0.0, joints, base, segments or [HoldSegment(hold=1.0)])
        """The planned segments; at least one."""
        self._goes_on = planner.base.course if planner.base.mode else None
        self.duration = self.pieces[-1].end if segments else 0.0
        """s, until the end of the last segment."""
        self._begins = np.array([piece.begin for piece in self.pieces])

    @property
    def leads_tool(self) -> bool:
        """Whether more is led than the joints from posture to posture."""
        return any(piece.motion not in ("joints", "hold") for piece in self.pieces)

    @cached_property
    def ephemeris(self) -> Ephemeris | None:
        """The orbit that the mission is planned with; None: none is known."""
        return Ephemeris(self._assumed_orbit) if self._assumed_orbit.has_orbit else None

    def _planned_with(self) -> Ephemeris | None:
        # asked for when a segment needs it, so that `uses_orbit` can tell whether any did
        return self.ephemeris

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
        # by name: what points is slow to import, and most missions do not
        check = getattr(self._goes_on, "check", None)
        if check and end > self.duration:
            try:
                check(self.duration, end)
            except InputError as error:
                raise InputError(f"after the mission's end: {error}") from None

    def go_to(self, tick: int, segment: str) -> Piece:
        """Fly a segment, written as in a mission, from a tick on, in place of what was planned.

        Joints that move at that tick are brought to rest first, and so is the base, unless it
        points or is on its way there. Return the planned segment; one that is refused leaves the
        mission as it was.
        """
        from .live import braking_pieces

        begin, joints, rates, base = self._state_at(tick)
        before = braking_pieces(self._robot, begin, joints, rates, base)
        if before:
            begin, joints = before[0].end, before[0].goal[np.newaxis]
            base = base._replace(quaternion=before[0].attitude)
        segments = read_segments([segment])
        if not segments:
            raise InputError("a segment was expected, got an empty text")
        # whoever reaches the node could have it read any file
        if isinstance(segments[0], FileSegment):
            raise InputError("file: no file is read in flight, give the columns as trajectory")
        pieces = self._planner.plan(begin, joints[0], base, segments)
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

        One that is refused leaves the mission as it was.

        Args:
            tick: the first one whose reference may change.
            names: of the joints, see `joined_trajectory`.
            points: of the trajectory, see `joined_trajectory`.
            start: s, simulated time of the trajectory's start; None: at ``tick``. What was planned
                is flown until then; a trajectory that has started already is joined.
        """
        from .live import START_WITHIN_S, braking_pieces, joined_trajectory

        late = 0.0
        if start is not None:
            if start > tick * self.period + START_WITHIN_S:
                raise InputError(
                    f"the start at t = {start:.9g} s is more than {START_WITHIN_S:g} s after now, "
                    f"t = {tick * self.period:.4f} s: stamps are of simulated time, or 0 for now"
                )
            tick = max(tick, math.ceil(start / self.period - ROUNDING))
            late = max(0.0, tick * self.period - start)
        piece = joined_trajectory(self._robot, names, points, *self._state_at(tick), late)
        end = np.array([piece.end])
        joints, rates = piece.joints.at(end)[0], piece.base.at(end)[0]
        base = BaseMotion(rates[:4], piece.base if piece.mode else None, piece.mode)
        after = braking_pieces(self._robot, piece.end, joints, rates, base)
        self._replace([piece, *after])
        return piece

    def _state_at(self, tick: int) -> tuple[float, Array, Array, BaseMotion]:
        chunk, time = self.chunk(tick, 1), tick * self.period
        piece = self.pieces[int(np.searchsorted(self._begins[1:], time, side="right"))]
        base = BaseMotion(chunk.base[0, :4], piece.base if piece.mode else None, piece.mode)
        return time, chunk.joints[0], chunk.base[0], base

    def _replace(self, pieces: list[Piece]) -> None:
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


def pointing_start(settings: MissionSettings) -> tuple[list[float], list[float]]:
    """Return attitude (4,) and rate (3,), degrees/s, base axes, of a start that points."""
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
        course.check(0.0, 0.0)
    except InputError as error:
        raise InputError(f"start: {error}") from None
    return mode, course
