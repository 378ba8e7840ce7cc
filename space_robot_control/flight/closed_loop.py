"""Plant and controller closed in one process, tick by tick, into a log."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any, NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.compiled.kernels import function_pointer, kernel
from space_robot_msgs_py.errors import DivergedError
from space_robot_sim.plant.plant import RATE_LIMIT, Block, Plant, advance

from ..controller.controller import Controller, unusable
from ..controller.kernels import USABLE, answer
from ..laws import CompiledLaw

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
    tick, fastest, found = fly_ticks(
        law_pointer(type(law).kernel), law.gain_matrix, law.memory, law.h_bar, law.uses_model,
        plant.block, plant.command_delay_buffer, controller.block, Rows.of(log), log.first_tick,
        start, stop, plant.period,
    )  # fmt: skip
    plant.state.tick = tick
    if found != USABLE:
        raise unusable(found, tick, plant.state.quaternion)
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
        command = controller.update(plant.state, *log.reference(tick))
        rows.commanded_torque[row] = command.torque
        rows.telemetry[row] = controller.telemetry()
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
    plant_block: Block, command_delay_buffer: Array, controller_block: Block, rows: Rows,
    first_tick: int, start: int, stop: int, period: float,
) -> tuple[int, float, int]:  # fmt: skip
    """The loop of `close_loop` for a law given as a function pointer.

    ``first_tick`` is that of row 0.

    Returns:
        The tick reached, the fastest rate there, and what the controller found its state to be.
    """
    plant, memory = plant_block[0], controller_block[0]
    measured = plant.measured
    fastest = 0.0
    for row in range(start - first_tick, stop - first_tick):
        k = first_tick + row
        rows.base_position[row] = measured.base_position
        rows.quaternion[row] = measured.quaternion
        rows.base_velocity[row] = measured.base_velocity
        rows.omega_base[row] = measured.omega_base
        rows.joint_positions[row] = measured.joint_positions
        rows.joint_velocities[row] = measured.joint_velocities
        rows.applied_torque[row] = measured.applied_torque
        torque = rows.commanded_torque[row]
        found = answer(
            memory, law, gains, law_memory, h_bar, uses_model, k, measured.quaternion,
            measured.omega_base, measured.joint_positions, measured.joint_velocities,
            measured.applied_torque,
            rows.reference_joints[row], rows.reference_base[row], torque, period,
        )  # fmt: skip
        if found != USABLE:
            return k, fastest, found
        rows.telemetry[row, 0] = law_memory[0]
        rows.telemetry[row, 1] = law_memory[1]
        rows.telemetry[row, 2] = memory.n_hat
        rows.telemetry[row, 3] = memory.error
        fastest = advance(plant, command_delay_buffer, torque, k, period)
        if not fastest <= RATE_LIMIT:
            return k + 1, fastest, USABLE
    return stop, fastest, USABLE
