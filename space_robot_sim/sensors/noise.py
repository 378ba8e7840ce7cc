"""Random numbers of the sensors, drawn in blocks in Python and read by kernels."""

from __future__ import annotations

import zlib
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from space_robot_model.elementary.normal import normal_numbers
from space_robot_msgs_py.compiled.kernels import kernel
from space_robot_msgs_py.compiled.lanes import any_lane, where

from ..faults.schedule import BLOCK_TICKS

Array = NDArray[np.float64]


class NoiseDraws:
    """Generator of the sensors' standard normal numbers, (256, size) each, a row per tick.

    The numbers are a function of seed, sensor and tick alone: a flight repeats exactly, in any
    number of processes, and no sensor's numbers depend on the sensors beside it.
    """

    def __init__(self, seed: int, arrays: Mapping[str, Array]) -> None:
        """``arrays``: to be filled, by the sensor's name."""
        self._arrays = [(zlib.crc32(name.encode()), array) for name, array in arrays.items()]
        self.drawn = seed, -1
        """The seed, and the block of ticks that is in the arrays."""

    def refill(self, tick: int) -> int:
        """Draw the block of ``tick`` if needed; return the first tick of the next block."""
        block, (seed, drawn) = tick // BLOCK_TICKS, self.drawn
        if block != drawn:
            for key, array in self._arrays:
                bits = np.random.PCG64((seed, key, block)).random_raw(array.size)
                normal_numbers(bits, array.reshape(-1))
            self.drawn = seed, block
        return (block + 1) * BLOCK_TICKS


@kernel
def row_of(tick: int) -> int:
    """Return the row of a tick in its block of random numbers."""
    return tick % BLOCK_TICKS


@kernel
def in_steps(value: float, step: float) -> float:
    """Round ``value`` to the nearest whole multiple of ``step``; a step of 0 is none."""
    if not any_lane(step > 0.0):
        return value
    spacing = where(step > 0.0, step, 1.0)
    rounded: float = spacing * np.floor(value / spacing + 0.5)
    return where(step > 0.0, rounded, value)
