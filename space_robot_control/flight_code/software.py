"""The flight software as a program of C: what is translated, and the functions that call it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.compiled.records import Field as RecordField
from space_robot_msgs_py.compiled.records import Record
from space_robot_msgs_py.errors import InputError
from space_robot_msgs_py.samples import Reference, State

from ..allocation.allocation import allocate, leave_alone
from ..allocation.wheel_set import WheelSet, tabulate
from ..controller.controller import Controller
from ..controller.signals import ControllerMemory
from ..controller.supervisor import Supervisor
from ..controller.tick import Supervision, answer_state, engage, judge_stamp, swaps_due, takes_over
from ..laws import CompiledLaw, ControlLaw
from .c99 import language as lang
from .c99.program import KernelProgram
from .files import Files, reachable

ROOMS = {
    "space_robot_control.controller.tick": "controller",
    "space_robot_msgs_py.wire.stamp_guard": "controller",
    "space_robot_control.controller.signals": "signals",
    "space_robot_control.controller.time_delay_estimation": "estimate",
    "space_robot_control.navigation": "navigation",
    "space_robot_control.allocation": "allocation",
    "space_robot_model.dynamics": "dynamics",
    "space_robot_model.elementary": "elementary",
}
"""Files of C by the beginning of a module's name; all other kernels are those of laws."""
SMALLEST_RING = 4


class Part(NamedTuple):
    """A record in the state struct."""

    name: str
    record: type[Record]
    numbers: Any
    """The record with its initial numbers."""
    source: str
    """Where they come from, in words."""


class FlightSoftware:
    """Controller, laws and swaps of a flight, as they are before its first tick."""

    def __init__(
        self,
        controller: Controller,
        laws: Sequence[ControlLaw],
        swaps: Sequence[tuple[int, ControlLaw]],
        supervision: tuple[int, int],
        sources: Mapping[str, str],
    ) -> None:
        """Collect the flight software.

        Args:
            controller: with the law in force at the start.
            laws: all laws that may be in force, that one first.
            swaps: ticks, increasing, and the law from each on.
            supervision: ``hold_ticks`` and ``longest_jump``.
            sources: where numbers come from, by name of the part: ``controller``, or a law's name.

        Raises:
            InputError: a law has no kernel, or a name that C does not allow.
        """
        self.controller, self.laws = controller, list[CompiledLaw]()
        self._supervision, self._sources = supervision, sources
        for law in laws:
            if not isinstance(law, CompiledLaw):
                code = type(law).force.__code__
                raise InputError(
                    f"{code.co_filename}, line {code.co_firstlineno}: the law {law.name!r} is a "
                    "Python function and cannot be exported as C: write its equation as the "
                    "`kernel` of a CompiledLaw"
                )
            if not (law.name.isidentifier() and law.name.isascii()):
                raise InputError(
                    f"the law {law.name!r} cannot be exported as C: a name of letters, digits and "
                    "underscores was expected"
                )
            self.laws.append(law)
        self.swaps = [
            (tick, next(k for k, one in enumerate(laws) if one is law)) for tick, law in swaps
        ]
        """Ticks, and the place in ``laws`` of the law from each on."""

    @property
    def joints(self) -> int:
        """N."""
        return len(self.controller.names.joints)

    @cached_property
    def sizes(self) -> dict[str, int]:
        """Capacities of arrays in C, in place of those in Python: exactly what is needed."""
        return controller_sizes(self.controller)

    @cached_property
    def parts(self) -> list[Part]:
        """Records of the state struct in order."""
        supervisor, source = Supervisor(self.controller, *self._supervision), self._sources.get
        self.controller.engage()
        parts = [
            Part("supervision", Supervision, supervisor.block[0], source("controller", "")),
            Part("controller", ControllerMemory, self.controller.block[0], source("robot", "")),
        ]
        for law in self.laws:
            law.reset()
            gains, memory = law.gains_block[0], law.memory_block[0]
            origin = source(law.name, "")
            parts.append(Part(f"{law.name}_gains", type(law).gains_type, gains, origin))
            parts.append(Part(f"{law.name}_memory", type(law).memory_type, memory, ""))
        return parts


@dataclass(frozen=True)
class Translated:
    """The flight software's kernels in C."""

    software: FlightSoftware
    program: KernelProgram
    files: Files
    roots: dict[str, str]
    """Names in C of the kernels that are called from outside, by their names here."""
    tables: frozenset[lang.FieldName]
    """Fields that are computed from others when the memory is initialised."""


def translate(software: FlightSoftware) -> Translated:
    """Translate the flight software.

    Every translation tells which numbers no kernel writes. In the next one they are known, so
    branches that they decide for good are left out, and what is written only there.
    """
    constants: dict[lang.FieldName, float] | None = None
    known: dict[lang.FieldName, float] = {}
    while known != constants:
        constants = known
        program, roots = _program(software, constants)
        reached = reachable(program, roots.values())
        written = {field for function in reached for field in function.stores}
        # gains may be changed in flight
        own = (p for p in software.parts if p.name in ("supervision", "controller"))
        blocks = [(part.record, np.array([part.numbers])) for part in own]
        known = constant_fields(program, blocks, written)
    # what a user fills, and gains and memories of laws, have all their fields
    whole: list[type[Record]] = [State, Reference]
    whole += [part.record for part in software.parts if "_" in part.name]
    files = Files(program, list(roots.values()), whole, _room)
    names = {name: files.name_of(function) for name, function in roots.items()}
    tables = reachable(program, [roots["tabulate"]]) if "tabulate" in roots else []
    stores = frozenset(field for function in tables for field in function.stores)
    return Translated(software, program, files, names, stores)


def _program(
    software: FlightSoftware, constants: dict[lang.FieldName, float]
) -> tuple[KernelProgram, dict[str, Any]]:
    program = KernelProgram(software.sizes, software.joints)
    program.constants = constants
    supervision, controller, state, reference = (
        argument(lang.BlockOf(record))
        for record in (Supervision, ControllerMemory, State, Reference)
    )
    tick, period = argument(lang.INT), argument(lang.FLOAT)
    has_actuators = bool(software.controller.names.actuators)
    how = argument(lang.Known(allocate if has_actuators else leave_alone))
    calls: dict[str, tuple[Any, tuple[lang.Value, ...]]] = {
        "judge": (judge_stamp, (supervision, tick)),
        "takes_over": (takes_over, (supervision, tick)),
        "engage": (engage, (controller,)),
    }
    if wheels := software.sizes["MOST_WHEELS"]:
        axis = argument(lang.ArrayOf((wheels, 3)))
        calls["tabulate"] = (tabulate, (argument(lang.Pointer(WheelSet)), axis, tick))
    if software.swaps:
        ticks = argument(lang.ArrayOf((len(software.swaps),)))
        calls["swaps_due"] = (swaps_due, (ticks, tick, tick))
    for law in software.laws:
        inputs = how, tick, state, reference, period
        calls[f"answer_state {law.name}"] = (
            answer_state,
            (supervision, controller, law_argument(law), *inputs),
        )
    numbers = {
        name: program.function(kernel.py_func, arguments)
        for name, (kernel, arguments) in calls.items()
    }
    return program, {name: program.functions[number] for name, number in numbers.items()}


def argument(kind: lang.Type) -> lang.Value:
    """Return an argument of a type, whose value nobody knows."""
    return lang.Value(kind, "argument")


def law_argument(law: CompiledLaw) -> lang.Value:
    """Return the argument ``law`` of kernels: a `LawCode` whose functions are bound."""
    own = type(law)
    items = {
        "run": lang.Known(own.kernel),
        "gains": lang.BlockOf(own.gains_type),
        "memory": lang.BlockOf(own.memory_type),
        "h_bar": lang.FieldOf("gains", "h_bar") if law.h_bar.size else lang.EMPTY,
        "estimate": lang.Known(law.estimate),
        "uses_model": lang.Known(law.needs_model),
        "adds_inertia": lang.Known(law.adds_inertia),
    }
    return argument(lang.Bundle(law.name, tuple(items.items())))


def controller_sizes(controller: Controller) -> dict[str, int]:
    """Return the capacities of arrays that a controller needs, by the constants' names."""
    names, memory = controller.names, controller.block[0]
    wheels, ring = len(names.wheels), SMALLEST_RING
    while ring < memory.navigation.attitude.delay + 2:
        ring *= 2
    return {
        "MOST_JOINTS": int(memory.signals.model.joint_count),
        "MOST_WHEELS": wheels,
        "MOST_PAIRS": wheels * (wheels - 1) // 2,
        "MOST_THRUSTERS": len(names.thrusters),
        "MOST_TORQUERS": len(names.torquers),
        "MOST_ACTUATORS": len(names.actuators),
        "RING": ring,
    }


def constant_fields(
    program: KernelProgram,
    blocks: Iterable[tuple[type[Record], NDArray[Any]]],
    written: set[lang.FieldName],
) -> dict[lang.FieldName, float]:
    """Return the fields all of whose numbers are the same, and that no kernel writes.

    Args:
        program: with the sizes of arrays.
        blocks: records, and arrays (k,) of them.
        written: fields that kernels write.
    """
    bits_of: dict[lang.FieldName, set[int]] = {}

    def visit(record: type[Record], numbers: NDArray[Any]) -> None:
        for name, field in record.fields().items():
            if not isinstance(field, RecordField):
                visit(field, numbers[name])
            elif (key := lang.FieldName(record, name)) not in written:
                kept = numbers_of((len(numbers), *program.shape(record, name)), numbers[name])
                bits = kept.reshape(-1).view(np.int64)
                ends = {int(bits.min()), int(bits.max())} if bits.size else {0, 1}
                bits_of.setdefault(key, set()).update(ends)

    for record, numbers in blocks:
        visit(record, numbers)
    known = {
        field: float(np.int64(bits.pop()).view(np.float64))
        for field, bits in bits_of.items()
        if len(bits) == 1
    }
    return {field: number for field, number in known.items() if number == number}


def numbers_of(shape: tuple[int, ...], numbers: Any) -> NDArray[np.float64]:
    """Return the part of a field's numbers that a shape keeps."""
    array: NDArray[np.float64] = np.asarray(numbers, dtype=np.float64)
    return array[tuple(slice(0, size) for size in shape)]


def _room(module: str) -> str:
    return next((room for start, room in ROOMS.items() if module.startswith(start)), "laws")
