"""Plant and controller closed in one process, tick by tick, into a log."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.compiled.kernels import kernel
from space_robot_msgs_py.compiled.records import Block
from space_robot_msgs_py.errors import DivergedError
from space_robot_sim.plant.plant import RATE_LIMIT, Plant, advance

from ..controller.controller import Controller, unusable
from ..controller.kernels import USABLE, controller_tick
from ..laws.compiled import CompiledLaw, LawCode

Array = NDArray[np.float64]


class Rows(NamedTuple):
    """The columns of a `FlightLog` that a closed loop writes."""

    base_position: Array
    quaternion: Array
    base_velocity: Array
    omega_base: Array
    joint_positions: Array
    joint_velocities: Array
    applied_torque: Array
    commanded_torque: Array
    telemetry: Array

    @classmethod
    def of(cls, log: FlightLog) -> Rows:
        """Of a log with columns for commands and telemetry."""
        return cls(*(getattr(log, name) for name in cls._fields))


def close_loop(plant: Plant, controller: Controller, log: FlightLog, start: int, stop: int) -> None:
    """Fly the ticks ``start`` to ``stop``, all of them in ``log``, whose reference is filled in.

    A law with a kernel flies in compiled code; any other at the speed of Python. Both run the
    same kernels, as the nodes do.

    Raises:
        FlightError: the flight diverged or met a state that no command answers. What was flown
            up to there is in ``log``, see `measured_ticks`.
    """
    law = controller.law
    if not isinstance(law, CompiledLaw):
        _close_loop_in_python(plant, controller, log, start, stop)
        return
    tick, fastest, status = fly_ticks(
        law.code, plant.block, plant.command_delay_buffer, controller.block, plant.state.block,
        log.references(start, stop), Rows.of(log), start, log.first_tick, plant.period,
    )  # fmt: skip
    plant.state.tick = tick
    if status != USABLE:
        raise unusable(status, tick, plant.state.quaternion)
    if not fastest <= RATE_LIMIT:
        raise plant.diverged(fastest)


def measured_ticks(plant: Plant, error: Exception) -> int:
    """How many states ``plant`` had sent when `close_loop` raised ``error``.

    A state that the law could not answer was sent; one that the plant itself found to be beyond
    all physics was not. `Plant.tick` is how many of them were answered.
    """
    return plant.tick + (not isinstance(error, DivergedError))


def _close_loop_in_python(
    plant: Plant, controller: Controller, log: FlightLog, start: int, stop: int
) -> None:
    rows = Rows.of(log)
    for tick in range(start, stop):
        row = tick - log.first_tick
        log.put(plant.state)
        command = controller.update(plant.state, log.references(tick, tick + 1))
        rows.commanded_torque[row] = command.torque
        rows.telemetry[row] = controller.telemetry()
        plant.step(command)


@kernel
def fly_ticks(
    law: LawCode, plant_block: Block, command_delay_buffer: Array, controller_block: Block,
    state: Block, references: Block, rows: Rows, start: int, first_tick: int, period: float,
) -> tuple[int, float, int]:  # fmt: skip
    """The loop of `close_loop` from the tick ``start`` on, a tick for each reference.

    ``state`` is the plant's, ``first_tick`` the tick of row 0.

    Returns:
        The tick reached, the fastest rate there, and the status of its state.
    """
    plant, measured, fastest = plant_block[0], state[0], 0.0
    for k in range(references.size):
        tick = start + k
        row = tick - first_tick
        rows.base_position[row] = measured.base_position
        rows.quaternion[row] = measured.quaternion
        rows.base_velocity[row] = measured.base_velocity
        rows.omega_base[row] = measured.omega_base
        rows.joint_positions[row] = measured.joint_positions
        rows.joint_velocities[row] = measured.joint_velocities
        rows.applied_torque[row] = measured.applied_torque
        torque, telemetry = rows.commanded_torque[row], rows.telemetry[row]
        status = controller_tick(
            controller_block, law, tick, state, references[k : k + 1], torque, period
        )
        if status != USABLE:
            return tick, fastest, status
        signals = controller_block[0].signals
        telemetry[0], telemetry[1] = law.memory[0].s, law.memory[0].u
        telemetry[2], telemetry[3] = signals.n_hat, signals.error
        fastest = advance(plant, command_delay_buffer, torque, tick, period)
        if not fastest <= RATE_LIMIT:
            return tick + 1, fastest, USABLE
    return start + references.size, fastest, USABLE
