"""Gyro on each base axis: white noise, random-walk bias, scale error, quantisation."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from space_robot_model.elementary.functions import in_steps
from space_robot_msgs_py.compiled.kernels import kernel
from space_robot_msgs_py.compiled.records import shaped
from space_robot_msgs_py.samples import State

from ..component import Component
from ..faults.grammar import About, Argument, Kind, add_noise
from ..faults.schedule import BLOCK_TICKS

Array = NDArray[np.float64]

SIGMA = Argument("SIGMA", "rad/s", 0.0, 1e3)
STEP = Argument("STEP", "rad/s", 1e-12, 1e3)
BIAS = Argument("RATE", "rad/s", -10.0, 10.0, About.BASE_AXIS)


class Gyro(Component):
    """Parameters and state of a gyro.

    A period h after the last sample the bias b and the measured rate are (Farrenkopf 1978;
    Crassidis and Junkins, Optimal Estimation of Dynamic Systems)

        b_k = b_k-1 + sigma_u h^1/2 n_u
        measured_k = (1 + e) omega_k + (b_k + b_k-1) / 2 + sigma n_v
        sigma^2 = sigma_v^2 / h + sigma_u^2 h / 12

    with standard normal n_u, n_v. The noise of each sample adds to this sigma in quadrature.
    """

    sigma: Array = shaped(lambda n: (3,), source="noise")
    """White noise of each sample, rad/s."""
    angle_random_walk: float = shaped(lambda n: (), source="angle_random_walk")
    """sigma_v, rad/s^1/2."""
    rate_random_walk: float = shaped(lambda n: (), source="rate_random_walk")
    """sigma_u, rad/s^3/2."""
    offset: Array = shaped(lambda n: (3,), source="initial_bias")
    """Constant bias, rad/s."""
    bias: Array = shaped(lambda n: (3,))
    """Random-walk bias, rad/s: b without the offset."""
    scale: Array = shaped(lambda n: (3,), source=lambda s, at: 1.0 + np.array(s.scale_factor_error))
    """1 + e."""
    step: Array = shaped(lambda n: (1,), source="step")
    """rad/s (0: none)."""
    draws: Array = shaped(lambda n: (BLOCK_TICKS, 6))
    """Standard normal numbers, a row a tick: n_v (3), n_u (3)."""

    FAULTS: ClassVar[tuple[Kind, ...]] = (
        Kind("noise_gyro", SIGMA, "noise on the measured base rate", "sigma", add_noise),
        Kind("gyro_bias", BIAS, "RATE is added to the measured base rate about an axis", "offset"),
        Kind("quantise_gyro", STEP, "the measured base rate is quantised", "step", np.maximum),
    )


@kernel
def read_gyro(gyro: Gyro, truth: State, tick: int, period: float, measured: State) -> None:
    """Write the measured rate of the base into ``measured``; the bias walks from tick to tick."""
    draws = gyro.draws[tick % BLOCK_TICKS]
    sigma_v, sigma_u = gyro.angle_random_walk, gyro.rate_random_walk
    # of the mean rate over a period: white noise, and the bias that walks within it
    white = sigma_v * sigma_v / period + sigma_u * sigma_u * period / 12.0
    # no sample before tick 0 from which the bias could have walked
    walk = sigma_u * np.sqrt(period) if tick > 0 else 0.0
    for i in range(3):
        before = gyro.bias[i]
        gyro.bias[i] = before + walk * draws[3 + i]
        bias = gyro.offset[i] + 0.5 * (gyro.bias[i] + before)
        noise = np.sqrt(white + gyro.sigma[i] * gyro.sigma[i]) * draws[i]
        rate = gyro.scale[i] * truth.omega_base[i] + bias + noise
        measured.omega_base[i] = in_steps(rate, gyro.step[0])
