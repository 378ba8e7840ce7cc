"""A batch: up to eight flights flown tick by tick together."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

from space_robot_control.controller.controller import unusable
from space_robot_control.controller.law_choice import LawChoice
from space_robot_control.controller.signals import USABLE
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.compiled.records import assign
from space_robot_msgs_py.errors import FlightError

from ..closed_loop import measured_ticks
from ..ending import Ending
from ..flown_log import ended_early, note_assumed_errors
from ..plan import Flight
from .lane_log import LogsInLanes
from .lane_loop import fly_lanes, measure_lanes
from .lane_memory import LawInLanes, begin_tick, copy_back, copy_command, memory_of

STRETCH_TICKS = 4000
"""Ticks between two reports of progress."""


class FlownInBatch(NamedTuple):
    """A flight of a batch that is over."""

    flight: int
    """Its number in the batch."""
    log: FlightLog
    ending: Ending


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

    @property
    def _flying(self) -> list[int]:
        return [k for k in range(len(self.flights)) if self._memory.flies[0, k]]

    def fly(
        self, progress: Callable[[int], None] = lambda tick: None, is_brief: bool = False
    ) -> list[FlownInBatch]:
        """Fly every tick; return the flights as they ended. ``is_brief``: see `empty_log`."""
        ticks = self.flights[0].ticks
        logs = LogsInLanes(self.flights, ticks, is_brief)
        self._fly(logs, progress)
        flying = self._flying
        flown = [self._flown(k, log) for k, log in enumerate(logs.logs)]
        for k in flying:
            copy_back(self._memory, self.flights, k)
            self._law.copy_back(k)
        progress(ticks)
        return flown

    def _flown(self, k: int, log: FlightLog) -> FlownInBatch:
        flight = self.flights[k]
        if self._memory.flies[0, k]:
            note_assumed_errors(flight, log, 0, log.ticks)
            return FlownInBatch(k, log, Ending.complete(flight.ticks, flight.period))
        reached = int(self._memory.tick[0, k])
        note_assumed_errors(flight, log, 0, reached)
        error = self._error(k, reached)
        log = ended_early(log, measured_ticks(flight.plant, error), reached)
        return FlownInBatch(k, log, Ending.early(error, flight.period))

    def _error(self, k: int, reached: int) -> FlightError:
        """Return the error that ended a flight, and leave its plant as it was then."""
        plant, memory = self.flights[k].plant, self._memory
        plant.state.tick = plant.truth.tick = reached
        copy_command(memory, self.flights, k)
        status = int(memory.status[0, k])
        if status != USABLE:
            return unusable(status, reached, plant.state.quaternion)
        return plant.diverged(float(memory.fastest[0, k]))

    def _fly(self, logs: LogsInLanes, progress: Callable[[int], None]) -> None:
        for start, stop in self.flights[0].stretches(STRETCH_TICKS):
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
            start,
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
