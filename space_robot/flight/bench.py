"""A flight step by step, to develop and learn control laws.

    state = bench.reset(seed=1)
    while not bench.done:
        state = bench.step(torque_of(state))

Results are bit-identical to an uninterrupted flight.
"""

from __future__ import annotations

import copy
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from space_robot_control.controller.controller import Controller, ControllerSnapshot
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.compiled.records import Block, RecordOwner
from space_robot_msgs_py.config.arguments import as_numbers, as_whole_number
from space_robot_msgs_py.config.files import Tree
from space_robot_msgs_py.config.validation import short
from space_robot_msgs_py.errors import FlightError, InputError
from space_robot_msgs_py.samples import Command, Reference, RobotState
from space_robot_sim.plant.plant import Plant, PlantSnapshot
from space_robot_sim.plant.settings import PlantSettings

from ..scenario.recorded import differences
from .bench_log import BenchHistory, BenchLog, law_at
from .ending import Ending
from .plan import Flight

LARGEST_SEED = 2**31 - 1
REFERENCE_TICKS = 1000
"""Ticks of the desired motion that are computed at once."""


class Snapshot(NamedTuple):
    """State of a bench at a tick: plant, random numbers, faults, controller, law. Picklable."""

    scenario: Tree
    """Every number of the scenario."""
    plant: PlantSnapshot
    controller: ControllerSnapshot
    answered: int
    """The last tick that the law has answered; -1: none."""
    ending: Ending | None
    history: BenchHistory | None = None
    """Commands of the ticks flown; None: not recorded."""


def check_for_bench(flight: Flight) -> None:
    """Check that a flight needs no graph of nodes and has no faults of messages."""
    flight.check_in_process()
    if flight.flies_by_messages:
        raise InputError(
            "on the bench are no messages that could fail, or that C could answer: fly them"
        )


def seeded(flight: Flight, seed: int, name: str = "seed") -> PlantSettings:
    """Return the settings of a flight's plant with another seed of the random numbers."""
    number = as_whole_number(seed, name, 0, LARGEST_SEED)
    return flight.plant_settings.model_copy(update={"fault_seed": number})


class FlightBench(RecordOwner):
    """Plant flown tick by tick under external torques, or under the flight's law.

    States are views of the memory of one flight, overwritten by every step: `RobotState.copy`
    keeps one. A fresh bench stands at tick 0, with the seed of its flight. A copy, by `copy` or
    `pickle`, flies on to the same bits; `save` and `restore` take a fortieth of its time.
    """

    _views = ("_reference",)

    def __init__(self, flight: Flight, record: bool = False) -> None:
        """Put a flight on the bench; ``record``: keep the commands, for `log`."""
        check_for_bench(flight)
        self.flight, self.ticks, self.period = flight, flight.ticks, flight.period
        # of its own: a law remembers, and another bench may fly the same flight
        self._laws, self._law, self._swaps = copy.deepcopy((flight.laws, flight.law, flight.swaps))
        self.names = flight.plant.names
        """Names of joints and actuators; ``names.commanded`` are those of a command's numbers."""
        self.axes = len(self.names.axes)
        """m = n+3."""
        self._shape = (len(self.names.commanded),)
        self._command = Command(0, np.zeros(self._shape))
        self._records = record
        self._desired: Block = np.empty(0, Reference.dtype(flight.robot.n))
        self._first = 0
        """Tick of the first row of ``_desired``."""
        self._reference_block = Reference.block(flight.robot.n)
        self._bind_views()
        self.reset()

    def _bind_views(self) -> None:
        self._reference = Reference.view(self._reference_block)

    def reset(self, seed: int | None = None) -> RobotState:
        """Begin the flight anew and return the measured state of tick 0.

        ``seed``: of the random numbers of sensors and faults, 0 to 2147483647; None: the flight's.
        """
        flight = self.flight
        settings = flight.plant_settings if seed is None else seeded(flight, seed)
        self._plant = Plant(flight.robot, settings, flight.period)
        self.controller: Controller = flight.build_controller(self._law)
        """The controller, with the law in force; its signals are those of the last answer."""
        self._answered = -1
        self._ending: Ending | None = None
        self._history = BenchHistory(settings.fault_seed) if self._records else None
        self._log: BenchLog | None = None
        self.done = False
        """True once the flight is over; see `outcome`."""
        return self._plant.state

    def step(self, torque: ArrayLike | None = None) -> RobotState:
        """Hold a torque over one tick and return the state measured then.

        Args:
            torque: (m,) N m on base x, y, z (base frame), then the joints; a base of wheels and
                thrusters shares its part out as a controller does. Or (m+A,), with a number for
                each of these A actuators. None: what the flight's law commands.

        Raises:
            InputError: wrong number of values; no law to command; the flight is over.
        """
        if self.done:
            raise InputError(f"the flight is over ({self.outcome}): reset or restore the bench")
        plant = self._plant
        try:
            command = self.command() if torque is None else self._resolve_command(torque)
            if (history := self._history) is not None:
                if self._answered == plant.state.tick:
                    history.add(command.torque, self.controller.telemetry())
                else:
                    history.add(command.torque)
            plant.step(command)
        except FlightError as error:
            self._ending = Ending.early(error, self.period)
        else:
            if plant.state.tick >= self.ticks:
                self._ending = Ending.complete(self.ticks, self.period)
        self.done = self._ending is not None
        return plant.state

    def command(self) -> Command:
        """Return the command of the flight's law at this tick, overwriting ``torque`` (m+A,).

        Asked again it answers the same. It takes over anew after ticks that it has not answered.

        Raises:
            InputError: the flight has no law.
            UnusableStateError: the law has no command for this state.
        """
        controller, state = self.controller, self._plant.state
        tick = state.tick
        if self.flight.scenario.options.controller is None:
            raise InputError("controller is None: give every step a torque")
        if tick != self._answered:
            law = law_at(self._law, self._swaps, tick)
            if law is not controller.law:
                controller.law = law
            elif tick and tick != self._answered + 1:
                controller.engage()
            self._set_reference(tick)
            controller.update(state, self._reference_block)
            self._answered = tick
        return controller.last_command

    def save(self) -> Snapshot:
        """Save the complete state of the flight."""
        history = None if self._history is None else self._history.copy()
        return Snapshot(
            self.flight.scenario.tree,
            self._plant.save(),
            self.controller.save(),
            self._answered,
            self._ending,
            history,
        )

    def restore(self, snapshot: Snapshot) -> RobotState:
        """Restore a snapshot of this scenario; the flight continues bit-identically."""
        if not isinstance(snapshot, Snapshot):
            raise InputError(f"snapshot: what `save` returned was expected, got {short(snapshot)}")
        here, there = self.flight.scenario.tree, snapshot.scenario
        if there is not here and (changes := [*differences(there, here)]):
            path, old, new = changes[0]
            raise InputError(
                f"the snapshot is of another scenario: {path} is {short(old)} there, "
                f"{short(new)} here"
            )
        self._plant.restore(snapshot.plant)
        self.controller.restore(snapshot.controller, self._laws)
        self._answered, self._ending = snapshot.answered, snapshot.ending
        history = snapshot.history if self._records else None
        self._history = None if history is None else history.copy()
        self._log = None
        self.done = self._ending is not None
        return self._plant.state

    def log(self) -> FlightLog:
        """Return the log of all ticks flown since the last `reset`, as that of a whole flight.

        The recorded commands are flown again for it, unless nothing was flown since the last call.
        The log of a law's own steps has its telemetry.
        """
        return self._flown().log

    def _flown(self) -> BenchLog:
        history = self._history
        if history is None:
            why = "was not recorded (record=False), or a snapshot restored that was not"
            raise InputError(f"log: the flight {why}")
        if not len(history) and self._ending is None:
            raise InputError("log: no tick has been flown yet")
        if self._log is None or self._log.log.ticks < len(history):
            flown = BenchLog(self.flight, history, self._ending.error if self._ending else None)
            if flown.flight.plant.block.tobytes() != self._plant.block.tobytes():
                raise InputError(
                    "log: the recorded commands lead to another state: the plant was changed in "
                    "flight"
                )
            self._log = flown
        return self._log

    @property
    def state(self) -> RobotState:
        """The state as the sensors measure it at this tick."""
        return self._plant.state

    @property
    def truth(self) -> RobotState:
        """The true state at this tick."""
        return self._plant.truth

    @property
    def reference(self) -> Reference:
        """The desired motion at this tick; overwritten."""
        self._set_reference(self._plant.state.tick)
        return self._reference

    @property
    def tick(self) -> int:
        """Ticks flown."""
        return self._plant.state.tick

    @property
    def time(self) -> float:
        """Simulated time, s."""
        return self._plant.state.tick * self.period

    @property
    def outcome(self) -> str:
        """``complete``, ``diverged`` or ``unanswered``; empty while the flight goes on."""
        return self._ending.outcome if self._ending else ""

    @property
    def reason(self) -> str:
        """Reason of an early end, in one line; empty otherwise."""
        return self._ending.reason if self._ending else ""

    def __repr__(self) -> str:
        said = self.outcome or "flying"
        return f"<Bench: {self.flight.robot.name}, t = {self.time:.4f} s, {said}>"

    def _resolve_command(self, torque: ArrayLike) -> Command:
        numbers, torques = as_numbers(torque, "torque"), self._command
        if numbers.shape == self._shape:
            torques.torque[:] = numbers
            return torques
        if numbers.shape != (self.axes,):
            counts = " or ".join(str(count) for count in sorted({self.axes, *self._shape}))
            raise InputError(
                f"torque: {counts} numbers were expected, got an array of shape {numbers.shape}"
            )
        return self.controller.allocate_torque(self._plant.state, numbers)

    def _set_reference(self, tick: int) -> None:
        row = tick - self._first
        if not 0 <= row < len(self._desired):
            self._first = tick - tick % REFERENCE_TICKS
            self._desired = self.flight.mission.chunk(self._first, REFERENCE_TICKS).references()
            row = tick - self._first
        self._reference_block[:] = self._desired[row : row + 1]
