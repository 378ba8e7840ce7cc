"""Memory and logs of eight flights in lanes: filled from the flights' own records, copied back."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial

import numpy as np
from numpy.typing import NDArray

from space_robot_control.controller.controller import Controller
from space_robot_control.controller.signals import ControllerMemory
from space_robot_control.laws import ControlLaw
from space_robot_control.laws.base import CompiledLaw, LawCode, LawMemory, SomeGains
from space_robot_model.elementary.matrices import Array
from space_robot_msgs_py.compiled.lanes import WIDTH
from space_robot_msgs_py.compiled.records import Block, Record, prefix
from space_robot_msgs_py.samples import ALL_FIELDS, Reference, ReferenceChunk, State
from space_robot_sim.plant.plant import Plant
from space_robot_sim.plant.tick import PlantMemory

from .flown_log import allocate_columns, empty_log, new_array
from .lane_loop import InLanes, LaneLog, LaneMemory, References, take_out
from .plan import Flight


def record_numbers(block: Block) -> Array:
    """Return a block's numbers: (N, 8) of one in lanes, (k, N) of k records."""
    numbers: Array = block.view(np.float64)
    return numbers.reshape(-1, WIDTH) if len(block) == 1 else numbers.reshape(len(block), -1)


def in_lanes(record: type[Record], n: int) -> InLanes:
    """Return memory for eight records of a robot of ``n`` joints."""
    block, alone = record.lanes(n), np.zeros(WIDTH, record.dtype(n))
    return InLanes(block, record_numbers(block), alone, record_numbers(alone))


def put_in(records: InLanes, lane: int) -> None:
    """Copy the record of a flight by itself into a lane."""
    records.numbers[:, lane] = records.numbers_alone[lane]


def fill(records: InLanes, owners: Sequence[Plant | Controller]) -> None:
    """Put the records of up to eight owners into lanes; their own records are in it from now on.

    A lane without an owner has the numbers of the first.
    """
    for lane, owner in enumerate(owners):
        owner.move_to(records.alone[lane : lane + 1])
    records.numbers_alone[len(owners) :] = records.numbers_alone[0]
    records.numbers[:] = records.numbers_alone.T


def delay_buffers(plants: Sequence[Plant]) -> Array:
    """Return the commands in transit (ticks, m+A, 8) of up to eight plants."""
    buffers = [plant.command_delay_buffer for plant in plants]
    buffers += [buffers[0]] * (WIDTH - len(plants))
    return np.ascontiguousarray(np.stack(buffers, axis=-1))


def begin_tick(plant: Plant, plants: InLanes, lane: int, tick: int) -> None:
    """Begin a tick of a plant in a lane, see `Plant.begin_tick`; its sensors do not measure yet."""
    if tick < plant.next_change:
        plant.state.tick = plant.truth.tick = tick
        return
    take_out(plants, lane)
    plant.change(tick)
    put_in(plants, lane)


def lane_memory(flights: Sequence[Flight]) -> LaneMemory:
    """Return the memory of up to eight flights; a lane without a flight does not fly."""
    n = flights[0].robot.n
    plants, controllers = in_lanes(PlantMemory, n), in_lanes(ControllerMemory, n)
    fill(plants, [flight.plant for flight in flights])
    fill(controllers, [flight.controller for flight in flights])
    reference = Reference.lanes(n)
    torque = np.zeros((len(flights[0].controller.names.commanded), WIDTH))
    flies = np.zeros((1, WIDTH))
    flies[0, : len(flights)] = 1.0
    rates = np.zeros((3, 1, WIDTH))
    return LaneMemory(
        plants,
        controllers,
        plants.block["measured"],
        reference,
        record_numbers(reference),
        delay_buffers([flight.plant for flight in flights]),
        torque,
        flies,
        *rates,
    )


def copy_back(memory: LaneMemory, flights: Sequence[Flight], lane: int) -> None:
    """Copy the memory of a flight that has not ended into its own records."""
    take_out(memory.plants, lane)
    take_out(memory.controllers, lane)
    copy_command(memory, flights, lane)


def copy_command(memory: LaneMemory, flights: Sequence[Flight], lane: int) -> None:
    """Copy the commands of a flight into its plant's and controller's memory."""
    flight = flights[lane]
    flight.plant.command_delay_buffer[:] = memory.command_delay_buffer[..., lane]
    flight.controller.last_command.torque[:] = memory.torque[:, lane]
    flight.controller.last_command.tick = flight.plant.tick - 1


class LawInLanes:
    """Gains and memory of the law in force, of up to eight flights."""

    def __init__(self, laws: Sequence[ControlLaw], n: int) -> None:
        """Copy gains and memory of ``laws`` of one class for a robot of ``n`` joints."""
        first = laws[0]
        assert isinstance(first, CompiledLaw)
        gains, self._memory = first.gains_type.lanes(n), first.memory_type.lanes(n)
        all_laws = [*laws, *[first] * (WIDTH - len(laws))]
        for lane, law in enumerate(all_laws):
            record_numbers(gains)[:, lane] = law.gains_block.view(np.float64)
            record_numbers(self._memory)[:, lane] = law.memory_block.view(np.float64)
        self._laws = laws
        self.code = LawCode(
            first.function(WIDTH),
            prefix(gains, SomeGains.dtype(n, WIDTH)),
            prefix(self._memory, LawMemory.dtype(n, WIDTH)),
            np.ascontiguousarray(np.stack([law.h_bar for law in all_laws], axis=-1)),
            first.estimate,
            first.needs_model,
            first.adds_inertia,
        )
        """The law for `fly_lanes`."""

    def copy_back(self, lane: int) -> None:
        """Copy the memory of one lane into its law."""
        self._laws[lane].memory_block.view(np.float64)[:] = record_numbers(self._memory)[:, lane]


class LogsInLanes:
    """Logs of up to eight flights over the same ticks."""

    def __init__(self, flights: Sequence[Flight], ticks: int, is_brief: bool = False) -> None:
        """Allocate logs of ``ticks`` rows; ``is_brief``: see `empty_log`."""
        columns = _columns(flights[0], ticks, is_brief)
        self.logs = []
        """One of each flight."""
        chunks: dict[int, ReferenceChunk] = {}
        for lane, flight in enumerate(flights):
            mission = flight.mission
            if id(mission) not in chunks:
                chunks[id(mission)] = mission.chunk(0, ticks)
            own = partial(_next, iter([column[lane] for column in columns]))
            self.logs.append(empty_log(flight, 0, ticks, own, chunks[id(mission)], is_brief))
        by_address = {column.ctypes.data: column for column in columns if column.size}
        log = self.logs[0]

        def common(column: Array | None) -> Array:
            if column is None or not column.size:
                return np.empty((WIDTH, 0 if column is None else len(column), 0))
            return by_address[column.ctypes.data]

        measured = {} if log.measured is None else log.measured.columns
        self.lanes = LaneLog(
            tuple(common(getattr(log, name)) for name in ALL_FIELDS),
            tuple(common(measured.get(name)) for name in ALL_FIELDS),
            np.stack([_places(part, flights[0].robot.n) for part in ("truth", "measured")]),
            common(log.commanded_torque),
            common(log.actuator_commands),
            np.empty((WIDTH, 0, 4, 0)) if log.telemetry is None else common(log.telemetry),
        )
        places = list(chunks)
        self.references = References(
            np.stack([_numbers(chunk) for chunk in chunks.values()]),
            np.array([places.index(id(f.mission)) for f in flights] + [0] * WIDTH)[:WIDTH],
        )
        """Desired motion of the flights."""


def _columns(flight: Flight, ticks: int, is_brief: bool) -> list[Array]:
    """Return the columns (8, N, ...) that `empty_log` asks for, in its order.

    They are parts of one array, large enough for the pages of memory that the system has for such,
    or in a file if it is too large for memory.
    """
    shapes: list[tuple[int, ...]] = []

    def asked(shape: tuple[int, ...]) -> Array:
        shapes.append(shape[1:])
        return np.empty(shape)

    allocate_columns(flight, 1, asked, is_brief)
    counts = [WIDTH * ticks * int(np.prod(shape, dtype=int)) for shape in shapes]
    room = new_array(sum(counts), f"{WIDTH} flights of {ticks * flight.period:g} s")
    parts = np.split(room, np.cumsum(counts)[:-1])
    return [part.reshape(WIDTH, ticks, *shape) for part, shape in zip(parts, shapes, strict=True)]


def _places(state: str, n: int) -> NDArray[np.int64]:
    fields, signals = PlantMemory.dtype(n).fields, State.dtype(n).fields
    assert fields is not None
    assert signals is not None
    return np.array([(fields[state][1] + signals[name][1]) // 8 for name in ALL_FIELDS])


def _next(columns: Iterator[Array], shape: tuple[int, ...]) -> Array:
    return next(columns)


def _numbers(chunk: ReferenceChunk) -> Array:
    numbers: Array = chunk.references().view(np.float64)
    return numbers.reshape(len(chunk.joints), -1)
