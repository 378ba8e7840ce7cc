"""Sine and cosine for compiled code and for arrays."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from space_robot_msgs_py.compiled.kernels import kernel

from .series import plain_sin_cos

Array = NDArray[np.float64]

sin_cos = kernel(plain_sin_cos)
"""`plain_sin_cos`, compiled."""


def sines_cosines(angles: ArrayLike) -> tuple[Array, Array]:
    """Return sines and cosines of ``angles``, rad, in the same shape."""
    values = np.asarray(angles, dtype=np.float64, order="C")
    sines, cosines = np.empty(values.shape), np.empty(values.shape)
    _fill(values.reshape(-1), sines.reshape(-1), cosines.reshape(-1))
    return sines, cosines


@kernel
def _fill(angles: Array, sines: Array, cosines: Array) -> None:
    for i in range(angles.size):
        sines[i], cosines[i] = sin_cos(angles[i])
