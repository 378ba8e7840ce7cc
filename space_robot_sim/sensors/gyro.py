"""Gyro on each base axis: white noise, random-walk bias, scale error, quantisation."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from space_robot_model.elementary.functions import in_steps
from space_robot_model.hardware.gyro import GyroSettings
from space_robot_msgs_py.compiled.kernels import kernel
from space_robot_msgs_py.compiled.records import Record, assign, shaped
from space_robot_msgs_py.samples import State

from ..faults.axes import About
from ..faults.grammar import Argument, Kind
from ..faults.schedule import BLOCK_TICKS, ScheduledFault
from .faults import SIGMA_RAD_PER_S, STEP_RAD_PER_S, Change, SensorFault, add_noise, coarsen
from .noise import row_of

Array = NDArray[np.float64]


class Gyro(Record):
    """Parameters and state of a gyro.

    A period h after the last sample the bias b and the measured rate are (Farrenkopf 1978;
    Crassidis and Junkins, Optimal Estimation of Dynamic Systems)

        b_k = b_k-1 + sigma_u h^1/2 n_u
        measured_k = (1 + e) omega_k + (b_k + b_k-1) / 2 + sigma n_v
        sigma^2 = sigma_v^2 / h + sigma_u^2 h / 12

    with standard normal n_u, n_v. The noise of each sample adds to this sigma in quadrature.
    """

    sigma: Array = shaped(lambda n: (3,))
    """White noise of each sample, rad/s."""
    angle_random_walk: float = shaped(lambda n: ())
    """sigma_v, rad/s^1/2."""
    rate_random_walk: float = shaped(lambda n: ())
    """sigma_u, rad/s^3/2."""
    offset: Array = shaped(lambda n: (3,))
    """Constant bias, rad/s."""
    bias: Array = shaped(lambda n: (3,))
    """Random-walk bias, rad/s: b without the offset."""
    scale: Array = shaped(lambda n: (3,))
    """1 + e."""
    step: Array = shaped(lambda n: (1,))
    """rad/s (0: none)."""
    draws: Array = shaped(lambda n: (BLOCK_TICKS, 6))
    """Standard normal numbers, a row a tick: n_v (3), n_u (3)."""

    @classmethod
    def build(cls, n: int, settings: GyroSettings, period: float, truth: State) -> Gyro:
        """Read the settings."""
        gyro = cls.allocate(n)
        assign(
            gyro,
            sigma=settings.noise,
            angle_random_walk=settings.angle_random_walk,
            rate_random_walk=settings.rate_random_walk,
            offset=settings.initial_bias,
            scale=1.0 + np.array(settings.scale_factor_error),
            step=settings.step,
        )
        return gyro


@kernel
def read_gyro(gyro: Gyro, truth: State, tick: int, period: float, measured: State) -> None:
    """Write the measured rate of the base into ``measured``; the bias walks from tick to tick."""
    draws = gyro.draws[row_of(tick)]
    sigma_v, sigma_u = gyro.angle_random_walk, gyro.rate_random_walk
    white = sigma_v * sigma_v / period + sigma_u * sigma_u * period / 12.0
    walk = sigma_u * np.sqrt(period) if tick > 0 else 0.0
    for i in range(3):
        before = gyro.bias[i]
        gyro.bias[i] = before + walk * draws[3 + i]
        bias = gyro.offset[i] + 0.5 * (gyro.bias[i] + before)
        noise = np.sqrt(white + gyro.sigma[i] * gyro.sigma[i]) * draws[i]
        rate = gyro.scale[i] * truth.omega_base[i] + bias + noise
        measured.omega_base[i] = in_steps(rate, gyro.step[0])


def _add_bias(offset: Array, fault: ScheduledFault) -> None:
    offset[list(fault.axes)] += fault.value


class GyroFault(SensorFault):
    """Faults of the gyro: more noise, coarser steps, or another bias."""

    CHANGES: ClassVar[Mapping[str, Mapping[Kind, Change]]] = {
        "sigma": {
            Kind("noise_gyro", SIGMA_RAD_PER_S, None, "noise on the measured base rate"): add_noise
        },
        "offset": {
            Kind(
                "gyro_bias",
                Argument("RATE", "rad/s", -10.0, 10.0, about=About.BASE_AXIS),
                None,
                "RATE is added to the measured base rate about an axis",
            ): _add_bias
        },
        "step": {
            Kind(
                "quantise_gyro", STEP_RAD_PER_S, None, "the measured base rate is quantised"
            ): coarsen
        },
    }
