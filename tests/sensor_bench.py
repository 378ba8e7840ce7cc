"""The sensors alone: shown a truth tick by tick, with faults of theirs."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from random_robots import random_quaternion
from random_samples import random_sample

from space_robot_model.hardware.sensors import SensorSettings
from space_robot_msgs_py.compiled.kernels import kernel
from space_robot_msgs_py.compiled.records import Block
from space_robot_msgs_py.samples import RobotNames, RobotState
from space_robot_sim.faults.grammar import parse_faults
from space_robot_sim.faults.schedule import Schedule
from space_robot_sim.plant.faults import PLANT_KINDS
from space_robot_sim.sensors.sensors import FAULTS, Sensors, sense

Array = NDArray[np.float64]

PERIOD = 5e-4
N = 6
NAMES = RobotNames(tuple(f"joint{i}" for i in range(1, N + 1)))


def a_state(tick: int = 0, seed: int = 1) -> RobotState:
    """Some random state."""
    state = random_sample(N, seed, tick)
    state.quaternion[:] = random_quaternion(np.random.default_rng(seed))
    return state


@kernel
def sense_blocks(sensors: Block, truth: Block, tick: int, period: float, measured: Block) -> None:
    """`sense`, five times faster from Python."""
    sense(sensors[0], truth[0], tick, period, measured[0])


class Bench:
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
        self.block[0] = Sensors.build(
            N, SensorSettings.model_validate(settings), period, start.block[0], seed=seed
        )
        self.block["are_ideal"] = False
        self.faults = [(part, fault(schedule)) for part, fault in FAULTS.items() if faults]
        self.period, self.measured = period, RobotState.allocate(N)

    def measure(self, truth: RobotState) -> RobotState:
        """What is told of ``truth``; reused."""
        for part, fault in self.faults:
            fault.apply(truth.tick, getattr(self.block[0], part))
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
