"""Joint encoders: angle in whole steps, rate measured or differenced.

The angle of a prismatic joint is its position; m stands in the place of rad there.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from space_robot_model.elementary.functions import in_steps
from space_robot_model.hardware.encoders import MOST_DIFFERENCED, EncoderSettings
from space_robot_msgs_py.compiled.kernels import kernel
from space_robot_msgs_py.compiled.lanes import where, whole
from space_robot_msgs_py.compiled.records import Record, assign, shaped
from space_robot_msgs_py.samples import State
from space_robot_msgs_py.topics import BASE_AXES

from ..faults.axes import About
from ..faults.grammar import Argument, Kind
from ..faults.schedule import BLOCK_TICKS, ScheduledFault
from .faults import (
    SIGMA_RAD,
    SIGMA_RAD_PER_S,
    STEP_RAD,
    STEP_RAD_PER_S,
    Change,
    SensorFault,
    add_noise,
    coarsen,
)
from .noise import row_of

Array = NDArray[np.float64]


class Encoders(Record):
    """Parameters of a robot's encoders, and their measured angles.

    The measured angle is ``step round((theta + sigma n) / step)``; a rate differenced over N ticks
    is the difference of two measured angles N ticks apart, divided by N periods.
    """

    sigma: Array = shaped(lambda n: (n,))
    """White noise of each angle, rad."""
    step: Array = shaped(lambda n: (n,))
    """Distance of two angles, rad (0: none)."""
    difference_ticks: float = shaped(lambda n: (), uniform=True)
    """N; 0: rates are measured."""
    velocity_sigma: Array = shaped(lambda n: (n,))
    """White noise of each rate, rad/s."""
    velocity_step: Array = shaped(lambda n: (n,))
    """Distance of two rates, rad/s (0: none)."""
    motor: Array = shaped(lambda n: (n,), uniform=True)
    """Number from 1 of the motor that a joint's encoder measures; 0: it measures the link."""
    stuck: Array = shaped(lambda n: (n,))
    """1 for each joint with a stuck encoder."""
    draws: Array = shaped(lambda n: (BLOCK_TICKS, 2, n))
    """Standard normal numbers, a row a tick: of the angles, of the rates."""
    history: Array = shaped(lambda n: (MOST_DIFFERENCED, n))
    """The last measured angles, by tick modulo `MOST_DIFFERENCED`, rad."""

    @classmethod
    def build(
        cls,
        n: int,
        settings: EncoderSettings,
        period: float,
        truth: State,
        is_prismatic: Sequence[bool] | NDArray[np.bool_] = (),
        motors: Sequence[int] = (),
    ) -> Encoders:
        """Read the settings; before tick 0 the robot was at rest at ``truth``.

        ``is_prismatic`` (n,): which joints slide (empty: none); ``motors`` (n,): see ``motor``
        (empty: all are 0).
        """
        encoders = cls.allocate(n)
        whole = np.full(n, 2.0 * np.pi)
        whole[: len(is_prismatic)][np.asarray(is_prismatic, np.bool_)] = 1.0
        step = whole / 2.0**settings.bits if settings.bits else np.zeros(n)
        at_rest = truth.joint_positions
        assign(
            encoders,
            sigma=settings.noise,
            step=step,
            difference_ticks=settings.difference_ticks,
            velocity_sigma=settings.velocity_noise,
            velocity_step=settings.velocity_step,
            motor=motors if len(motors) else np.zeros(n),
            history=step * np.floor(at_rest / step + 0.5) if settings.bits else at_rest,
        )
        return encoders


@kernel
def read_encoders(
    encoders: Encoders, truth: State, tick: int, period: float, measured: State
) -> None:
    """Write the measured angles and rates of all joints into ``measured``.

    A stuck encoder reports the angle of the tick before, and rate zero.
    """
    draws, lag = encoders.draws[row_of(tick)], whole(encoders.difference_ticks)
    before = encoders.history[(tick - 1) % MOST_DIFFERENCED]
    then = encoders.history[(tick - lag) % MOST_DIFFERENCED]
    now = encoders.history[tick % MOST_DIFFERENCED]
    for i in range(now.size):
        true_angle, true_rate = truth.joint_positions[i], truth.joint_velocities[i]
        motor = whole(encoders.motor[i])
        if motor > 0:
            true_angle = truth.motor_positions[motor - 1]
            true_rate = truth.motor_velocities[motor - 1]
        angle = true_angle + encoders.sigma[i] * draws[0, i]
        angle = in_steps(angle, encoders.step[i])
        rate = (angle - then[i]) / (lag * period) if lag > 0 else true_rate
        rate = in_steps(rate + encoders.velocity_sigma[i] * draws[1, i], encoders.velocity_step[i])
        is_stuck = encoders.stuck[i] == 1.0
        angle, rate = where(is_stuck, before[i], angle), where(is_stuck, 0.0, rate)
        now[i] = angle
        measured.joint_positions[i] = angle
        measured.joint_velocities[i] = rate


@kernel
def see_motors(encoders: Encoders, truth: State, measured: State) -> None:
    """Write angles and rates of the motors for joints whose encoders are on the motor's side."""
    for i in range(measured.joint_positions.size):
        motor = whole(encoders.motor[i])
        if motor > 0:
            measured.joint_positions[i] = truth.motor_positions[motor - 1]
            measured.joint_velocities[i] = truth.motor_velocities[motor - 1]


def _hold(stuck: Array, fault: ScheduledFault) -> None:
    stuck[[axis - len(BASE_AXES) for axis in fault.axes]] = 1.0


class EncoderFault(SensorFault):
    """Faults of encoders: more noise, coarser steps, or stuck."""

    CHANGES: ClassVar[Mapping[str, Mapping[Kind, Change]]] = {
        "sigma": {
            Kind(
                "noise_joint_position", SIGMA_RAD, None, "noise on the measured joint angles"
            ): add_noise
        },
        "velocity_sigma": {
            Kind(
                "noise_joint_velocity",
                SIGMA_RAD_PER_S,
                None,
                "noise on the measured joint velocities",
            ): add_noise
        },
        "stuck": {
            Kind(
                "encoder_stuck",
                Argument("", "", 0.0, 0.0, about=About.JOINT),
                None,
                "the measured joint angle is constant, its rate is zero",
            ): _hold
        },
        "step": {
            Kind(
                "quantise_joint_position", STEP_RAD, None, "the measured joint angles are quantised"
            ): coarsen
        },
        "velocity_step": {
            Kind(
                "quantise_joint_velocity",
                STEP_RAD_PER_S,
                None,
                "the measured joint velocities are quantised",
            ): coarsen
        },
    }
