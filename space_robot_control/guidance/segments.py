"""Segments of a mission: the keys of each kind, and the courses that they become.

A kind is one class: its keys with their limits, and `joints`, the course of the joints. Splines and
tools are imported where they are used: they are slow to import, and a mission of joints needs none.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import BeforeValidator, Field, PlainValidator

from space_robot_model.robot import Robot
from space_robot_model.robot.mission_document import Attitude
from space_robot_msgs_py.config.columns import read_columns
from space_robot_msgs_py.config.text import choices, printable
from space_robot_msgs_py.config.validation import StrictModel, short, validate
from space_robot_msgs_py.config.yaml_text import YamlTextError, parse_yaml
from space_robot_msgs_py.errors import InputError

from .courses import Array, BentLeg, Course, JointMaker, Maker, QuinticLeg, SegmentStart, knots
from .goals import BaseTurn, PointingGoal, ToolGoal
from .limits import FARTHEST, shown_unit

MOST_SEGMENTS = 5_000
"""Largest number of segments of a mission; each is planned for a few milliseconds."""
MOST_BENDS = 100


BaseGoal = Attitude | PointingGoal | BaseTurn | Literal["free"]
BASE_KINDS: dict[str, type[Attitude] | type[PointingGoal] | type[BaseTurn]] = {
    "rpy_deg": Attitude,
    "quaternion": Attitude,
    "point": PointingGoal,
    "turn_deg": BaseTurn,
}
"""Kinds of goals of the base by the keys that identify them."""
BASE_KEYS = tuple(dict.fromkeys(k for kind in BASE_KINDS.values() for k in kind.model_fields))


def _base_goal(content: Any) -> BaseGoal:
    if isinstance(content, (Attitude, PointingGoal, BaseTurn)) or content == "free":
        goal: BaseGoal = content
        return goal
    if isinstance(content, str):
        content = {"point": content}
    keys = [key for key in BASE_KINDS if isinstance(content, dict) and key in content]
    if len({BASE_KINDS[key] for key in keys}) > 1:
        raise ValueError(f"{' and '.join(keys)} were given: give one of them")
    return (BASE_KINDS[keys[0]] if keys else Attitude).model_validate(content)


def _seconds(content: Any) -> Any:
    if content is None:
        raise ValueError("give s, or fast")
    return None if content == "fast" else content


# the kinds


class Segment(StrictModel):
    """A part of a mission in which the joints stay, and the base moves; the kinds are below."""

    key: ClassVar[str] = "base"
    """Identifies the kind."""
    excludes: ClassVar[tuple[str, ...]] = ()
    """Keys of the classes above that this kind does not have."""

    base: Annotated[BaseGoal | None, PlainValidator(_base_goal)] = Field(
        None,
        description="attitude, turn, or what the base points at from now on; free: it turns as the "
        "arm's motion turns it",
    )
    duration: Annotated[
        Annotated[float, Field(ge=1e-6, le=1e6)] | None, BeforeValidator(_seconds)
    ] = Field(None, description="s, or fast: as the limits of joints and base allow")

    @classmethod
    def allowed_keys(cls) -> tuple[str, ...]:
        """Return the keys that a segment of this kind may have."""
        return tuple(key for key in cls.model_fields if key not in cls.excludes)

    @property
    def is_base_free(self) -> bool:
        """Whether the base turns as the arm's motion turns it."""
        return self.base == "free"

    @property
    def span(self) -> float | None:
        """The duration, s; None: as fast as the limits allow."""
        return self.duration

    @property
    def motion(self) -> str:
        """What the segment moves, in a word or two."""
        words = [self.key.removesuffix("_deg")] if self.key != "base" else []
        words += ["free base" if self.is_base_free else "base"] if self.base is not None else []
        return " and ".join(words)

    def joints(self, start: SegmentStart) -> JointMaker:
        """Return the joints' course as a function of duration and course of the base."""
        rise = np.zeros_like(start.joints)
        return lambda span, _: QuinticLeg(start.time, span, start.joints, rise)

    def courses(self, start: SegmentStart, turn: Callable[[float], Course]) -> Maker:
        """Return both courses as a function of the duration, s.

        ``turn`` is the course of a base that is not free as a function of the duration.
        """
        make = self.joints(start)

        def led(span: float) -> tuple[Course, Course]:
            base = turn(span)
            return make(span, base), base

        def freed(span: float) -> tuple[Course, Course]:
            from .free_base import free_attitude

            joints, quaternion = make(span, turn(span)), start.base.quaternion
            times = knots(span)
            return joints, free_attitude(start.robot, joints, quaternion, start.time, times)

        return freed if self.is_base_free else led


class JointSegment(Segment):
    """The joints go to a posture, on a line in their space or bent."""

    key = "joints_deg"
    joints_deg: list[float] = Field(description="joints, degrees or m")
    bends_deg: list[list[float]] | None = Field(
        None,
        max_length=MOST_BENDS,
        description="amplitudes of bends on the way to joints_deg, by sin(pi s), sin(2 pi s), ...:"
        " a list of joints each, degrees or m",
    )

    def joints(self, start: SegmentStart) -> JointMaker:
        """Return the joints' course as a function of duration and course of the base."""
        rise = posture(start.robot, self.joints_deg, "joints_deg") - start.joints
        if self.bends_deg is None:
            return lambda span, _: QuinticLeg(start.time, span, start.joints, rise)
        bends = np.array([posture(start.robot, bend, "bends_deg") for bend in self.bends_deg])
        return lambda span, _: BentLeg(start.time, span, start.joints, rise, bends)


class ToolSegment(Segment):
    """A tool goes in a straight line, and turns about one axis."""

    key = "tool"
    tool: ToolGoal

    def courses(self, start: SegmentStart, turn: Callable[[float], Course]) -> Maker:
        """Return both courses as a function of the duration, s."""
        from .tool_paths import ToolCourses

        if self.is_base_free and self.tool.frame != "base":
            return ToolCourses(self.tool, start).free
        return super().courses(start, turn)

    def joints(self, start: SegmentStart) -> JointMaker:
        """Return the joints' course as a function of duration and course of the base."""
        from .tool_paths import ToolCourses

        return ToolCourses(self.tool, start).led


class HoldSegment(Segment):
    """The joints stay."""

    key = "hold"
    excludes = ("duration",)
    hold: Annotated[float, Field(ge=1e-6, le=1e6)] = Field(description="time to stay, s")

    @property
    def span(self) -> float | None:
        """The duration, s."""
        return self.hold


class PostureGoal(StrictModel):
    """A posture to approach."""

    joints_deg: list[float] = Field(description="joints, degrees or m")


class ReactionlessSegment(Segment):
    """The joints approach a posture without a torque on the base."""

    key = "reactionless"
    excludes = ("base",)
    reactionless: PostureGoal

    def joints(self, start: SegmentStart) -> JointMaker:
        """Return the joints' course as a function of duration and course of the base."""
        from .free_base import reactionless_course

        goal = posture(start.robot, self.reactionless.joints_deg, "reactionless")
        return reactionless_course(start, goal)


class TableSegment(Segment):
    """Joints, and maybe the base, follow the columns of a table, which has its own duration."""

    key = "trajectory"
    excludes: ClassVar[tuple[str, ...]] = ("base", "duration")
    trajectory: dict[str, list[float]] = Field(description="the columns of such a file")

    @property
    def columns(self) -> dict[str, list[float]]:
        """The columns of the table by name."""
        return self.trajectory


class FileSegment(TableSegment):
    """The same from a file."""

    key = "file"
    excludes = ("base", "duration", "trajectory")
    trajectory: dict[str, list[float]] = Field(default_factory=dict)
    file: str = Field(description="CSV or Parquet file of a trajectory")

    @property
    def columns(self) -> dict[str, list[float]]:
        """The columns of the table by name."""
        return read_columns(Path(self.file))


SEGMENT_KINDS: dict[str, type[Segment]] = {
    kind.key: kind
    for kind in (
        *(JointSegment, ToolSegment, HoldSegment, ReactionlessSegment),
        *(FileSegment, TableSegment, Segment),
    )
}
"""Kinds of segments by their keys."""
COMMON_KEYS = Segment.allowed_keys()
SEGMENT_KEYS = (
    *(k for kind in SEGMENT_KINDS.values() for k in kind.allowed_keys() if k not in COMMON_KEYS),
    *COMMON_KEYS,
)


def posture(robot: Robot, values: Sequence[float], key: str) -> Array:
    """Return the positions (n,), rad or m, of joints that a key has in degrees or m."""
    if len(values) != robot.n:
        raise InputError(f"{key}: {robot.n} values were expected, got {len(values)}")
    positions = robot.from_degrees(values)
    if (far := np.abs(positions)).max() > FARTHEST:
        joint = int(np.argmax(far))
        scale, unit = shown_unit(robot, joint)
        raise InputError(
            f"{key}: joint {robot.joint_names[joint]!r}: at most {FARTHEST * scale:.6g} "
            f"{unit} can be flown, got {values[joint]:g}"
        )
    return positions


def read_segments(texts: Sequence[str]) -> list[Segment]:
    """Return the segments written in YAML texts; empty texts count for nothing.

    Raises:
        InputError: a segment is wrong; names it, counted from 1.
    """
    written = [text for text in texts if text.strip()]
    if len(written) > MOST_SEGMENTS:
        raise InputError(f"{len(written)} segments, at most {MOST_SEGMENTS} are planned")
    return [_segment(text, f"segment {number}") for number, text in enumerate(written, 1)]


def _segment(text: str, where: str) -> Segment:
    content = _parsed(text, where)
    if not isinstance(content, Mapping):
        return validate(Segment, content, where)
    _check_keys(content, where, SEGMENT_KEYS)
    if isinstance(base := content.get("base"), dict):
        _check_keys(base, f"{where}: base", BASE_KEYS)
    motions = [key for key in SEGMENT_KINDS if key in content and key != "base"]
    if len(motions) > 1:
        raise InputError(f"{where}: {' and '.join(motions)} were given: a segment has one of them")
    if not motions and "base" not in content:
        raise InputError(f"{where}: give one of {', '.join(SEGMENT_KINDS)}")
    kind = SEGMENT_KINDS[motions[0] if motions else "base"]
    if wrong := [key for key in content if key not in kind.allowed_keys()]:
        raise InputError(f"{where}: {wrong[0]} does not go with {kind.key}")
    if "duration" in kind.allowed_keys() and "duration" not in content:
        raise InputError(f"{where}: give duration (s), or duration: fast")
    segment = validate(kind, content, where)
    if segment.is_base_free and not isinstance(segment, (JointSegment, ToolSegment)):
        raise InputError(f"{where}: base: free needs joints_deg or tool")
    return segment


def read_pointing(text: str, where: str) -> PointingGoal:
    """Return what the base points at, written as YAML text; an error names ``where``."""
    content = _parsed(text, where)
    content = {"point": content} if isinstance(content, str) else content
    _check_keys(content, where, tuple(PointingGoal.model_fields))
    return validate(PointingGoal, content, where)


def _parsed(text: str, where: str) -> Any:
    try:
        return parse_yaml(text)
    except YamlTextError as error:
        raise InputError(f"{where}: {error}") from None


def _check_keys(content: Any, where: str, known: Sequence[str]) -> None:
    for key, value in content.items() if isinstance(content, dict) else ():
        if key not in known:
            advice = choices(str(key), known)
            raise InputError(
                f"{where}: {printable(str(key))}: unknown key, got {short(value)}: {advice}"
            )
