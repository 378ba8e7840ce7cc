"""The closed loop of flights as a program of CUDA C++, translated from their kernels.

The text is C++ for any processor, too: where no CUDA compiler reads it, a loop over the flights
stands for the threads.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import jinja2
import numpy as np
from numpy.typing import NDArray

from space_robot_control.allocation.allocation import allocate, leave_alone
from space_robot_control.controller.signals import ControllerMemory
from space_robot_control.controller.tick import controller_tick, engage
from space_robot_control.flight_code.c99 import language as lang
from space_robot_control.flight_code.c99.program import Function, KernelProgram
from space_robot_control.flight_code.files import Files, reachable
from space_robot_control.flight_code.software import (
    argument,
    constant_fields,
    controller_sizes,
    law_argument,
)
from space_robot_control.laws.base import CompiledLaw
from space_robot_model.elementary.normal import normal_numbers, normal_numbers_of_one
from space_robot_msgs_py.compiled.records import Field, Record
from space_robot_msgs_py.samples import Reference, State
from space_robot_sim.plant.tick import PlantMemory, advance, measure

from ..flight.plan import Flight

Call = tuple[Any, tuple[lang.Value, ...]]
"""A kernel and its arguments."""
Parts = Sequence[tuple[type[Record], NDArray[Any]]]
"""Records, and blocks (F,) of them."""
OF_THE_LOOP = (PlantMemory, ControllerMemory)
"""Records whose structs have what is used only. Numbers of others, of laws, are never known, so
that other gains need no other program."""


class Cuda(lang.C99):
    """What of the text is C++'s own."""

    local_function = shared_function = "static __device__ "
    table = "static __device__ const double"

    def tuple_of(self, name: str, items: str, is_uniform: bool) -> str:
        """Return a value of the struct ``name`` that stands for a tuple."""
        return f"{name}{{{{{items}}}}}" if is_uniform else f"{name}{{{items}}}"


class Translation:
    """Kernels in C++, for records whose numbers are known where all of them are the same."""

    def __init__(
        self,
        calls: Mapping[str, Call],
        parts: Parts,
        records: Iterable[type[Record]],
        sizes: Mapping[str, int],
        joints: int,
        varying: Iterable[lang.FieldName] = (),
        kept: Iterable[lang.FieldName] = (),
    ) -> None:
        """Translate kernels, and all that they call.

        Numbers that no kernel writes are known if they make the shape of a flight (they are
        ``uniform``) or say what it has not (they are 0). What is written is found by assuming
        first that nothing is: what only a branch writes that is never taken does not count.

        Args:
            calls: kernels by name.
            parts: memory before the first tick, and after events.
            records: that have structs.
            sizes: capacities of arrays, by the constants' names.
            joints: n.
            varying: fields that may change between kernels, though they are the same now.
            kept: fields that structs have though no kernel reads them.
        """
        self._written, self._records = set(varying), list(records)
        while True:
            self.program = KernelProgram(
                sizes, joints, Cuda(), {normal_numbers: normal_numbers_of_one}
            )
            self.program.constants = self.constants = self.constants_of(parts)
            numbers = {
                name: self.program.function(kernel.py_func, arguments)
                for name, (kernel, arguments) in calls.items()
            }
            self.roots = {name: self.program.functions[k] for name, k in numbers.items()}
            reached = reachable(self.program, self.roots.values())
            written = {field for function in reached for field in function.stores}
            self._written |= written
            if not written & self.constants.keys():
                break
        whole = [State, Reference, *(r for r in self._records if r not in OF_THE_LOOP)]
        self.files = Files(self.program, list(self.roots.values()), whole, lambda module: "loop")
        self.files.fields |= set(kept)

    def constants_of(self, parts: Parts) -> dict[lang.FieldName, float]:
        """Return the fields that are known, of memory between two stretches."""
        constants = constant_fields(self.program, parts, self._written)
        zero = np.float64(0.0).tobytes()

        def is_known(record: type[Record], name: str, number: float) -> bool:
            declared = record.fields()[name]
            is_uniform = isinstance(declared, Field) and declared.uniform
            return is_uniform or np.float64(number).tobytes() == zero

        return {field: number for field, number in constants.items() if is_known(*field, number)}

    def call(self, root: str, texts: Mapping[str, str]) -> str:
        """Return the text that calls a kernel with texts by the names of its parameters."""
        function: Function = self.roots[root]
        arguments = ", ".join(texts[parameter.name] for parameter in function.parameters)
        return f"{self.files.name_of(function)}({arguments})"

    def render(self, template: str, **content: Any) -> str:
        """Return the whole text: what is translated, and the loop of a template around it."""
        environment = jinja2.Environment(
            loader=jinja2.ChoiceLoader(
                [
                    jinja2.PackageLoader("space_robot.gpu"),
                    jinja2.PackageLoader("space_robot_control.flight_code"),
                ]
            ),
            keep_trailing_newline=True,
            autoescape=False,
        )
        return environment.get_template(template).render(
            structs=self.files.structs([*self._records, State, Reference]),
            constants=self.files.constants(),
            tuples=self.files.tuples(),
            prototypes=self.files.final(self.files.prototypes()),
            functions="".join(self.files.rooms().values()),
            struct_of=self.program.struct_name,
            **content,
        )


def sizes_of(flight: Flight) -> dict[str, int]:
    """Return the capacities of arrays that a flight needs."""
    model, wheels = flight.plant.memory.model, len(flight.plant.names.wheels)
    joints, rotors = int(model.joint_count), int(model.rotor_count)
    sizes = controller_sizes(flight.controller)
    sizes["MOST_JOINTS"] = joints = max(joints, sizes["MOST_JOINTS"])
    return {
        **sizes,
        "MOST_MOVING": joints + wheels + rotors,
        "MOST_NUMBERS": 13 + 2 * joints + wheels + 2 * rotors + 6,
        "MOST_PASSIVE": len(flight.plant.names.passive),
    }


def loop_calls(flight: Flight, laws: Sequence[CompiledLaw]) -> dict[str, Call]:
    """Return the kernels of the closed loop; ``laws`` are all that may be in force."""
    tick, period = argument(lang.INT), argument(lang.FLOAT)
    names, rows = flight.plant.names, len(flight.plant.command_delay_buffer)
    torque = argument(lang.ArrayOf((len(names.commanded),)))
    buffer = argument(lang.ArrayOf((rows, len(names.commanded))))
    controller = argument(lang.BlockOf(ControllerMemory))
    states, references = argument(lang.BlockOf(State)), argument(lang.BlockOf(Reference))
    how = argument(lang.Known(allocate if names.actuators else leave_alone))
    inputs = tick, states, references, torque, period
    return {
        "measure": (measure, (argument(lang.BlockOf(PlantMemory)), tick, period)),
        "advance": (advance, (argument(lang.Pointer(PlantMemory)), buffer, torque, tick, period)),
        "engage": (engage, (controller,)),
        **{
            f"tick_{law.name}": (controller_tick, (controller, law_argument(law), how, *inputs))
            for law in laws
        },
    }
