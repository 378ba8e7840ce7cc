"""Benches: many flights tick by tick under torques from outside, eight of them in lanes.

    states = benches.reset(seed=1)
    while not benches.done.all():
        states = benches.step(torques_of(states))

Each flight has the bits of its `space_robot.flight.bench.FlightBench`.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from space_robot_model.elementary.matrices import Array
from space_robot_msgs_py.compiled.lanes import WIDTH
from space_robot_msgs_py.compiled.records import Block
from space_robot_msgs_py.config.arguments import as_numbers, as_whole_number
from space_robot_msgs_py.errors import InputError
from space_robot_msgs_py.samples import RobotState, State
from space_robot_sim.plant.plant import Plant
from space_robot_sim.plant.settings import PlantSettings
from space_robot_sim.plant.tick import PlantMemory

from .batch import plant_key
from .bench import LARGEST_SEED, check_for_bench, seeded
from .ending import Ending
from .lane_loop import InLanes, fly_benches, measure_lanes
from .lane_memory import begin_tick, delay_buffers, fill
from .plan import Flight


class Benches:
    """Plants of many flights of robots with n joints, stepped together."""

    def __init__(self, flights: Sequence[Flight]) -> None:
        """Put flights on benches: of robots with the same number of joints and actuators."""
        if not flights:
            raise InputError("at least one flight is needed")
        for number, flight in enumerate(flights):
            try:
                check_for_bench(flight)
                names, expected = flight.plant.names, flights[0].plant.names
                if len(names.joints) != len(expected.joints) or (
                    names.actuators != expected.actuators
                ):
                    raise InputError(
                        f"{len(names.joints)} joints and actuators {list(names.actuators)}; the "
                        f"first flight has {len(expected.joints)} and {list(expected.actuators)}"
                    )
            except InputError as error:
                raise InputError(f"flight {number}: {error}") from None
        self.flights = list(flights)
        count, n = len(flights), flights[0].robot.n
        self.names = flights[0].plant.names
        """Names of joints and actuators of the first; ``names.commanded`` has those of a command's
        numbers."""
        self.states: Block = np.zeros(count, State.dtype(n))
        """(K,) `State` of each flight as its sensors measure it: ``states["quaternion"]`` is (K, 4)
        and so on. Overwritten by each step."""
        self.truths: Block = np.zeros(count, State.dtype(n))
        """(K,) true `State` of each flight."""
        self.ticks: NDArray[np.int64] = np.zeros(count, np.int64)
        """(K,) ticks flown."""
        self.done: NDArray[np.bool_] = np.zeros(count, np.bool_)
        """(K,) True for a flight that is over; it then stands still."""
        self.endings: list[Ending | None] = []
        """Of each flight; None while it goes on."""
        self.reset()

    def reset(self, seed: int | Sequence[int] | None = None) -> Block:
        """Begin all flights anew and return the measured states of tick 0.

        ``seed``: of the random numbers of the first flight, the next ones have the numbers after
        it; or one for each; 0 to 2147483647. None: the flights' own.
        """
        plants = [
            Plant(flight.robot, settings, flight.period)
            for flight, settings in zip(self.flights, self._settings(seed), strict=True)
        ]
        sets: dict[object, list[int]] = {}
        for k, plant in enumerate(plants):
            sets.setdefault((self.flights[k].ticks, plant_key(plant)), []).append(k)
        self.ticks[:], self.done[:] = 0, False
        self.endings = [None for _ in plants]
        self._sets = [_BenchSet(self, np.array(numbers), plants) for numbers in sets.values()]
        return self.states

    def step(self, torques: ArrayLike) -> Block:
        """Hold a torque of each flight over a tick and return the states measured then.

        Args:
            torques: (K, m) N m on base x, y, z (base frame), then the joints; wheels and thrusters
                share the base's part out as under a controller. Or (K, m+A), with a number for
                each of the A actuators.

        Raises:
            InputError: the shape is wrong, or all flights are over.
        """
        if self.done.all():
            raise InputError("all flights are over: reset the benches")
        commands = self._commands(as_numbers(torques, "torques"))
        for flights in self._sets:
            flights.step(commands)
        return self.states

    def _settings(self, seed: int | Sequence[int] | None) -> list[PlantSettings]:
        if seed is None:
            return [flight.plant_settings for flight in self.flights]
        count = len(self.flights)
        if isinstance(seed, Sequence) and not isinstance(seed, str):
            if len(seed) != count:
                raise InputError(f"seed: {count} numbers were expected, got {len(seed)}")
            return [
                seeded(flight, one, f"seed[{k}]")
                for k, (flight, one) in enumerate(zip(self.flights, seed, strict=True))
            ]
        first = as_whole_number(seed, "seed", 0, LARGEST_SEED - count + 1)
        return [seeded(flight, first + k) for k, flight in enumerate(self.flights)]

    def _commands(self, torques: Array) -> Array:
        count, axes, commanded = len(self.flights), len(self.names.axes), len(self.names.commanded)
        if torques.shape == (count, commanded):
            return torques
        if torques.shape != (count, axes):
            shapes = " or ".join(str((count, size)) for size in sorted({axes, commanded}))
            raise InputError(
                f"torques: an array of shape {shapes} was expected, got one of {torques.shape}"
            )
        commands = np.zeros((count, commanded))
        for k in np.flatnonzero(~self.done):
            state = RobotState(int(self.ticks[k]), self.states[k : k + 1])
            controller = self.flights[k].controller
            commands[k] = controller.allocate_torque(state, torques[k]).torque
        return commands


class _BenchSet:
    def __init__(self, benches: Benches, numbers: NDArray[np.int64], plants: list[Plant]) -> None:
        self._benches, self._numbers = benches, numbers
        self._plants = [plants[k] for k in numbers]
        first = benches.flights[numbers[0]]
        self._ticks, self._period, self._tick = first.ticks, first.period, 0
        count, n = -(-len(numbers) // WIDTH), len(benches.names.joints)
        self._blocks: Block = np.zeros(count, PlantMemory.dtype(n, WIDTH))
        self._alone: Block = np.zeros(count * WIDTH, PlantMemory.dtype(n))
        lanes = self._blocks.view(np.float64).reshape(count, -1, WIDTH)
        alone = self._alone.view(np.float64).reshape(count * WIDTH, -1)
        self._memory, buffers = [], []
        for k in range(count):
            eight = slice(WIDTH * k, WIDTH * (k + 1))
            records = InLanes(self._blocks[k : k + 1], lanes[k], self._alone[eight], alone[eight])
            fill(records, self._plants[eight])
            self._memory.append(records)
            buffers.append(delay_buffers(self._plants[eight]))
        self._buffers = np.stack(buffers)
        self._torques = np.zeros((count * WIDTH, len(benches.names.commanded)))
        self._flies, self._fastest = np.zeros((2, count * WIDTH))
        self._flies[: len(numbers)] = 1.0
        self._next_change = np.array([plant.next_change for plant in self._plants])
        size = State.dtype(n).itemsize // 8
        fields: Any = self._blocks.dtype.fields
        self._shown = [
            (states.view(np.float64).reshape(-1, size), lanes[:, place : place + size])
            for states, name in ((benches.states, "measured"), (benches.truths, "truth"))
            for place in (fields[name][1] // (8 * WIDTH),)
        ]
        """Rows of numbers of the measured and of the true states, and the same in lanes."""
        everyone = np.arange(len(numbers))
        self._show(everyone, everyone)

    def step(self, commands: Array) -> None:
        if not self._flies.any():
            return
        count, tick = len(self._numbers), self._tick + 1
        flew = np.flatnonzero(self._flies)
        self._torques[:count] = commands[self._numbers]
        changing = np.flatnonzero(self._next_change <= tick)
        fly_benches(
            self._blocks,
            self._alone,
            self._buffers,
            self._torques,
            self._tick,
            self._period,
            self._flies,
            self._fastest,
            not len(changing),
        )
        self._tick, measured = tick, flew
        if len(changing):
            for k in changing:
                if self._flies[k]:
                    eight, lane = divmod(int(k), WIDTH)
                    begin_tick(self._plants[k], self._memory[eight], lane, tick)
                    self._next_change[k] = self._plants[k].next_change
            measure_lanes(self._blocks, tick, self._period)
            measured = np.flatnonzero(self._flies)
        self._benches.ticks[self._numbers[flew]] = tick
        for k in flew[self._flies[flew] == 0.0]:
            self._plants[k].state.tick = self._plants[k].truth.tick = tick
            error = self._plants[k].diverged(float(self._fastest[k]))
            self._end(int(k), Ending.early(error, self._period))
        if tick == self._ticks:
            for k in np.flatnonzero(self._flies):
                self._end(int(k), Ending.complete(self._ticks, self._period))
        self._show(measured, flew)

    def _show(self, measured: NDArray[np.int64], flew: NDArray[np.int64]) -> None:
        for (rows, lanes), flights in zip(self._shown, (measured, flew), strict=True):
            groups, within = np.divmod(flights, WIDTH)
            rows[self._numbers[flights]] = lanes[groups, :, within]

    def _end(self, k: int, ending: Ending) -> None:
        self._flies[k], self._next_change[k] = 0.0, np.inf
        self._benches.done[self._numbers[k]] = True
        self._benches.endings[self._numbers[k]] = ending
