"""The exported folder: interface, kernels, parameters, and how to build them."""

from __future__ import annotations

import hashlib
from functools import cached_property
from math import prod
from pathlib import PurePosixPath
from typing import Any

import jinja2

from space_robot_msgs_py.compiled.records import Field as RecordField
from space_robot_msgs_py.compiled.records import Record
from space_robot_msgs_py.samples import Reference, State

from .parameters import entries, reset_lines
from .software import FlightSoftware, Translated, translate

FLAGS = ("-std=c99", "-O2", "-ffp-contract=off", "-fno-tree-vectorize")
"""The bits do not depend on the optimisation, but on no fused operations, which the vectoriser of
gcc (12 on x86-64, 16 on RISC-V) makes in spite of ``-ffp-contract=off``."""
WARNINGS = ("-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Wdouble-promotion", "-Werror")


class Exported:
    """The flight software as files of C."""

    def __init__(self, software: FlightSoftware, robot: str = "", scenario: str = "") -> None:
        """Translate the flight software.

        Args:
            software: what flies.
            robot: name of the robot, for comments.
            scenario: text whose digest names the scenario; empty: the parameters themselves.

        Raises:
            InputError: something has no translation to C.
        """
        self.translated: Translated = translate(software)
        self.software, self.robot = software, robot
        self._entries = list(entries(self.translated))
        text = scenario or "".join(entry.definition for entry in self._entries)
        self.digest = hashlib.sha256(text.encode()).hexdigest()
        self._templates = jinja2.Environment(
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
    def rooms(self) -> list[str]:
        """Names of the files of C in ``src``."""
        return sorted(path.name for path in self.sources if path.suffix == ".c")

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
        return self._templates.get_template(f"{template}.j2").render(**general, **content)

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
        """Return the number of floats in an exported struct."""
        kinds = (kind for _, kind in self.translated.kept(record))
        return sum(prod(kind) if isinstance(kind, tuple) else self._numbers(kind) for kind in kinds)

    def _header(self) -> str:
        parts = self.translated.software.parts
        program = self.translated.program
        records: list[type[Record]] = [State, Reference, *(part.record for part in parts)]
        return self.render(
            "space_robot_flight.h",
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
                    "reset": reset_lines(self.translated, memory),
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
        """Return the arguments of a law's kernel in the interface."""
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
