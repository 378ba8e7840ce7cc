"""Flights of one batch on a device: memory, stretches between events, logs."""

from __future__ import annotations

import copy
import time
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from space_robot_control.controller.controller import unusable
from space_robot_control.controller.law_choice import LawChoice
from space_robot_control.controller.signals import USABLE, ControllerMemory
from space_robot_control.flight_code.c99.language import FieldName
from space_robot_control.laws.base import CompiledLaw, Signals
from space_robot_msgs_py.compiled.records import Record
from space_robot_msgs_py.errors import FlightError
from space_robot_msgs_py.samples import Reference
from space_robot_sim.plant.tick import RATE_LIMIT, PlantMemory

from ..flight.batch import FlownInBatch
from ..flight.ending import Ending
from ..flight.flown_log import empty_log, ended_early, note_assumed_errors
from ..flight.plan import Flight
from ..flight.simulate import measured_ticks
from .device import Device
from .log_columns import OF_SIGNALS, columns_of, parts_of
from .structs import packed, unpack
from .translation import Parts, Translation, loop_calls, sizes_of

LOG_BYTES = 1 << 30
"""Of the part of all logs that is on the device at a time."""
REHEARSED, MOST_EVENTS = 32, 40
"""Flights whose events are rehearsed, and how many of each."""
MOST_STRETCH = 4000
"""Ticks between two reports of progress."""


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
        self._laws: dict[str, CompiledLaw] = {}
        for law in (first.law, *(law for _, law in first.swaps)):
            assert isinstance(law, CompiledLaw)
            self._laws[law.name] = law
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
        self._rehearse()
        self._translate()

    @property
    def device_bytes(self) -> int:
        """Memory that the flights need on the device, without their log."""
        files, parts = self.translation.files, self._parts()
        structs = sum(len(block) * files.dtype(r).itemsize for r, block in parts.values())
        missions = {id(flight.mission) for flight in self.flights}
        rows = len(missions) * self.flights[0].ticks
        references = rows * files.dtype(Reference).itemsize
        return structs + references + self._program.reserved_bytes

    def fly(self, progress: Callable[[int], object] = lambda tick: None) -> list[FlownInBatch]:
        """Fly every tick; return the flights as they ended."""
        self._store()
        row_bytes, ticks = 8 * max(1, self._row) * len(self.flights), self.flights[0].ticks
        rows = min(max(1, LOG_BYTES // row_bytes), MOST_STRETCH, ticks)
        self._log = self._device.reserve((rows, self._row, len(self.flights)), np.float64)
        for start, stop in self.flights[0].stretches(rows):
            progress(start)
            self._choose_laws(start)
            self._fly_to(start, stop)
            self._keep_rows(start, stop)
        progress(self.flights[0].ticks)
        unpack(self._memories["plants"].read(), self._plants)
        self._flies, self._ticks = (self._memories[n].read() for n in ("flies", "ticks"))
        return [self._flown(k) for k in range(len(self.flights))]

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
        self.text = translation.render("loop.cu.j2", **self._content(translation))
        self._program = self._device.compile(self.text)

    def _parts(self) -> dict[str, tuple[type[Record], NDArray[Any]]]:
        """Return the records of the flights, by the names that they have in the program."""
        parts: dict[str, tuple[type[Record], NDArray[Any]]] = {
            "plants": (PlantMemory, self._plants),
            "controllers": (ControllerMemory, self._controllers),
        }
        for name, law in self._laws.items():
            own = [self._law_of(flight, name) for flight in self.flights]
            gains = np.concatenate([each.gains_block for each in own])
            parts[f"{name}_gains"] = type(law).gains_type, gains
            memories = np.concatenate([each.memory_block for each in own])
            parts[f"{name}_memories"] = type(law).memory_type, memories
        return parts

    @staticmethod
    def _law_of(flight: Flight, name: str) -> CompiledLaw:
        laws = (flight.law, *(law for _, law in flight.swaps))
        law = next(law for law in laws if law.name == name)
        assert isinstance(law, CompiledLaw)
        return law

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
        count, files, store = len(self.flights), self.translation.files, self._device.store
        missions = {id(flight.mission): flight.mission for flight in self.flights}
        ticks, dtype = self.flights[0].ticks, files.dtype(Reference)
        references = [packed(m.chunk(0, ticks).references(), dtype) for m in missions.values()]
        places = {key: place for place, key in enumerate(missions)}
        # in the order of the program's struct
        arrays = {
            **{name: packed(b, files.dtype(r)) for name, (r, b) in self._parts().items()},
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
        self._memories = {name: store(array) for name, array in arrays.items()}

    def _next_changes(self) -> NDArray[np.int64]:
        ticks = self.flights[0].ticks
        return np.array([int(min(ticks, flight.plant.next_change)) for flight in self.flights])

    # flight

    def _fly_to(self, start: int, stop: int) -> None:
        first, count = self.flights[0], len(self.flights)
        law = list(self._laws).index(first.controller.law.name)
        while True:
            numbers = {
                "count": count,
                "stop": stop,
                "law": law,
                "engages": int(self._engages),
                "first": start,
                "mission_ticks": first.ticks,
                "row_stride": self._row * count,
            }
            self._engages = False
            begun = time.monotonic()
            self._program.run("fly", count, self._device.store(self._common(numbers)))
            self.seconds += time.monotonic() - begun
            if not self._change(stop):
                break

    def _common(self, numbers: Mapping[str, int]) -> NDArray[Any]:
        """Return the struct of what all flights have in common."""
        pointers = {name: memory.pointer for name, memory in self._memories.items()}
        pointers["log"] = self._log.pointer
        fields: list[tuple[str, Any]] = [(name, np.int64) for name in numbers]
        fields += [("period", np.float64), *((name, np.uint64) for name in pointers)]
        values = (*numbers.values(), self.flights[0].period, *pointers.values())
        return np.array([values], fields)

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
        self._check_constants(self._plants[waiting])
        dtype = self.translation.files.dtype(PlantMemory)
        for k in waiting:
            there["plants"].write(packed(self._plants[k : k + 1], dtype), int(k))
        there["until"].write(self._next_changes())
        there["has_measured"].write(has_measured)
        return bool(np.any(ticks[waiting] < stop))

    def _check_constants(self, plants: NDArray[Any]) -> None:
        """Translate anew if an event has changed numbers that the program takes for constant."""
        now = self.translation.constants_of([(PlantMemory, plants)])
        known = self.translation.constants
        if changed := {field for field in self._of_plants if now.get(field) != known[field]}:
            self._varying |= changed
            self._move_to_new_structs()

    def _move_to_new_structs(self) -> None:
        unpack(self._memories["controllers"].read(), self._controllers)
        self._translate()
        for name in ("plants", "controllers"):
            record, blocks = self._parts()[name]
            structs = packed(blocks, self.translation.files.dtype(record))
            self._memories[name] = self._device.store(structs)

    def _choose_laws(self, tick: int) -> None:
        is_swapped, flies = False, self._memories["flies"].read()
        for k, (flight, choice) in enumerate(zip(self.flights, self._choices, strict=True)):
            change = choice.change_at(tick)
            if change and flies[k]:
                self.logs[k].laws += (change.law,)
            is_swapped |= flight.controller.use(choice.chosen)
        self._engages = is_swapped
        if is_swapped:
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

    def _flown(self, k: int) -> FlownInBatch:
        flight, log = self.flights[k], self.logs[k]
        plant, reached = flight.plant, int(self._ticks[k])
        plant.block[:] = self._plants[k : k + 1]
        plant.state.tick = plant.truth.tick = reached
        if self._flies[k]:
            plant.begin_tick(reached)
            note_assumed_errors(flight, log, 0, log.ticks)
            return FlownInBatch(k, log, Ending.complete(flight.ticks, flight.period))
        note_assumed_errors(flight, log, 0, reached)
        error = self._error(k, reached)
        log = ended_early(log, measured_ticks(flight.plant, error), reached)
        return FlownInBatch(k, log, Ending.early(error, flight.period))

    def _error(self, k: int, reached: int) -> FlightError:
        plant, status = self.flights[k].plant, int(self._memories["statuses"].read()[k])
        if status != USABLE:
            return unusable(status, reached, plant.state.quaternion)
        return plant.diverged(float(self._memories["fastest"].read()[k]))
