"""Batches: which flights fly tick by tick together, up to eight, and how they fly."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable, Iterator, Sequence
from functools import cache
from typing import Any, NamedTuple

from numpy.typing import NDArray

from space_robot_control.controller.controller import unusable
from space_robot_control.controller.law_choice import LawChoice
from space_robot_control.controller.signals import USABLE, ControllerMemory
from space_robot_control.laws.base import CompiledLaw
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.compiled.lanes import WIDTH
from space_robot_msgs_py.compiled.records import assign
from space_robot_msgs_py.errors import FlightError, InputError
from space_robot_sim.plant.plant import Plant
from space_robot_sim.plant.tick import PlantMemory

from .ending import Ending
from .flown_log import ended_early, note_assumed_errors
from .lane_loop import fly_lanes, measure_lanes
from .lane_memory import LawInLanes, LogsInLanes, begin_tick, copy_back, copy_command, lane_memory
from .plan import Flight
from .simulate import measured_ticks, simulate


def batch_obstacle(flight: Flight) -> str:
    """Return why a flight cannot be in a batch, in a line; empty if it can."""
    if flight.plant_settings.has_message_faults:
        return "messages between plant and controller have faults"
    if flight.flies_by_messages:
        return "the flight code in C answers"
    for law in (flight.law, *(law for _, law in flight.swaps)):
        kind: Any = type(law)  # classes are hashable
        if why := _law_obstacle(kind):
            return why
    return ""


@cache
def _law_obstacle(law: Any) -> str:
    if not issubclass(law, CompiledLaw):
        return f"law {law.name!r} is plain Python"
    try:
        law.function(WIDTH)
    except InputError as error:
        return f"law {law.name!r} cannot be compiled for eight flights: {error}"
    return ""


def batch_key(flight: Flight) -> Hashable:
    """Return what flights of one batch have in common, of a flight that can be in one."""
    controller = flight.controller
    return (
        plant_key(flight.plant),
        flight.ticks,
        ControllerMemory.uniform_numbers(controller.block),
        flight.controller_settings.telemetry_decimation,
        flight.mission_settings.chunk_ticks,
        (type(controller.law), controller.law.estimate),
        tuple((tick, type(law), law.estimate) for tick, law in flight.swaps),
    )


def plant_key(plant: Plant) -> Hashable:
    """Return what plants that are stepped in lanes have in common."""
    return (
        plant.tick,
        plant.period,
        plant.names,
        plant.command_delay_buffer.shape,
        plant.measures_truth,
        PlantMemory.uniform_numbers(plant.block),
    )


def batches(
    flights: Iterable[tuple[int, Flight]], most: int = WIDTH
) -> Iterator[list[tuple[int, Flight]]]:
    """Yield numbered flights in groups of up to ``most`` that fly together, when one is full.

    A flight that cannot be in a batch, or has no other to share one with, is a group by itself.
    """
    waiting: dict[Hashable, list[tuple[int, Flight]]] = {}
    for number, flight in flights:
        if batch_obstacle(flight):
            yield [(number, flight)]
            continue
        key = batch_key(flight)
        group = waiting.setdefault(key, [])
        group.append((number, flight))
        if len(group) == most:
            yield waiting.pop(key)
    yield from waiting.values()


STRETCH_TICKS = 4000
"""Ticks between two reports of progress."""


class FlownInBatch(NamedTuple):
    """A flight of a batch that is over."""

    flight: int
    """Its number in the batch."""
    log: FlightLog
    ending: Ending


def fly_in_lanes(flights: Sequence[Flight]) -> list[FlownInBatch]:
    """Fly checked flights, those in lanes that can share them; return each, in their order."""
    flown: dict[int, FlownInBatch] = {}
    for group in batches(enumerate(flights)):
        for (number, _), one in zip(group, fly_group([f for _, f in group]), strict=True):
            flown[number] = one._replace(flight=number)
    return [flown[number] for number in range(len(flights))]


def fly_group(flights: Sequence[Flight], is_brief: bool = False) -> list[FlownInBatch]:
    """Fly a group of `batches`: several in lanes, one alone; ``is_brief``: see `empty_log`.

    Raises:
        FlightError: one that flew alone has no log.
    """
    if len(flights) > 1:
        return FlightBatch(flights).fly(is_brief=is_brief)
    (flight,) = flights
    try:
        log, ending = simulate(flight), Ending.complete(flight.ticks, flight.period)
    except FlightError as error:
        if error.log is None:
            raise
        log, ending = error.log, Ending.early(error, flight.period)
    return [FlownInBatch(0, log, ending)]


def choose_laws(
    flights: Sequence[Flight],
    choices: Sequence[LawChoice],
    logs: Sequence[FlightLog],
    flies: NDArray[Any],
    tick: int,
) -> bool:
    """Let the laws chosen for a tick take over; return whether any has.

    The change is noted in the logs of flights that go on, for which ``flies`` (F,) is not 0.
    """
    is_swapped = False
    for k, (flight, choice) in enumerate(zip(flights, choices, strict=True)):
        change = choice.change_at(tick)
        if change and flies[k]:
            logs[k].laws += (change.law,)
        is_swapped |= flight.controller.use(choice.chosen)
    return is_swapped


def flown_whole(number: int, flight: Flight, log: FlightLog) -> FlownInBatch:
    """Return a flight that was flown to its end."""
    note_assumed_errors(flight, log, 0, log.ticks)
    return FlownInBatch(number, log, Ending.complete(flight.ticks, flight.period))


def flown_in_part(
    number: int, flight: Flight, log: FlightLog, status: int, fastest: float
) -> FlownInBatch:
    """Return a flight that ended early, whose plant has the state and tick that it reached.

    ``status`` is that of its last state, ``fastest`` its `fastest_rate`, rad/s.
    """
    plant = flight.plant
    reached = plant.tick
    error: FlightError = (
        plant.diverged(fastest)
        if status == USABLE
        else unusable(status, reached, plant.state.quaternion)
    )
    note_assumed_errors(flight, log, 0, reached)
    log = ended_early(log, measured_ticks(plant, error), reached)
    return FlownInBatch(number, log, Ending.early(error, flight.period))


class FlightBatch:
    """Flights that fly together, see `batch_key`; plants and controllers are flown on."""

    def __init__(self, flights: Sequence[Flight]) -> None:
        """Put up to eight checked flights into lanes, from where their plants stand."""
        self.flights = list(flights)
        first = self.flights[0]
        self._law = LawInLanes([flight.controller.law for flight in flights], first.robot.n)
        self._memory = lane_memory(self.flights)
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
        flight, memory = self.flights[k], self._memory
        if memory.flies[0, k]:
            return flown_whole(k, flight, log)
        flight.plant.state.tick = flight.plant.truth.tick = int(memory.tick[0, k])
        copy_command(memory, self.flights, k)
        return flown_in_part(k, flight, log, int(memory.status[0, k]), float(memory.fastest[0, k]))

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
        if not choose_laws(self.flights, self._choices, logs.logs, self._memory.flies[0], tick):
            return
        laws = [flight.controller.law for flight in self.flights]
        self._law = LawInLanes(laws, self.flights[0].robot.n)
        controllers = self._memory.controllers.block
        controllers["signals"]["n_hat"] = 0.0
        assign(controllers[0], transfer_left=-1.0)
