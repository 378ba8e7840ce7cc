"""Magnetometer on the base: white noise and a constant bias on each axis."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.compiled.kernels import kernel
from space_robot_msgs_py.compiled.lanes import where
from space_robot_msgs_py.compiled.records import shaped
from space_robot_msgs_py.samples import State

from ..component import Component
from ..faults.grammar import About, Argument, Kind, add_in_quadrature
from ..faults.schedule import BLOCK_TICKS

Array = NDArray[np.float64]

SIGMA = Argument("SIGMA", "T", 0.0, 1.0)
BIAS = Argument("FIELD", "T", -1.0, 1.0, About.BASE_AXIS)


class Magnetometer(Component):
    """A magnetometer that measures ``B + bias + sigma n`` with standard normal n, on base axes."""

    sigma: Array = shaped(lambda n: (3,), origin="noise")
    """White noise of each sample, T."""
    bias: Array = shaped(lambda n: (3,), origin="bias")
    """T."""
    draws: Array = shaped(lambda n: (BLOCK_TICKS, 3))
    """Standard normal numbers, a row a tick."""

    FAULTS: ClassVar[tuple[Kind, ...]] = (
        Kind(
            "noise_magnetometer", SIGMA, "noise on the measured field", "sigma", add_in_quadrature
        ),
        Kind("magnetometer_bias", BIAS, "FIELD is added to the measured field on an axis", "bias"),
    )


@kernel
def read_magnetometer(magnetometer: Magnetometer, truth: State, tick: int, measured: State) -> None:
    """Write the measured field into ``measured``."""
    draws = magnetometer.draws[tick % BLOCK_TICKS]
    for i in range(3):
        error = magnetometer.bias[i] + magnetometer.sigma[i] * draws[i]
        field = truth.magnetic_field[i]
        # without an error the bits stay, those of -0.0, too
        measured.magnetic_field[i] = where(error == 0.0, field, field + error)
