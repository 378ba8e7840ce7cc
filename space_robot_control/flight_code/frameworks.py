"""Components round the exported flight software, for F' (``fprime``) and for NASA's cFS (``cfs``).

Ports, messages and telemetry come from the table of signals: of the state those that the flight
software reads, with the sizes of this robot.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from math import prod
from pathlib import PurePosixPath
from typing import NamedTuple

from space_robot_msgs_py.compiled.records import Record
from space_robot_msgs_py.samples import CommandSignals, Reference, State, TelemetrySignals
from space_robot_msgs_py.signals import Reporter, signals_of

from .c99 import language as lang
from .folder import Exported

WATCHED = (Reporter.SENSORS, Reporter.ACTUATORS)
"""Reporters of the measured signals that are telemetry."""


class PortSignal(NamedTuple):
    """Signal of a port, message or telemetry channel."""

    name: str
    """In the structs of C; of telemetry that the law computes, its text."""
    size: int
    text: str
    """What it is, with its unit and frame."""
    place: str
    """Its numbers in C: in ``state``, ``command``, or ``telemetry``."""
    first: int = 0
    """Of a command: index of its first number."""

    @property
    def title(self) -> str:
        """The name in CamelCase, as telemetry has it."""
        return "".join(word.capitalize() for word in re.split(r"\W|_", self.name))

    @property
    def parameter(self) -> str:
        """The title with a small first letter, as ports have it."""
        return self.title[:1].lower() + self.title[1:]


def framework_files(exported: Exported, framework: str) -> dict[PurePosixPath, str]:
    """Return the text of each file of a framework's folder by its path in the exported one.

    Args:
        exported: the flight software.
        framework: ``fprime`` or ``cfs``.
    """
    names = exported.software.controller.names
    used = exported.translated.files.used
    axes, table = len(names.axes), signals_of(State)
    parts = ("commanded_torque", 0, axes), ("actuator_commands", axes, len(names.actuators))
    commands = signals_of(CommandSignals)
    measured = [s for s in _kept(exported, State) if lang.FieldName(State, s.name) in used]
    signals = {
        "measured": measured,
        "desired": list(_kept(exported, Reference)),
        "commanded": [
            PortSignal(name, size, commands[name].description, f"command + {first}", first)
            for name, first, size in parts
            if size
        ],
        "watched": [signal for signal in measured if table[signal.name].reporter in WATCHED],
        "computed": [
            PortSignal(s.text, axes, s.description, f"telemetry.{'error' if name == 'e' else name}")
            for name, s in signals_of(TelemetrySignals).items()
        ],
    }
    sizes = sorted({signal.size for group in signals.values() for signal in group})
    laws = [law.name for law in exported.software.laws]
    ending, templates = ".j2", exported.templates.list_templates()
    files = [t.removesuffix(ending) for t in templates if t.startswith(f"{framework}/")]
    content = {"laws": laws, "sizes": sizes, **signals}
    return {PurePosixPath(file): exported.render(file, **content) for file in files}


def _kept(exported: Exported, record: type[Record]) -> Iterator[PortSignal]:
    declared = signals_of(record)
    for name, kind in exported.translated.files.kept(record):
        assert isinstance(kind, tuple)
        yield PortSignal(name, prod(kind), declared[name].description, f"state.{name}")
