"""A batch: up to eight flights flown tick by tick together."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Generator, Sequence
from typing import NamedTuple

from space_robot_control.controller.controller import unusable
from space_robot_control.controller.law_choice import LawChoice
from space_robot_control.controller.signals import USABLE
from space_robot_msgs_py.bag.flight_log import FlightLog, block_bounds
from space_robot_msgs_py.compiled.records import assign
from space_robot_msgs_py.errors import FlightError
from space_robot_msgs_py.samples import LawInForce

from ..closed_loop import measured_ticks
from ..flown_log import ended_early, note_assumed_errors
from ..plan import Flight
from .lane_log import LogsInLanes
from .lane_loop import fly_lanes, measure_lanes
from .lane_memory import LawInLanes, begin_tick, copy_back, copy_command, memory_of

STRETCH_TICKS = 4000
"""Ticks between two reports of progress."""


class FlownBlock(NamedTuple):
    """Rows that a flight has added to its log."""

    flight: int
    """Its number in the batch."""
    log: FlightLog
    error: FlightError | None
    """What ended the flight in this block; None: it goes on, or is complete."""


class FlightBatch:
    """Flights that fly together, see `batch_key`; plants and controllers are flown on."""

    def __init__(self, flights: Sequence[Flight]) -> None:
        """Put up to eight checked flights into lanes, from where their plants stand.

        Raises:
            InputError: the law has no kernel that can be compiled in lanes.
        """
        self.flights = list(flights)
        first = self.flights[0]
        self._law = LawInLanes([flight.controller.law for flight in flights], first.robot.n)
        self._memory = memory_of(self.flights)
        self._choices = [LawChoice(flight.law, flight.swaps) for flight in flights]
        self._laws: list[tuple[LawInForce, ...]] = [() for _ in flights]

    @property
    def _flying(self) -> list[int]:
        return [k for k in range(len(self.flights)) if self._memory.flies[0, k]]

    def fly(
        self,
        progress: Callable[[int], None] = lambda tick: None,
        is_whole: bool = False,
        is_brief: bool = False,
    ) -> Generator[FlownBlock, None, None]:
        """Fly every tick; yield the blocks of all flights that fly, as `fly_blocks` does.

        ``is_whole``: in one block, for those who need a whole flight as one log. ``is_brief``: see
        `empty_log`.
        """
        first = self.flights[0]
        for start, stop in [(0, first.ticks)] if is_whole else block_bounds(first.ticks):
            flying = self._flying
            if not flying:
                return
            logs = LogsInLanes(self.flights, start, stop, is_brief)
            for k in flying:
                logs.logs[k].laws = self._laws[k]
            self._fly_block(logs, start, stop, progress)
            for k in flying:
                yield self._flown_block(k, logs.logs[k])
        for k in self._flying:
            copy_back(self._memory, self.flights, k)
            self._law.copy_back(k)
        progress(first.ticks)

    def _flown_block(self, k: int, log: FlightLog) -> FlownBlock:
        flight, start, error = self.flights[k], log.first_tick, None
        reached = int(self._memory.tick[0, k]) if not self._memory.flies[0, k] else None
        stop = start + log.ticks if reached is None else reached
        note_assumed_errors(flight, log, start, stop)
        self._laws[k] = log.laws
        if reached is not None:
            error = self._error(k, reached)
            measured = measured_ticks(flight.plant, error)
            log = ended_early(log, measured - start, reached - start)
        return FlownBlock(k, log, error)

    def _error(self, k: int, reached: int) -> FlightError:
        """Return the error that ended a flight, and leave its plant as it was then."""
        plant, memory = self.flights[k].plant, self._memory
        plant.state.tick = plant.truth.tick = reached
        copy_command(memory, self.flights, k)
        status = int(memory.status[0, k])
        if status != USABLE:
            return unusable(status, reached, plant.state.quaternion)
        return plant.diverged(float(memory.fastest[0, k]))

    def _fly_block(
        self, logs: LogsInLanes, first: int, last: int, progress: Callable[[int], None]
    ) -> None:
        swaps = {tick for tick, _ in self.flights[0].swaps if first <= tick < last}
        cuts = {*range(first, last, STRETCH_TICKS), *swaps, last}
        for start, stop in itertools.pairwise(sorted(cuts)):
            progress(start)
            self._choose_laws(logs, start)
            tick = start
            while tick < stop and self._flying:
                plants = [self.flights[k].plant for k in self._flying]
                end = int(min(stop, *(plant.next_change for plant in plants)))
                self._fly_to(logs, tick, end)
                tick = end

    def _fly_to(self, logs: LogsInLanes, start: int, stop: int) -> None:
        """Fly from tick to tick, and begin the last one."""
        first, memory = self.flights[0], self._memory
        end = fly_lanes(
            self._law.code,
            first.controller.allocate,
            memory,
            logs.lanes,
            logs.references,
            start - logs.logs[0].first_tick,
            start,
            stop,
            first.period,
        )
        for k in self._flying:
            begin_tick(self.flights[k].plant, memory.plants, k, end)
        measure_lanes(memory.plants.block, end, first.period)

    def _choose_laws(self, logs: LogsInLanes, tick: int) -> None:
        """Let the laws of a planned swap take over, and log changes."""
        is_swapped = False
        for k, (flight, choice) in enumerate(zip(self.flights, self._choices, strict=True)):
            change = choice.change_at(tick)
            if change and self._memory.flies[0, k]:
                logs.logs[k].laws += (change.law,)
            is_swapped |= flight.controller.use(choice.chosen)
        if not is_swapped:
            return
        laws = [flight.controller.law for flight in self.flights]
        self._law = LawInLanes(laws, self.flights[0].robot.n)
        controllers = self._memory.controllers.block
        controllers["signals"]["n_hat"] = 0.0
        assign(controllers[0], transfer_left=-1.0)
