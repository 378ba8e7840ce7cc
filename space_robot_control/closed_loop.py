"""Plant and controller closed in one process, tick by tick, into a log."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any, NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.compiled import function_pointer, kernel
from space_robot_msgs_py.flight_log import FlightLog
from space_robot_sim.plant import RATE_LIMIT, Block, Plant, advance

from .controller import Controller, unusable
from .controller_kernels import USABLE, answer
from .laws import CompiledLaw

Array = NDArray[np.float64]


class Rows(NamedTuple):
    """The columns of a `FlightLog` that a closed loop reads (the reference) and writes."""

    base_position: Array
    quaternion: Array
    base_velocity: Array
    omega_base: Array
    joint_positions: Array
    joint_velocities: Array
    applied_torque: Array
    reference_joints: Array
    reference_base: Array
    commanded_torque: Array
    telemetry: Array

    @classmethod
    def of(cls, log: FlightLog) -> Rows:
        """Of a log with columns for commands and telemetry."""
        return cls(*(getattr(log, name) for name in cls._fields))


def close_loop(plant: Plant, controller: Controller, log: FlightLog, start: int, stop: int) -> None:
    """Fly the ticks ``start`` to ``stop`` of ``log``, whose reference is filled in.

    A law with a kernel flies in compiled code; any other at the speed of Python. Both run the
    same kernels, as the nodes do.

    Raises:
        FlightError: the flight diverged or met a state that no command answers.
    """
    law = controller.law
    if not isinstance(law, CompiledLaw):
        _close_loop_in_python(plant, controller, Rows.of(log), start, stop)
        return
    tick, fastest, found = fly_ticks(
        law_pointer(type(law).kernel), law.gain_matrix, law.memory, law.h_bar, law.uses_model,
        plant.block, plant.late, controller.block, Rows.of(log), start, stop, plant.period,
    )  # fmt: skip
    plant.state.tick = tick
    if found != USABLE:
        raise unusable(found, tick, plant.state.quaternion)
    if not fastest <= RATE_LIMIT:
        raise plant.diverged(fastest)


def _close_loop_in_python(
    plant: Plant, controller: Controller, rows: Rows, start: int, stop: int
) -> None:
    for tick in range(start, stop):
        state = plant.state
        rows.base_position[tick], rows.quaternion[tick] = state.base_position, state.quaternion
        rows.base_velocity[tick], rows.omega_base[tick] = state.base_velocity, state.omega_base
        rows.joint_positions[tick] = state.joint_positions
        rows.joint_velocities[tick] = state.joint_velocities
        rows.applied_torque[tick] = state.applied_torque
        command = controller.update(state, rows.reference_joints[tick], rows.reference_base[tick])
        rows.commanded_torque[tick] = command.torque
        rows.telemetry[tick] = controller.telemetry()
        plant.step(command)


@cache
def law_pointer(law: Callable[..., None]) -> Any:
    """A law's kernel as `fly_ticks` takes it."""
    vector, matrix = numba.float64[::1], numba.float64[:, ::1]
    signature = numba.void(
        vector, vector, vector, vector, matrix, vector, matrix, matrix, numba.float64
    )
    return function_pointer(law, signature)


@kernel
def fly_ticks(
    law: Callable[..., None], gains: Array, law_memory: Array, h_bar: Array, uses_model: bool,
    plant_block: Block, late: Array, controller_block: Block, rows: Rows, start: int, stop: int,
    period: float,
) -> tuple[int, float, int]:  # fmt: skip
    """The loop of `close_loop` for a law given as a function pointer.

    Returns:
        The tick reached, the fastest rate there, and what the controller found its state to be.
    """
    plant, memory = plant_block[0], controller_block[0]
    fastest = 0.0
    for k in range(start, stop):
        rows.base_position[k] = plant.base_position
        rows.quaternion[k] = plant.quaternion
        rows.base_velocity[k] = plant.base_velocity
        rows.omega_base[k] = plant.omega_base
        rows.joint_positions[k] = plant.joint_positions
        rows.joint_velocities[k] = plant.joint_velocities
        rows.applied_torque[k] = plant.applied_torque
        torque = rows.commanded_torque[k]
        found = answer(
            memory, law, gains, law_memory, h_bar, uses_model, k, plant.quaternion,
            plant.omega_base, plant.joint_positions, plant.joint_velocities, plant.applied_torque,
            rows.reference_joints[k], rows.reference_base[k], torque, period,
        )  # fmt: skip
        if found != USABLE:
            return k, fastest, found
        rows.telemetry[k, 0] = law_memory[0]
        rows.telemetry[k, 1] = law_memory[1]
        rows.telemetry[k, 2] = memory.n_hat
        rows.telemetry[k, 3] = memory.error
        fastest = advance(plant, late, torque, k, period)
        if not fastest <= RATE_LIMIT:
            return k + 1, fastest, USABLE
    return stop, fastest, USABLE
