"""The actuators alone: asked tick by tick, with faults of theirs."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.compiled.kernels import kernel
from space_robot_msgs_py.compiled.records import Block
from space_robot_msgs_py.samples import RobotNames, RobotState
from space_robot_sim.actuators.actuators import (
    FAULTS,
    Actuators,
    ActuatorSettings,
    actuate,
    command_delay_buffer,
)
from space_robot_sim.faults.grammar import parse_faults
from space_robot_sim.faults.schedule import Schedule
from space_robot_sim.plant.faults import PLANT_KINDS

Array = NDArray[np.float64]

PERIOD = 5e-4
N = 6
NAMES = RobotNames(tuple(f"joint{k}" for k in range(1, N + 1)))


@kernel
def actuate_blocks(
    actuators: Block,
    ring: Array,
    command: Array,
    tick: int,
    period: float,
    truth: Block,
    measured: Block,
) -> None:
    """`actuate`, five times faster from Python."""
    actuate(actuators[0], ring, command, tick, period, truth[0], measured[0])


class Bench:
    """Actuators as a plant has them; the speeds of the wheels are set by hand in ``truth``."""

    def __init__(self, *faults: str, period: float = PERIOD, **settings: Any) -> None:
        self.settings = ActuatorSettings.model_validate(settings)
        names = RobotNames.of(NAMES.joints, self.settings.names, self.settings.wheel_count)
        schedule = Schedule(parse_faults(faults, PLANT_KINDS), 0, period, names)
        self.block = Actuators.block(N)
        self.block[0] = Actuators.build(N, self.settings, period)
        self.faults = [(part, fault(schedule)) for part, fault in FAULTS.items() if faults]
        self.ring = command_delay_buffer(self.record, len(names.commanded))
        self.truth, self.measured = RobotState.allocate(N), RobotState.allocate(N)
        self.tick, self.period = 0, period

    @property
    def record(self) -> Any:
        return self.block[0]

    def act(self, command: Array) -> tuple[Array, Array]:
        """Torque reported and torque given over a tick."""
        for part, fault in self.faults:
            fault.apply(self.tick, getattr(self.record, part))
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

    def ask(self, *actuators: float) -> None:
        """Ask the base's hardware for something over a tick, and nothing of the rest."""
        self.act(np.array([*np.zeros(N + 3), *actuators]))
