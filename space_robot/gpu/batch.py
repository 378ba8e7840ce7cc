"""Flights of one batch on a device: memory, stretches between events, logs."""

from __future__ import annotations

import copy
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from space_robot_control.controller.controller import unusable
from space_robot_control.controller.law_choice import LawChoice
from space_robot_control.controller.signals import USABLE, ControllerMemory
from space_robot_control.flight_code.c99.language import FieldName
from space_robot_control.laws.base import CompiledLaw, Signals
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.compiled.records import Record
from space_robot_msgs_py.errors import FlightError
from space_robot_msgs_py.samples import ALL_FIELDS, Reference
from space_robot_sim.plant.tick import RATE_LIMIT, PlantMemory

from ..flight.batch import FlownInBatch
from ..flight.ending import Ending
from ..flight.flown_log import empty_log, ended_early, note_assumed_errors
from ..flight.plan import Flight
from ..flight.simulate import measured_ticks
from .device import Device, Memory
from .structs import packed, unpack
from .translation import Parts, Translation, loop_calls, sizes_of

Array = NDArray[np.float64]

LOG_BYTES = 1 << 30
"""Of the part of all logs that is on the device at a time."""
REHEARSED = 32
"""Flights whose events are rehearsed."""
MOST_STRETCH = 4000
"""Ticks between two reports of progress."""


class LogColumn(NamedTuple):
    """Numbers of a log's row."""

    name: str
    text: str
    """An array in C++."""
    width: int
    first: int
    """Place in the row."""
    before: bool
    """Whether they are known before the law's answer."""


def columns_of(log: FlightLog) -> list[LogColumn]:
    """Return what the program writes at each tick, of a flight's log."""
    columns: list[LogColumn] = []

    def add(name: str, text: str, width: int, before: bool = False) -> None:
        if width:
            first = sum(column.width for column in columns)
            columns.append(LogColumn(name, text, width, first, before))

    for name in ALL_FIELDS:
        add(f"truth.{name}", f"plant.truth.{name}", getattr(log, name).shape[1], True)
    for name, column in ({} if log.measured is None else log.measured.columns).items():
        add(f"measured.{name}", f"plant.measured.{name}", column.shape[1], True)
    axes = log.axes
    add("commanded_torque", "torque", 0 if log.commanded_torque is None else axes)
    add("actuator_commands", f"(&torque[{axes}])", log.actuator_commands.shape[1])
    if log.telemetry is not None:
        add("n_hat", "controller.signals.n_hat", axes)
        add("error", "controller.signals.error", axes)
    return columns


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
        self._telemetry = self._row if is_logged and self.logs[0].telemetry is not None else 0
        if self._telemetry:
            self._row += 2 * self._axes
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
        structs = sum(len(block) * files.dtype(record).itemsize for record, block in parts.items())
        missions = {id(flight.mission) for flight in self.flights}
        rows = len(missions) * self.flights[0].ticks
        return structs + rows * files.dtype(Reference).itemsize

    def fly(self, progress: Callable[[int], object] = lambda tick: None) -> list[FlownInBatch]:
        """Fly every tick; return the flights as they ended."""
        self._store()
        rows = max(1, LOG_BYTES // (8 * max(1, self._row) * len(self.flights)))
        for start, stop in self.flights[0].stretches(min(rows, MOST_STRETCH)):
            progress(start)
            self._choose_laws(start)
            self._fly_to(start, stop)
            self._keep_rows(start, stop)
        progress(self.flights[0].ticks)
        unpack(self._plant_memory.read(), self._plants)
        self._flies, self._ticks = self._whole["flies"].read(), self._whole["ticks"].read()
        return [self._flown(k) for k in range(len(self.flights))]

    # program and memory

    def _translate(self) -> None:
        first, parts = self.flights[0], self._parts()
        translation = Translation(
            loop_calls(first, [*self._laws.values()]),
            {**parts, PlantMemory: np.concatenate([self._plants, self._events])},
            sizes_of(first),
            first.robot.n,
            self._varying,
            [FieldName(Signals, "n_hat"), FieldName(Signals, "error")],
        )
        self.translation = translation
        of_plants = translation.constants_of({PlantMemory: self._plants})
        self._of_plants = of_plants.keys() & translation.constants.keys()
        self.text = translation.render("loop.cu.j2", **self._content(translation))

    def _parts(self) -> Parts:
        parts: dict[type[Record], NDArray[Any]] = {
            PlantMemory: self._plants,
            ControllerMemory: self._controllers,
        }
        for law in self._laws.values():
            own = [self._law_of(flight, law.name) for flight in self.flights]
            parts[type(law).gains_type] = np.concatenate([each.gains_block for each in own])
            parts[type(law).memory_type] = np.concatenate([each.memory_block for each in own])
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
            "columns": self._columns,
            "telemetry": self._telemetry,
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
            while plant.next_change < flight.ticks:
                plant.change(int(plant.next_change))
                after.append(plant.block.copy())
        self._events = np.concatenate([*after, self._plants[:1]])

    def _store(self) -> None:
        """Copy the flights' memory to the device, and compile the program."""
        self._program = self._device.compile(self.text)
        count, device, files = len(self.flights), self._device, self.translation.files
        store = device.store
        self._memories = {
            record: store(packed(blocks, files.dtype(record)))
            for record, blocks in self._parts().items()
        }
        self._plant_memory = self._memories[PlantMemory]
        missions = {id(flight.mission): flight.mission for flight in self.flights}
        ticks = self.flights[0].ticks
        references = np.concatenate(
            [
                packed(mission.chunk(0, ticks).references(), files.dtype(Reference))
                for mission in missions.values()
            ]
        )
        places = {key: place for place, key in enumerate(missions)}
        self._whole = {
            "references": store(references),
            "missions": store(np.array([places[id(f.mission)] for f in self.flights])),
            "buffers": store(np.stack([f.plant.command_delay_buffer for f in self.flights])),
            "ticks": store(np.array([flight.plant.tick for flight in self.flights])),
            "until": store(self._next_changes()),
            "has_measured": store(np.ones(count, np.int64)),
            "flies": store(np.ones(count, np.int64)),
            "statuses": store(np.zeros(count, np.int64)),
            "fastest": store(np.zeros(count)),
        }

    def _next_changes(self) -> NDArray[np.int64]:
        ticks = self.flights[0].ticks
        return np.array([int(min(ticks, flight.plant.next_change)) for flight in self.flights])

    # flight

    def _fly_to(self, start: int, stop: int) -> None:
        first, count = self.flights[0], len(self.flights)
        log = self._device.store(np.zeros((stop - start, self._row, count)))
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
            self._program.run("fly", count, self._device.store(self._common(numbers, log)))
            self.seconds += time.monotonic() - begun
            if not self._change(stop):
                break
        self._log = log

    def _common(self, numbers: Mapping[str, int], log: Memory) -> NDArray[Any]:
        pointers = {"plants": self._plant_memory.pointer}
        pointers["controllers"] = self._memories[ControllerMemory].pointer
        for law in self._laws.values():
            pointers[f"{law.name}_gains"] = self._memories[type(law).gains_type].pointer
            pointers[f"{law.name}_memories"] = self._memories[type(law).memory_type].pointer
        order = ("buffers", "references", "missions", "ticks", "until", "has_measured", "flies")
        for name in (*order, "statuses", "fastest"):
            pointers[name] = self._whole[name].pointer
        pointers["log"] = log.pointer
        fields: list[tuple[str, Any]] = [(name, np.int64) for name in numbers]
        fields += [("period", np.float64), *((name, np.uint64) for name in pointers)]
        values = (*numbers.values(), self.flights[0].period, *pointers.values())
        return np.array([values], fields)

    def _change(self, stop: int) -> bool:
        """Let the events happen at which flights wait before ``stop``; return whether any does."""
        ticks, flies = self._whole["ticks"].read(), self._whole["flies"].read()
        until = self._whole["until"].read()
        waiting = np.flatnonzero((flies != 0) & (ticks == until) & (ticks < self.flights[0].ticks))
        if not len(waiting):
            return False
        unpack(self._plant_memory.read(), self._plants)
        has_measured = self._whole["has_measured"].read()
        for k in waiting:
            flight = self.flights[k]
            flight.plant.block[:] = self._plants[k : k + 1]
            flight.plant.change(int(ticks[k]))
            has_measured[k] = 0
            self._plants[k : k + 1] = flight.plant.block
        self._check_constants(self._plants[waiting])
        dtype = self.translation.files.dtype(PlantMemory)
        for k in waiting:
            self._plant_memory.write(packed(self._plants[k : k + 1], dtype), int(k))
        self._whole["until"].write(self._next_changes())
        self._whole["has_measured"].write(has_measured)
        return bool(np.any(ticks[waiting] < stop))

    def _check_constants(self, plants: NDArray[Any]) -> None:
        """Translate anew if an event has changed numbers that the program takes for constant."""
        now = self.translation.constants_of({PlantMemory: plants})
        known = self.translation.constants
        if changed := {field for field in self._of_plants if now.get(field) != known[field]}:
            self._varying |= changed
            self._move_to_new_structs()

    def _move_to_new_structs(self) -> None:
        unpack(self._memories[ControllerMemory].read(), self._controllers)
        self._translate()
        self._program = self._device.compile(self.text)
        for record, blocks in ((PlantMemory, self._plants), (ControllerMemory, self._controllers)):
            dtype = self.translation.files.dtype(record)
            self._memories[record] = self._device.store(packed(blocks, dtype))
        self._plant_memory = self._memories[PlantMemory]

    def _choose_laws(self, tick: int) -> None:
        is_swapped, flies = False, self._whole["flies"].read()
        for k, (flight, choice) in enumerate(zip(self.flights, self._choices, strict=True)):
            change = choice.change_at(tick)
            if change and flies[k]:
                self.logs[k].laws += (change.law,)
            is_swapped |= flight.controller.use(choice.chosen)
        self._engages = is_swapped
        if is_swapped:
            record = type(self.flights[0].controller.law).memory_type
            blocks = np.concatenate([f.controller.law.memory_block for f in self.flights])
            self._memories[record].write(packed(blocks, self.translation.files.dtype(record)))

    # logs

    def _keep_rows(self, start: int, stop: int) -> None:
        if not self._columns:
            return
        numbers = np.ascontiguousarray(self._log.read().transpose(2, 0, 1))
        for log, rows in zip(self.logs, numbers, strict=True):
            for column, place in self._targets(log):
                column[start:stop] = rows[:, place]

    def _targets(self, log: FlightLog) -> Iterator[tuple[Array, slice]]:
        axes = log.axes
        for name, _, width, first, _ in self._columns:
            place, (kind, _, field) = slice(first, first + width), name.partition(".")
            if kind == "truth":
                yield getattr(log, field), place
            elif kind == "measured":
                yield getattr(log.measured, field), place
            elif log.telemetry is not None and kind in ("n_hat", "error"):
                yield log.telemetry[:, 2 if kind == "n_hat" else 3], place
            else:
                yield getattr(log, name), place
        if log.telemetry is not None:
            for k in range(2):
                first = self._telemetry + k * axes
                yield log.telemetry[:, k], slice(first, first + axes)

    def _flown(self, k: int) -> FlownInBatch:
        flight, log = self.flights[k], self.logs[k]
        plant, reached = flight.plant, int(self._ticks[k])
        plant.block[:] = self._plants[k : k + 1]
        plant.state.tick = plant.truth.tick = reached
        if self._flies[k]:
            note_assumed_errors(flight, log, 0, log.ticks)
            return FlownInBatch(k, log, Ending.complete(flight.ticks, flight.period))
        note_assumed_errors(flight, log, 0, reached)
        error = self._error(k, reached)
        log = ended_early(log, measured_ticks(flight.plant, error), reached)
        return FlownInBatch(k, log, Ending.early(error, flight.period))

    def _error(self, k: int, reached: int) -> FlightError:
        plant, status = self.flights[k].plant, int(self._whole["statuses"].read()[k])
        if status != USABLE:
            return unusable(status, reached, plant.state.quaternion)
        return plant.diverged(float(self._whole["fastest"].read()[k]))
