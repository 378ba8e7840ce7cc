"""Segments of a mission as they are written in its file."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Any, Literal

from pydantic import Field, PlainValidator, model_validator

from space_robot_model.elementary.matrices import direction_norm
from space_robot_model.robot.mission_document import Attitude, Degrees, Orientation, Vector
from space_robot_msgs_py.config.text import choices, printable
from space_robot_msgs_py.config.validation import StrictModel, short, validate
from space_robot_msgs_py.config.yaml_text import YamlTextError, parse_yaml
from space_robot_msgs_py.errors import InputError

from .pointing import PointingGoal

MOST_SEGMENTS = 5_000
"""Largest number of segments of a mission; each is planned for a few milliseconds."""
Seconds = Annotated[float, Field(ge=1e-6, le=1e6)]
MOST_BENDS = 100
Frame = Literal["inertial", "base", "start", "orbit"]
MOTIONS = ("joints_deg", "tool", "hold", "reactionless_deg", "file", "trajectory")
"""Keys of which a segment has one; a segment of the base alone has none."""
WRITTEN = (
    *("joints_deg", "bends_deg", "tool", "hold", "reactionless", "file"),
    *("base", "duration"),
)
"""Keys of a segment in a mission's document."""
ALONE = ("reactionless_deg", "file", "trajectory")
"""Those that go without ``base``."""


class ToolGoal(Orientation):
    """Where a tool goes in a straight line; without an orientation the shortest joint motion."""

    xyz: Vector | None = Field(None, description="position, m (none: it stays)")
    frame: Frame = Field(
        "start",
        description="axes of the goal: inertial (origin: the base at t = 0), base (at the end of "
        "the segment), start (a displacement and a turn on inertial axes), or orbit (the same on "
        "axes that turn with the orbit: x ahead, y against its normal, z to the Earth's centre)",
    )
    link: str | None = Field(None, description="name of the tool, of a robot with several")
    least: Literal["motion", "momentum"] = Field(
        "motion",
        description="what a robot with more joints than the path needs keeps least: the motion of"
        " its joints, or the angular momentum that the base takes up",
    )

    @model_validator(mode="after")
    def _something(self) -> ToolGoal:
        if self.xyz is None and not self.is_given:
            raise ValueError("give xyz, rpy_deg or quaternion")
        return self


class BaseTurn(StrictModel):
    """``base: {turn_deg: 190, axis: [1, 2, 3]}``: a turn about one axis, from rest to rest."""

    turn_deg: Degrees = Field(description="angle, degrees")
    axis: Vector = Field(description="of the turn, base frame, any length")

    @model_validator(mode="after")
    def _has_axis(self) -> BaseTurn:
        direction_norm(self.axis, "axis")
        return self


KINDS_OF_BASE: dict[str, type[Attitude] | type[PointingGoal] | type[BaseTurn]] = {
    "rpy_deg": Attitude,
    "quaternion": Attitude,
    "point": PointingGoal,
    "turn_deg": BaseTurn,
}
"""Keys that tell what is said of the base."""
OF_BASE = tuple(dict.fromkeys(key for kind in KINDS_OF_BASE.values() for key in kind.model_fields))
"""All keys of ``base``."""


def base_goal(content: Any) -> Attitude | PointingGoal | BaseTurn:
    """Return where a segment brings the base, by its keys; a name is what the base points at.

    Raises:
        ValidationError: a key or a value is wrong.
    """
    if isinstance(content, (Attitude, PointingGoal, BaseTurn)):
        return content
    if isinstance(content, str):
        content = {"point": content}
    keys = [key for key in KINDS_OF_BASE if isinstance(content, dict) and key in content]
    if len({KINDS_OF_BASE[key] for key in keys}) > 1:
        raise ValueError(f"{' and '.join(keys)} were given: give one of them")
    return (KINDS_OF_BASE[keys[0]] if keys else Attitude).model_validate(content)


class Segment(StrictModel):
    """A part of a mission; the joints move from rest to rest."""

    joints_deg: list[float] | None = Field(None, description="joints, degrees or m")
    bends_deg: list[list[float]] | None = Field(
        None,
        max_length=MOST_BENDS,
        description="amplitudes of bends on the way to joints_deg, by sin(pi s), sin(2 pi s), ...:"
        " a list of joints each, degrees or m",
    )
    tool: ToolGoal | None = None
    hold: Seconds | None = Field(None, description="time to stay, s")
    reactionless_deg: list[float] | None = Field(
        None, description="joints to approach without a torque on the base, degrees or m"
    )
    file: str | None = Field(None, description="CSV or Parquet file of a trajectory")
    trajectory: dict[str, list[float]] | None = Field(
        None, description="the columns of such a file"
    )
    base: Annotated[Attitude | PointingGoal | BaseTurn | None, PlainValidator(base_goal)] = Field(
        None, description="attitude, turn, or what the base points at from now on"
    )
    is_base_free: bool = Field(
        False, description="the base turns as the arm's motion turns it: base: free"
    )
    duration: Seconds | None = Field(None, description="s")
    fast: bool = Field(False, description="as fast as the limits of joints and base allow")

    @model_validator(mode="before")
    @classmethod
    def _as_written(cls, content: Any) -> Any:
        """Accept ``reactionless: {joints_deg: [...]}``, ``base: free`` and ``duration: fast``."""
        if not isinstance(content, dict):
            return content
        content = dict(content)
        if "reactionless" in content:
            inner = content.pop("reactionless")
            if not isinstance(inner, dict) or set(inner) != {"joints_deg"}:
                expected = "reactionless: {joints_deg: [...]} was expected"
                raise ValueError(f"{expected}, got {short(inner)}")
            content["reactionless_deg"] = inner["joints_deg"]
        if content.get("base") == "free":
            content |= {"is_base_free": True}
            del content["base"]
        if content.get("duration") == "fast":
            content |= {"fast": True}
            del content["duration"]
        return content

    @model_validator(mode="after")
    def _fits(self) -> Segment:
        motions = [name for name in MOTIONS if getattr(self, name) is not None]
        if len(motions) > 1:
            raise ValueError(f"{' and '.join(motions)} were given: a segment has one of them")
        if not motions and self.base is None:
            raise ValueError(f"give one of {', '.join(MOTIONS)}, or base")
        if self.base is not None and motions and motions[0] in ALONE:
            raise ValueError(f"base cannot be combined with {motions[0]}")
        if self.bends_deg is not None and self.joints_deg is None:
            raise ValueError("bends_deg needs joints_deg")
        if self.is_base_free and (not motions or motions[0] in ("hold", *ALONE)):
            raise ValueError("base: free needs joints_deg or tool")
        timed = [self.duration is not None, self.fast, self.hold is not None]
        if self.file is not None or self.trajectory is not None:
            if any(timed):
                raise ValueError("a trajectory has its own duration")
        elif sum(timed) != 1:
            raise ValueError("give duration (s), or duration: fast; hold has its own")
        return self

    @property
    def motion(self) -> str:
        """What the segment moves, in a word or two."""
        moved = [name for name in MOTIONS if getattr(self, name) is not None]
        words = [name.removesuffix("_deg") for name in moved]
        if self.is_base_free:
            words.append("free base")
        return " and ".join([*words, "base"] if self.base is not None else words)


def read_segments(texts: Sequence[str]) -> list[Segment]:
    """Return the segments written in YAML texts; empty texts count for nothing.

    Raises:
        InputError: a segment is wrong; names it, counted from 1.
    """
    written, segments = [text for text in texts if text.strip()], []
    if len(written) > MOST_SEGMENTS:
        raise InputError(f"{len(written)} segments, at most {MOST_SEGMENTS} are planned")
    for number, text in enumerate(written, 1):
        try:
            content = parse_yaml(text)
        except YamlTextError as error:
            raise InputError(f"segment {number}: {error}") from None
        _check_keys(content, f"segment {number}", (*WRITTEN, *Segment.model_fields), WRITTEN)
        if isinstance(content, dict) and isinstance(base := content.get("base"), dict):
            _check_keys(base, f"segment {number}: base", OF_BASE, OF_BASE)
        segments.append(validate(Segment, content, f"segment {number}"))
    return segments


def read_pointing(text: str, where: str) -> PointingGoal:
    """Return what the base points at, written as YAML text.

    Raises:
        InputError: it is wrong; names ``where``.
    """
    try:
        content = parse_yaml(text)
    except YamlTextError as error:
        raise InputError(f"{where}: {error}") from None
    content = {"point": content} if isinstance(content, str) else content
    _check_keys(content, where, tuple(PointingGoal.model_fields), tuple(PointingGoal.model_fields))
    return validate(PointingGoal, content, where)


def _check_keys(content: Any, where: str, known: Sequence[str], allowed: Sequence[str]) -> None:
    """Refuse a key that is not ``known``, with those that a document may have."""
    for key, value in content.items() if isinstance(content, dict) else ():
        if key not in known:
            advice = choices(str(key), allowed)
            raise InputError(
                f"{where}: {printable(str(key))}: unknown key, got {short(value)}: {advice}"
            )
