"""The exported folder: interface, kernels, parameters, and how to build them."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Sequence
from functools import cached_property
from math import prod
from pathlib import PurePosixPath
from textwrap import fill
from typing import Any, NamedTuple

import jinja2
import numpy as np

from space_robot_msgs_py.compiled.records import Field as RecordField
from space_robot_msgs_py.compiled.records import Record
from space_robot_msgs_py.samples import Reference, State

from .c99 import language as lang
from .c99.language import literal
from .files import WIDTH, comment, descriptions, wrapped
from .software import FlightSoftware, Part, Translated, numbers_of, translate

FLAGS = ("-std=c99", "-O2", "-ffp-contract=off", "-fno-tree-vectorize")
"""The bits do not depend on the optimisation, but on no fused operations, which the vectoriser of
gcc (12 on x86-64, 16 on RISC-V) makes in spite of ``-ffp-contract=off``."""
WARNINGS = ("-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Wdouble-promotion", "-Werror")


class Exported:
    """The flight software as files of C."""

    def __init__(
        self,
        software: FlightSoftware,
        robot: str = "",
        scenario: str = "",
        requirements: Sequence[str] = (),
    ) -> None:
        """Translate the flight software.

        Args:
            software: what flies.
            robot: name of the robot, for comments.
            scenario: text whose digest names the scenario; empty: the parameters themselves.
            requirements: identifier and text of each that is allocated to it, for the header.
        """
        self.translated: Translated = translate(software)
        self.software, self.requirements = software, requirements
        self.robot = " ".join(robot.replace("*/", "* /").split())  # it stands in comments
        self._entries = [
            entry for part in software.parts for entry in entries(self.translated, part)
        ]
        text = scenario or "".join(entry.definition for entry in self._entries)
        self.digest = hashlib.sha256(text.encode()).hexdigest()
        self.templates = jinja2.Environment(
            loader=jinja2.PackageLoader(__package__), keep_trailing_newline=True, autoescape=False
        )

    @cached_property
    def sources(self) -> dict[PurePosixPath, str]:
        """The text of each file that is compiled, by its path in the folder."""
        written = self.translated.files
        sources = {
            PurePosixPath("include/space_robot_flight.h"): self._header(),
            PurePosixPath("parameters.h"): self.render(
                "parameters.h", entries=[entry.definition for entry in self._entries]
            ),
            PurePosixPath("src/kernels.h"): self.render(
                "kernels.h",
                constants=written.constants(),
                tuples=written.tuples(),
                prototypes=written.final(written.prototypes()),
            ),
            PurePosixPath("src/flight.c"): self._interface(),
        }
        for room, text in written.rooms().items():
            sources[PurePosixPath(f"src/{room}.c")] = f'#include "kernels.h"\n{text}'
        return sources

    @property
    def measurement_type(self) -> np.dtype[Any]:
        """Memory layout of ``space_robot_measurement``."""
        return np.dtype([("tick", np.int64), ("state", self.translated.files.dtype(State))])

    @property
    def reference_type(self) -> np.dtype[Any]:
        """Memory layout of ``space_robot_reference``."""
        return self.translated.files.dtype(Reference)

    @property
    def command_type(self) -> np.dtype[Any]:
        """Memory layout of ``space_robot_command``."""
        count = len(self.software.controller.names.commanded)
        return np.dtype([("tick", np.int64), ("command", np.float64, (count,))])

    def render(self, template: str, **content: Any) -> str:
        """Return a file made from a template."""
        software = self.software
        names = software.controller.names
        general = {
            "robot": self.robot,
            "digest": self.digest,
            "joints": software.joints,
            "wheels": len(names.wheels),
            "thrusters": len(names.thrusters),
            "torquers": len(names.torquers),
            "period": repr(software.controller.period),
            "flags": FLAGS,
            "warnings": WARNINGS,
        }
        return self.templates.get_template(f"{template}.j2").render(**general, **content)

    def figures(self) -> dict[str, Any]:
        """Return what can be counted without a compiler."""
        text = "".join(self.sources.values())
        return {
            "laws": [law.name for law in self.software.laws],
            "functions": len(self.translated.files.functions),
            "lines": text.count("\n"),
            "state_bytes": 8 * (2 + sum(self._numbers(p.record) for p in self.software.parts)),
            "swaps": [
                (tick * self.software.controller.period, self.software.laws[place].name)
                for tick, place in self.software.swaps
            ],
        }

    def _numbers(self, record: type[Record]) -> int:
        kinds = (kind for _, kind in self.translated.files.kept(record))
        return sum(prod(kind) if isinstance(kind, tuple) else self._numbers(kind) for kind in kinds)

    def _header(self) -> str:
        parts = self.translated.software.parts
        program = self.translated.program
        records: list[type[Record]] = [State, Reference, *(part.record for part in parts)]
        return self.render(
            "space_robot_flight.h",
            requirements="".join(comment(fill(text, WIDTH - 4)) for text in self.requirements),
            laws=[law.name for law in self.software.laws],
            structs=self.translated.files.structs(records),
            parts=[(part.name, program.struct_name(part.record)) for part in parts],
        )

    def _interface(self) -> str:
        roots, program = self.translated.roots, self.translated.program
        parts = {part.name: part for part in self.software.parts}
        laws = []
        for law in self.software.laws:
            gains, memory = parts[f"{law.name}_gains"], parts[f"{law.name}_memory"]
            first = next(iter(gains.record.fields()), None)
            laws.append(
                {
                    "name": law.name,
                    "gains": program.struct_name(gains.record),
                    "first_gain": f"state->{gains.name}.{first}",
                    "gain_count": sum(
                        self.software.joints + 3
                        for field in gains.record.fields().values()
                        if isinstance(field, RecordField)
                    ),
                    "reset": [entry.assignment for entry in entries(self.translated, memory)],
                    "answer": roots[f"answer_state {law.name}"],
                    "arguments": self._arguments(law.name),
                }
            )
        assignments = [entry.assignment for entry in self._entries]
        return self.render(
            "flight.c",
            laws=laws,
            roots=roots,
            swaps=self.software.swaps,
            assignments=assignments,
            fills=any(line.startswith("fill(") for line in assignments),
        )

    def _arguments(self, law: str) -> str:
        arguments = {
            "block": "&state->supervision",
            "controller": "&state->controller",
            "law_gains": f"&state->{law}_gains",
            "law_memory": f"&state->{law}_memory",
            "tick": "tick",
            "state": "&measurement->state",
            "reference": "reference",
            "period": "SPACE_ROBOT_PERIOD",
        }
        name = self.translated.roots[f"answer_state {law}"]
        files_ = self.translated.files
        function = next(f for f in files_.functions if files_.name_of(f) == name)
        return ", ".join(arguments[parameter.name] for parameter in function.parameters)


class Entry(NamedTuple):
    """A number, or an array of numbers, of the state struct."""

    definition: str
    """In ``parameters.h``."""
    assignment: str
    """In `space_robot_init`."""


def entries(translated: Translated, part: Part) -> Iterator[Entry]:
    """Return all numbers of a part that are not zero before the first tick."""
    source = f" Source: {part.source}." if part.source else ""
    yield from _entries(translated, part.record, part.numbers, part.name, source)


def _entries(
    translated: Translated, record: type[Record], numbers: Any, path: str, source: str
) -> Iterator[Entry]:
    texts = descriptions(record)
    for name, kind in translated.files.kept(record):
        inside = f"{path}.{name}"
        if not isinstance(kind, tuple):
            yield from _entries(translated, kind, numbers[name], inside, source)
            continue
        kept = numbers_of(kind, numbers[name])
        # by bits: -0.0 is not zero
        is_table = lang.FieldName(record, name) in translated.tables
        if is_table or not np.any(kept.view(np.int64)):
            continue
        constant = f"SR_{inside.replace('.', '_').upper()}"
        about = comment(f"{inside}: {texts.get(name, 'see its struct.')}{source}")
        if not kind:
            define = f"{about}#define {constant} ({literal(float(kept))})\n"
            yield Entry(define, f"state->{inside} = {constant};")
            continue
        flat, target = kept.reshape(-1), f"state->{inside}"
        if np.all(flat == flat[0]) or np.all(np.isnan(flat)):
            define = f"#define {constant} ({literal(float(flat[0]))})\n"
            yield Entry(about + define, _by_rows("fill", target, constant, kind))
            continue
        values = wrapped("    " + ", ".join(literal(float(value)) for value in flat))
        table = f"static const double {constant}[{flat.size}] = {{\n{values}\n}};\n"
        yield Entry(about + table, _by_rows("copy", target, constant, kind))


def _by_rows(function: str, target: str, source: str, shape: tuple[int, ...]) -> str:
    if len(shape) == 1:
        return f"{function}({target}, {source}, {shape[0]});"
    rows, columns = shape
    part = source if function == "fill" else f"&{source}[row * {columns}]"
    call = f"{function}({target}[row], {part}, {columns});"
    return f"for (int64_t row = 0; row < {rows}; ++row) {{\n        {call}\n    }}"
