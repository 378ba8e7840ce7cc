"""Sensors and actuators alone, tick by tick with faults of theirs; sets of actuators."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from random_samples import random_sample
from strategies import random_quaternion

from space_robot_model.elementary.matrices import Array
from space_robot_model.hardware.base_actuators import BaseActuatorSettings
from space_robot_model.hardware.sensors import SensorSettings
from space_robot_model.robot import Robot
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.compiled.kernels import kernel
from space_robot_msgs_py.compiled.records import Block
from space_robot_msgs_py.samples import RobotNames, RobotState, Timebase
from space_robot_sim.actuators.actuators import (
    Actuators,
    ActuatorSettings,
    actuate,
    command_delay_buffer,
)
from space_robot_sim.component import ComponentFaults, Installation
from space_robot_sim.faults.grammar import parse_faults
from space_robot_sim.faults.schedule import Schedule
from space_robot_sim.plant.settings import PLANT_KINDS
from space_robot_sim.sensors.sensors import Sensors, sense

PERIOD = 5e-4
N = 6
NAMES = RobotNames(tuple(f"joint{k}" for k in range(1, N + 1)))


@kernel
def actuate_blocks(
    block: Block,
    ring: Array,
    command: Array,
    tick: int,
    period: float,
    truth: Block,
    measured: Block,
) -> None:
    """`actuate`, five times faster from Python."""
    actuate(block[0], ring, command, tick, period, truth[0], measured[0])


class ActuatorBench:
    """Actuators as a plant has them; the speeds of the wheels are set by hand in ``truth``."""

    def __init__(self, *faults: str, period: float = PERIOD, **settings: Any) -> None:
        self.settings = ActuatorSettings.model_validate(settings)
        names, wheels = self.settings.names, self.settings.wheel_count
        robot = RobotNames(NAMES.joints, names[:wheels], names[wheels:])
        schedule = Schedule(parse_faults(faults, PLANT_KINDS), 0, period, robot)
        self.block = Actuators.block(N)
        self.block[0] = Actuators.build(self.settings, Installation(N, period))
        self.faults = ComponentFaults(schedule, Actuators)
        self.ring = command_delay_buffer(self.record, len(robot.commanded))
        self.truth, self.measured = RobotState.allocate(N), RobotState.allocate(N)
        self.tick, self.period = 0, period

    @property
    def record(self) -> Any:
        return self.block[0]

    def act(self, command: Array) -> tuple[Array, Array]:
        """Torque reported and torque given over a tick."""
        self.faults.apply(self.tick, self.record)
        actuate_blocks(
            self.block,
            self.ring,
            command,
            self.tick,
            self.period,
            self.truth.block,
            self.measured.block,
        )
        self.tick += 1
        return self.measured.applied_torque.copy(), self.truth.applied_torque.copy()

    def ask(self, *asked: float) -> None:
        """Ask the base's hardware for something over a tick, and nothing of the rest."""
        self.act(np.array([*np.zeros(N + 3), *asked]))


def a_state(tick: int = 0, seed: int = 1) -> RobotState:
    """Some random state."""
    state = random_sample(N, seed, tick)
    state.quaternion[:] = random_quaternion(np.random.default_rng(seed))
    return state


@kernel
def sense_blocks(block: Block, truth: Block, tick: int, period: float, measured: Block) -> None:
    """`sense`, five times faster from Python."""
    sense(block[0], truth[0], tick, period, measured[0])


class SensorBench:
    """Sensors as a plant has them."""

    def __init__(
        self,
        *faults: str,
        seed: int = 0,
        period: float = PERIOD,
        truth: RobotState | None = None,
        **settings: Any,
    ) -> None:
        """``truth``: at rest before tick 0."""
        start = a_state() if truth is None else truth
        schedule = Schedule(parse_faults(faults, PLANT_KINDS), seed, period, NAMES)
        self.block = Sensors.block(N)
        at = Installation(N, period, start.block[0], seed=seed)
        self.block[0] = Sensors.build(SensorSettings.model_validate(settings), at)
        self.block["are_ideal"] = False
        self.faults = ComponentFaults(schedule, Sensors)
        self.period, self.measured = period, RobotState.allocate(N)

    def measure(self, truth: RobotState) -> RobotState:
        """What is told of ``truth``; reused."""
        self.faults.apply(truth.tick, self.block[0])
        self.measured.tick = truth.tick
        sense_blocks(self.block, truth.block, truth.tick, self.period, self.measured.block)
        return self.measured

    def watch(self, truth: RobotState, ticks: int, field: str) -> Array:
        """The field's values (ticks, size) if the truth stands still."""
        rows = np.empty((ticks, getattr(truth, field).size))
        for tick in range(ticks):
            truth.tick = tick
            rows[tick] = getattr(self.measure(truth), field)
        return rows


IDEAL = BaseActuatorSettings()
WHEEL_AXES = [1.0, 1.0, 1.0, -1.0, 1.0, 1.0, -1.0, -1.0, 1.0, 1.0, -1.0, 1.0]
"""Axes of four wheels."""


def flat(vectors: ArrayLike) -> list[float]:
    """Vectors as a parameter has them."""
    values: list[float] = np.ravel(vectors).tolist()
    return values


def hardware(**parts: dict[str, Any]) -> BaseActuatorSettings:
    """Wheels, thrusters or both."""
    return BaseActuatorSettings.model_validate({"base_actuation": "hardware", **parts})


THRUSTER_PAIRS = {
    "positions": flat([sign * axis for axis in np.eye(3) for sign in (1, -1, 1, -1)]),
    "directions": flat([sign * np.roll(axis, 1) for axis in np.eye(3) for sign in (1, -1, -1, 1)]),
    "force": [2.0],
}
"""Twelve thrusters, in pairs on levers of 1 m about +z, -z, +x, -x, +y, -y."""


def random_thrusters(rng: np.random.Generator, count: int) -> BaseActuatorSettings:
    """Thrusters anywhere, in pairs that turn the base either way."""
    places, directions = rng.uniform(-2.0, 2.0, (count, 3)), rng.normal(size=(count, 3))
    return hardware(
        thrusters={
            "positions": flat([places, places]),
            "directions": flat([directions, -directions]),
            "force": flat(rng.uniform(1.0, 10.0, 2 * count)),
            "specific_impulse": flat(rng.uniform(100.0, 300.0, 2 * count)),
        }
    )


def still_log(
    robot: Robot, ticks: int, actuators: BaseActuatorSettings = IDEAL, period: float = 0.0005
) -> FlightLog:
    """A flight in which nothing moves and nothing is asked, described as a bag has it."""
    names = actuators.robot_names(robot)._replace(passive=(), geared=(), torquers=())
    log = FlightLog.allocate(ticks, names, Timebase(round(1e9 * period)))
    for column in log.columns.values():
        column[:] = 0.0
    log.quaternion[:, 0] = log.reference_base[:, 0] = 1.0
    log.commanded_torque = np.zeros_like(log.applied_torque)
    log.flight = {"controller": "tde_stc", "case": "1", "robot": robot.name, "actuators": "mine"}
    if actuators.base_actuation != "ideal":
        log.flight["base_actuators"] = actuators.model_dump()
    return log
