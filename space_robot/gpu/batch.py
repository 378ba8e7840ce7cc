"""Flights of one batch on a device: memory, stretches between events, logs."""

from __future__ import annotations

import copy
import time
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from space_robot_control.controller.law_choice import LawChoice
from space_robot_control.controller.signals import ControllerMemory
from space_robot_control.flight_code.c99.language import FieldName
from space_robot_control.laws.base import CompiledLaw, Signals
from space_robot_msgs_py.compiled.records import Record
from space_robot_msgs_py.samples import Reference
from space_robot_sim.plant.tick import RATE_LIMIT, PlantMemory

from ..flight.batch import FlownInBatch, choose_laws, flown_in_part, flown_whole
from ..flight.flown_log import empty_log
from ..flight.plan import Flight
from .device import Device
from .log_columns import OF_SIGNALS, columns_of, parts_of
from .structs import Structs, argument_struct, packed, unpack
from .translation import Parts, Translation, loop_calls, sizes_of

LOG_BYTES = 1 << 30
"""Of the part of all logs that is on the device at a time."""
REHEARSED, MOST_EVENTS = 32, 40
"""Flights whose events are rehearsed, and how many of each."""
MOST_STRETCH = 4000
"""Ticks between two reports of progress."""


def compiled_laws(flight: Flight) -> list[CompiledLaw]:
    """Return the laws that may be in force, that at the start first."""
    laws = [flight.law, *(law for _, law in flight.swaps)]
    return [law for law in laws if isinstance(law, CompiledLaw)]


class DeviceBatch:
    """Flights of one `batch_key` that fly together on a device."""

    def __init__(
        self,
        flights: Sequence[Flight],
        device: Device,
        is_brief: bool = False,
        is_logged: bool = True,
    ) -> None:
        """Translate the closed loop of checked flights.

        Args:
            flights: that share a batch.
            device: where they fly.
            is_brief: see `empty_log`.
            is_logged: False: nothing is kept but the state at the end.
        """
        self.flights, self._device = list(flights), device
        first = self.flights[0]
        self._laws = {law.name: law for law in compiled_laws(first)}
        self._choices = [LawChoice(flight.law, flight.swaps) for flight in self.flights]
        ticks = first.ticks if is_logged else 0
        self.logs = [empty_log(flight, 0, ticks, is_brief=is_brief) for flight in self.flights]
        self._axes = len(first.plant.names.axes)
        self._columns = columns_of(self.logs[0]) if is_logged else []
        self._row = sum(column.width for column in self._columns)
        self._engages = False
        self.seconds = 0.0
        """Time of the program so far."""
        self._varying: set[FieldName] = set()
        self._plants = np.concatenate([flight.plant.block for flight in self.flights])
        self._controllers = np.concatenate([flight.controller.block for flight in self.flights])
        self._parts = self._records()
        self._rehearse()
        self._translate()

    @property
    def device_bytes(self) -> int:
        """Memory that the flights need on the device, without their log."""
        files, parts = self.translation.files, self._parts.values()
        structs = sum(len(blocks) * files.dtype(record).itemsize for record, blocks in parts)
        missions = {id(flight.mission) for flight in self.flights}
        rows = len(missions) * self.flights[0].ticks
        references = rows * files.dtype(Reference).itemsize
        return structs + references + self._program.reserved_bytes

    def fly(self) -> list[FlownInBatch]:
        """Fly every tick; return the flights as they ended."""
        self._store()
        row_bytes, ticks = 8 * max(1, self._row) * len(self.flights), self.flights[0].ticks
        rows = min(max(1, LOG_BYTES // row_bytes), MOST_STRETCH, ticks)
        self._log = self._device.reserve((rows, self._row, len(self.flights)), np.float64)
        for start, stop in self.flights[0].stretches(rows):
            self._choose_laws(start)
            self._fly_to(start, stop)
            self._keep_rows(start, stop)
        unpack(self._memories["plants"].read(), self._plants)
        ends = (self._memories[name].read() for name in ("flies", "ticks", "statuses", "fastest"))
        return [self._flown(k, *numbers) for k, numbers in enumerate(zip(*ends, strict=True))]

    # program and memory

    def _translate(self) -> None:
        first, laws = self.flights[0], self._laws.values()
        parts: Parts = [
            (PlantMemory, self._plants),
            (PlantMemory, self._events),
            (ControllerMemory, self._controllers),
        ]
        own = [record for law in laws for record in (type(law).gains_type, type(law).memory_type)]
        self.translation = translation = Translation(
            loop_calls(first, [*laws]),
            parts,
            dict.fromkeys([PlantMemory, ControllerMemory, *own]),
            sizes_of(first),
            first.robot.n,
            self._varying,
            [FieldName(Signals, name) for name in OF_SIGNALS],
        )
        of_plants = translation.constants_of([(PlantMemory, self._plants)])
        self._of_plants = of_plants.keys() & translation.constants.keys()
        text = translation.render("loop.cu.j2", **self._content(translation))
        self._program = self._device.compile(text)

    def _records(self) -> dict[str, tuple[type[Record], NDArray[Any]]]:
        """Return the records of the flights, by the names that they have in the program."""
        parts: dict[str, tuple[type[Record], NDArray[Any]]] = {
            "plants": (PlantMemory, self._plants),
            "controllers": (ControllerMemory, self._controllers),
        }
        for name, law in self._laws.items():
            own = [next(o for o in compiled_laws(f) if o.name == name) for f in self.flights]
            gains = np.concatenate([each.gains_block for each in own])
            parts[f"{name}_gains"] = type(law).gains_type, gains
            memories = np.concatenate([each.memory_block for each in own])
            parts[f"{name}_memories"] = type(law).memory_type, memories
        return parts

    def _structs(self, name: str) -> Structs:
        """Return the memory of one of the program's names as C++ has it."""
        record, blocks = self._parts[name]
        return packed(blocks, self.translation.files.dtype(record))

    def _content(self, translation: Translation) -> dict[str, Any]:
        first = self.flights[0]
        loop = {
            "block": "&controller",
            "state": "&plant.measured",
            "reference": "reference",
            "memory": "&plant",
            "command_delay_buffer": "buffer",
            "torque": "torque",
            "tick": "tick",
            "period": "period",
        }
        laws = [
            {
                "name": law.name,
                "gains": type(law).gains_type,
                "memory": type(law).memory_type,
                "tick": translation.call(
                    f"tick_{law.name}",
                    {**loop, "law_gains": f"{law.name}_gains", "law_memory": f"&{law.name}_memory"},
                ),
            }
            for law in self._laws.values()
        ]
        return {
            "laws": laws,
            "plant": PlantMemory,
            "controller": ControllerMemory,
            "reference": Reference,
            "rows": len(first.plant.command_delay_buffer),
            "commanded": len(first.plant.names.commanded),
            "axes": self._axes,
            "columns": [column for column in self._columns if column.text],
            "of_the_law": [
                (name.removeprefix("telemetry."), first)
                for name, text, _, first, _ in self._columns
                if not text
            ],
            "rate_limit": repr(RATE_LIMIT),
            "measure": translation.call("measure", {**loop, "block": "&plant"}),
            "advance": translation.call("advance", loop),
            "engage": translation.call("engage", loop),
        }

    def _rehearse(self) -> None:
        """Let the events of some flights happen on copies, to see which numbers they change."""
        eventful = [f for f in self.flights if f.plant.next_change < f.ticks][:REHEARSED]
        after: list[NDArray[Any]] = []
        for flight in eventful:
            plant = copy.deepcopy(flight.plant)
            for _ in range(MOST_EVENTS):
                if plant.next_change >= flight.ticks:
                    break
                plant.change(int(plant.next_change))
                after.append(plant.block.copy())
        self._events = np.concatenate([*after, self._plants[:1]])

    def _store(self) -> None:
        """Copy the flights' memory to the device."""
        count = len(self.flights)
        missions = {id(flight.mission): flight.mission for flight in self.flights}
        ticks, dtype = self.flights[0].ticks, self.translation.files.dtype(Reference)
        references = [packed(m.chunk(0, ticks).references(), dtype) for m in missions.values()]
        places = {key: place for place, key in enumerate(missions)}
        # in the order of the program's struct
        arrays = {
            **{name: self._structs(name) for name in self._parts},
            "buffers": np.stack([flight.plant.command_delay_buffer for flight in self.flights]),
            "references": np.concatenate(references),
            "missions": np.array([places[id(flight.mission)] for flight in self.flights]),
            "ticks": np.array([flight.plant.tick for flight in self.flights]),
            "until": self._next_changes(),
            "has_measured": np.ones(count, np.int64),
            "flies": np.ones(count, np.int64),
            "statuses": np.zeros(count, np.int64),
            "fastest": np.zeros(count),
        }
        self._memories = {name: self._device.store(array) for name, array in arrays.items()}

    def _next_changes(self) -> NDArray[np.int64]:
        ticks = self.flights[0].ticks
        return np.array([int(min(ticks, flight.plant.next_change)) for flight in self.flights])

    # flight

    def _fly_to(self, start: int, stop: int) -> None:
        first, count = self.flights[0], len(self.flights)
        law = list(self._laws).index(first.controller.law.name)
        while True:
            memories = {**self._memories, "log": self._log}
            numbers = {
                "count": count,
                "stop": stop,
                "law": law,
                "engages": int(self._engages),
                "first": start,
                "mission_ticks": first.ticks,
                "row_stride": self._row * count,
                "period": first.period,
            }
            self._engages = False
            pointers = {name: memory.pointer for name, memory in memories.items()}
            argument = self._device.store(argument_struct(numbers, pointers))
            begun = time.monotonic()
            self._program.run("fly", count, argument)
            self.seconds += time.monotonic() - begun
            if not self._change(stop):
                break

    def _change(self, stop: int) -> bool:
        """Let the events happen at which flights wait before ``stop``; return whether any does."""
        there = self._memories
        ticks, flies, until = (there[name].read() for name in ("ticks", "flies", "until"))
        waiting = np.flatnonzero((flies != 0) & (ticks == until) & (ticks < self.flights[0].ticks))
        if not len(waiting):
            return False
        unpack(there["plants"].read(), self._plants)
        has_measured = there["has_measured"].read()
        for k in waiting:
            flight = self.flights[k]
            flight.plant.block[:] = self._plants[k : k + 1]
            flight.plant.change(int(ticks[k]))
            has_measured[k] = 0
            self._plants[k : k + 1] = flight.plant.block
        names = ["plants"]
        if changed := self._no_longer_known(self._plants[waiting]):
            self._varying |= changed
            unpack(there["controllers"].read(), self._controllers)
            self._translate()
            names.append("controllers")
        there.update((name, self._device.store(self._structs(name))) for name in names)
        there["until"].write(self._next_changes())
        there["has_measured"].write(has_measured)
        return bool(np.any(ticks[waiting] < stop))

    def _no_longer_known(self, plants: NDArray[Any]) -> set[FieldName]:
        """Return the fields that the program takes for constant, and that events have changed."""
        known = self.translation.constants
        now = self.translation.constants_of([(PlantMemory, plants)])
        return {field for field in self._of_plants if now.get(field) != known[field]}

    def _choose_laws(self, tick: int) -> None:
        flies = self._memories["flies"].read()
        self._engages = choose_laws(self.flights, self._choices, self.logs, flies, tick)
        if self._engages:
            laws = [flight.controller.law for flight in self.flights]
            blocks = np.concatenate([law.memory_block for law in laws])
            dtype = self.translation.files.dtype(type(laws[0]).memory_type)
            self._memories[f"{laws[0].name}_memories"].write(packed(blocks, dtype))

    # logs

    def _keep_rows(self, start: int, stop: int) -> None:
        if not self._columns:
            return
        numbers = np.ascontiguousarray(self._log.read(stop - start).transpose(2, 0, 1))
        for log, rows in zip(self.logs, numbers, strict=True):
            for column, place in parts_of(self._columns, log):
                column[start:stop] = rows[:, place]

    def _flown(self, k: int, flies: int, reached: int, status: int, fastest: float) -> FlownInBatch:
        flight, log = self.flights[k], self.logs[k]
        plant = flight.plant
        plant.block[:] = self._plants[k : k + 1]
        plant.state.tick = plant.truth.tick = int(reached)
        if not flies:
            return flown_in_part(k, flight, log, int(status), float(fastest))
        plant.begin_tick(plant.tick)
        return flown_whole(k, flight, log)
