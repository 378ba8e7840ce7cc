"""Magnetometer on the base: white noise and a constant bias on each axis."""

from __future__ import annotations

import zlib
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from space_robot_model.elementary.normal import normal_numbers
from space_robot_msgs_py.compiled.kernels import kernel
from space_robot_msgs_py.compiled.lanes import all_lanes, uniform, where
from space_robot_msgs_py.compiled.records import assign, shaped
from space_robot_msgs_py.samples import State

from ..component import Component
from ..faults.grammar import About, Argument, Kind, add_noise
from ..faults.schedule import BLOCK_TICKS

Array = NDArray[np.float64]

SIGMA = Argument("SIGMA", "T", 0.0, 1.0)
KEY = zlib.crc32(b"magnetometer")
"""Of its random numbers."""
BIAS = Argument("FIELD", "T", -1.0, 1.0, About.BASE_AXIS)


class Magnetometer(Component):
    """A magnetometer that measures ``B + bias + sigma n`` with standard normal n, on base axes."""

    sigma: Array = shaped(lambda n: (3,), source="noise")
    """White noise of each sample, T."""
    bias: Array = shaped(lambda n: (3,), source="bias")
    """T."""
    draws: Array = shaped(lambda n: (BLOCK_TICKS, 3))
    """Standard normal numbers, a row a tick."""
    drawn: float = shaped(lambda n: (), uniform=True, source=lambda s, at: -1.0)
    """The block of ticks whose random numbers have been drawn; -1: none yet."""
    is_exact: float = shaped(lambda n: ())
    """1 for a magnetometer without error, so that its kernel is skipped."""

    FAULTS: ClassVar[tuple[Kind, ...]] = (
        Kind("noise_magnetometer", SIGMA, "noise on the measured field", "sigma", add_noise),
        Kind("magnetometer_bias", BIAS, "FIELD is added to the measured field on an axis", "bias"),
    )

    @staticmethod
    def refresh(record: Any) -> None:
        """Update ``is_exact``."""
        assign(record, is_exact=not np.any((record.sigma, record.bias)))


@kernel
def read_magnetometer(
    magnetometer: Magnetometer, seed: float, truth: State, tick: int, measured: State
) -> None:
    """Write the measured field into ``measured``, which has the true one before."""
    is_exact = magnetometer.is_exact != 0.0
    if all_lanes(is_exact):
        return
    if uniform(magnetometer.drawn) != tick // BLOCK_TICKS:
        magnetometer.drawn = tick // BLOCK_TICKS
        normal_numbers(magnetometer.draws, seed, KEY, tick // BLOCK_TICKS)
    draws = magnetometer.draws[tick % BLOCK_TICKS]
    for i in range(3):
        error = magnetometer.bias[i] + magnetometer.sigma[i] * draws[i]
        field = truth.magnetic_field[i]
        measured.magnetic_field[i] = where(is_exact, field, field + error)
