"""Joint encoders: angle in whole steps, rate measured or differenced.

The angle of a prismatic joint is its position, in m in place of rad.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from space_robot_model.elementary.functions import in_steps
from space_robot_model.hardware.sensors import MOST_DIFFERENCED, EncoderSettings
from space_robot_msgs_py.compiled.kernels import kernel
from space_robot_msgs_py.compiled.lanes import where, whole
from space_robot_msgs_py.compiled.records import shaped
from space_robot_msgs_py.samples import State

from ..component import Component, Installation
from ..faults.grammar import About, Argument, Kind, add_noise, switch_on
from ..faults.schedule import BLOCK_TICKS

Array = NDArray[np.float64]

SIGMA, RATE_SIGMA = (Argument("SIGMA", unit, 0.0, 1e3) for unit in ("rad", "rad/s"))
STEP, RATE_STEP = (Argument("STEP", unit, 1e-12, 1e3) for unit in ("rad", "rad/s"))


def _steps(sheet: EncoderSettings, at: Installation) -> Array:
    """Return the distance of two angles of each joint (n,), rad or m (0: continuous)."""
    slides = np.zeros(at.n, np.bool_)
    slides[: len(at.is_prismatic)] = at.is_prismatic
    return np.where(slides, sheet.step(1.0), sheet.step(2.0 * np.pi))


def _at_rest(sheet: EncoderSettings, at: Installation) -> Array:
    """Return the angles measured before tick 0 (MOST_DIFFERENCED, n)."""
    angles, steps = at.truth.joint_positions, _steps(sheet, at)
    measured = steps * np.floor(angles / steps + 0.5) if sheet.bits else angles
    return np.broadcast_to(measured, (MOST_DIFFERENCED, at.n))


class Encoders(Component):
    """Parameters of a robot's encoders, and their measured angles.

    The measured angle is ``step round((theta + sigma n) / step)``; a rate differenced over N ticks
    is the difference of two measured angles N ticks apart, divided by N periods.
    """

    sigma: Array = shaped(lambda n: (n,), source="noise")
    """White noise of each angle, rad."""
    step: Array = shaped(lambda n: (n,), source=_steps)
    """Distance of two angles, rad (0: none)."""
    difference_ticks: float = shaped(lambda n: (), uniform=True, source="difference_ticks")
    """N; 0: rates are measured."""
    velocity_sigma: Array = shaped(lambda n: (n,), source="velocity_noise")
    """White noise of each rate, rad/s."""
    velocity_step: Array = shaped(lambda n: (n,), source="velocity_step")
    """Distance of two rates, rad/s (0: none)."""
    motor: Array = shaped(lambda n: (n,), uniform=True, source=lambda s, at: at.motors)
    """Number from 1 of the motor that a joint's encoder measures; 0: it measures the link."""
    stuck: Array = shaped(lambda n: (n,))
    """1 for each joint with a stuck encoder."""
    draws: Array = shaped(lambda n: (BLOCK_TICKS, 2, n))
    """Standard normal numbers, a row a tick: of the angles, of the rates."""
    history: Array = shaped(lambda n: (MOST_DIFFERENCED, n), source=_at_rest)
    """The last measured angles, by tick modulo `MOST_DIFFERENCED`, rad."""

    FAULTS: ClassVar[tuple[Kind, ...]] = (
        Kind(
            "noise_joint_position", SIGMA, "noise on the measured joint angles", "sigma", add_noise
        ),
        Kind(
            "noise_joint_velocity",
            RATE_SIGMA,
            "noise on the measured joint velocities",
            "velocity_sigma",
            add_noise,
        ),
        Kind(
            "encoder_stuck",
            Argument(about=About.JOINT),
            "the measured joint angle is constant, its rate is zero",
            "stuck",
            switch_on,
        ),
        Kind(
            "quantise_joint_position",
            STEP,
            "the measured joint angles are quantised",
            "step",
            np.maximum,
        ),
        Kind(
            "quantise_joint_velocity",
            RATE_STEP,
            "the measured joint velocities are quantised",
            "velocity_step",
            np.maximum,
        ),
    )


@kernel
def read_encoders(
    encoders: Encoders, truth: State, tick: int, period: float, measured: State
) -> None:
    """Write the measured angles and rates of all joints into ``measured``.

    A stuck encoder reports the angle of the tick before, and rate zero.
    """
    draws, lag = encoders.draws[tick % BLOCK_TICKS], whole(encoders.difference_ticks)
    before = encoders.history[(tick - 1) % MOST_DIFFERENCED]
    then = encoders.history[(tick - lag) % MOST_DIFFERENCED]
    now = encoders.history[tick % MOST_DIFFERENCED]
    for i in range(now.size):
        true_angle, true_rate = truth.joint_positions[i], truth.joint_velocities[i]
        motor = whole(encoders.motor[i])
        if motor > 0:  # seen through the gear: angle and rate are in the link's units
            true_angle = truth.motor_positions[motor - 1]
            true_rate = truth.motor_velocities[motor - 1]
        angle = true_angle + encoders.sigma[i] * draws[0, i]
        angle = in_steps(angle, encoders.step[i])
        # of the quantised angle, so that a differenced rate comes in whole steps, too
        rate = (angle - then[i]) / (lag * period) if lag > 0 else true_rate
        rate = in_steps(rate + encoders.velocity_sigma[i] * draws[1, i], encoders.velocity_step[i])
        is_stuck = encoders.stuck[i] == 1.0
        angle, rate = where(is_stuck, before[i], angle), where(is_stuck, 0.0, rate)
        now[i] = angle
        measured.joint_positions[i] = angle
        measured.joint_velocities[i] = rate


@kernel
def read_motors(encoders: Encoders, truth: State, measured: State) -> None:
    """Write angles and rates of the motors for joints whose encoders are on the motor's side."""
    for i in range(measured.joint_positions.size):
        motor = whole(encoders.motor[i])
        if motor > 0:
            measured.joint_positions[i] = truth.motor_positions[motor - 1]
            measured.joint_velocities[i] = truth.motor_velocities[motor - 1]
