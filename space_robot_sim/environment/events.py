"""Events of a mission: capture and release of a target, at the begin of a tick.

As text ``capture@T:TARGET`` and ``release@T[:SPEED]``, T in simulated seconds. TARGET is a name of
``config/targets``, a path to a YAML file, or the target itself in braces, as JSON has it: so the
text of a `Capture` holds all its numbers.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from pydantic import AfterValidator

from space_robot_msgs_py.config.settings import Texts
from space_robot_msgs_py.config.validation import one_of, short
from space_robot_msgs_py.config.yaml_text import YamlTextError, parse_yaml
from space_robot_msgs_py.errors import InputError
from space_robot_msgs_py.simulated_time import check_time, shortest

from ..faults.grammar import NUMBER
from .target import Target, find_target

_EVENT = re.compile(rf"(?P<kind>[^@]*)@(?P<time>{NUMBER})(?::(?P<argument>.+))?", re.ASCII)
FASTEST = 100.0
"""Largest speed of a release, m/s."""


@dataclass(frozen=True)
class Capture:
    """Capture of a target by a tool; ``str`` gives its text."""

    time_s: float
    """Simulated time, s."""
    target: Target

    def __str__(self) -> str:
        return f"capture@{shortest(self.time_s)}:{self.target.inline}"

    @property
    def label(self) -> str:
        """The event in a few words."""
        return f"capture@{shortest(self.time_s)}:{self.target.name}"


@dataclass(frozen=True)
class Release:
    """Release of the captured target; ``str`` gives its text."""

    time_s: float
    """Simulated time, s."""
    speed: float = 0.0
    """m/s at which a spring pushes it off along z of the tool's frame; 0: there is none."""

    def __str__(self) -> str:
        speed = f":{shortest(self.speed)}" if self.speed else ""
        return f"release@{shortest(self.time_s)}{speed}"

    @property
    def label(self) -> str:
        """The event in a few words."""
        return str(self)


Event = Capture | Release
FORMS = {
    "capture@T:TARGET": "the tool grasps TARGET, of config/targets, or a path to its YAML",
    "release@T[:SPEED]": "the tool lets go what it holds, at SPEED m/s (0: without a push)",
}
"""Classes of events by the name used in texts."""


def parse_events(texts: Iterable[str], folder: Path = Path()) -> list[Event]:
    """Parse events and sort them by time; a target's file may be in ``folder``.

    Raises:
        InputError: capture while a target is held, or release without a target.
    """
    events = [_read(text, folder) for text in texts if text.strip()]
    # a stable sort: events of one time happen in the user's order
    ordered = sorted(events, key=lambda event: event.time_s)
    held: Capture | None = None
    for event in ordered:
        if isinstance(event, Release):
            if held is None:
                raise InputError(f"event {event.label!r}: nothing is held then")
            held = None
        elif held is not None:
            raise InputError(
                f"event {event.label!r}: {held.target.name!r} is held since "
                f"{shortest(held.time_s)} s: it must be released first"
            )
        else:
            held = event
    return ordered


def check_events(texts: list[str]) -> list[str]:
    """Check texts of events without opening files, and return them."""
    for text in texts:
        if text.strip():
            _split(text)
    return texts


def named_targets(texts: Iterable[str]) -> list[str]:
    """Return the names and paths of targets in texts of events: what `parse_events` would open."""
    arguments = [_split(text)[1] for text in texts if text.strip()]
    return [argument for argument in arguments if isinstance(argument, str)]


EventTexts = Annotated[Texts, AfterValidator(check_events)]


def _read(text: str, folder: Path) -> Event:
    time_s, argument = _split(text)
    if isinstance(argument, float):
        return Release(time_s, argument)
    if isinstance(argument, Target):
        return Capture(time_s, argument)
    try:
        return Capture(time_s, find_target(argument, folder))
    except InputError as error:
        raise InputError(f"event {short(text)}: {error}") from None


def _split(text: str) -> tuple[float, float | Target | str]:
    """Return the time (s) of an event, and the speed (m/s) of a release or the target of a capture.

    The target is a name or path where the text does not hold it.
    """
    where = f"event {short(text)}"
    match = _EVENT.fullmatch(text.strip())
    if match is None:
        raise InputError(f"{where}: {' or '.join(FORMS)} expected, as capture@10:small_satellite")
    kind = one_of(match["kind"], ("capture", "release"), "kind", f" in {where}")
    time_s, argument = float(match["time"]), (match["argument"] or "").strip()
    try:
        check_time(time_s)
        if kind == "release":
            return time_s, _speed(argument)
        if not argument.startswith("{"):
            if not argument:
                raise InputError("a target is needed: capture@T:TARGET")
            return time_s, argument
        content = parse_yaml(argument)
    except (InputError, YamlTextError) as error:
        raise InputError(f"{where}: {error}") from None
    return time_s, Target.from_dict({"target": content}, where)


def _speed(argument: str) -> float:
    try:
        speed = float(argument or 0.0)
    except ValueError:
        speed = -1.0
    if not 0.0 <= speed <= FASTEST:
        raise InputError(
            f"SPEED must be a number from 0 to {FASTEST:g} (m/s), got {short(argument)}"
        )
    return speed
