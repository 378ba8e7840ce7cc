"""Spectrum of real samples by Stockham's Fourier transform, for any number of samples."""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.compiled.kernels import kernel

from .sine import sines_cosines

Array = NDArray[np.float64]


def squared_spectrum(rows: Array) -> Array:
    """Return the squared magnitudes (N // 2 + 1, axes) of the transform of real ``rows`` (N, axes).

    If N is even, two rows are combined into complex numbers. Large prime factors of N are slow.
    """
    size, count = len(rows), len(rows) // 2 + 1
    sines, cosines = _turns(size)
    if size % 2:
        real, imaginary = _transformed(rows, np.zeros_like(rows), sines, cosines)
        return (real * real + imaginary * imaginary)[:count]
    halves = _transformed(rows[0::2], rows[1::2], sines[::2], cosines[::2])
    spectrum = np.empty((count, rows.shape[1]))
    _squares(*halves, sines, cosines, spectrum)
    return spectrum


@lru_cache(maxsize=4)
def _turns(size: int) -> tuple[Array, Array]:
    """Return sine and cosine of each whole part of a turn."""
    turns = np.arange(size, dtype=np.float64)
    angles = 2.0 * math.pi * np.where(turns > size / 2, turns - size, turns) / size
    return sines_cosines(angles)


def _transformed(
    real: Array, imaginary: Array, sines: Array, cosines: Array
) -> tuple[Array, Array]:
    """Return the transform of complex rows; ``sines`` and ``cosines`` are the twiddle factors."""
    parts = np.ascontiguousarray(real), np.ascontiguousarray(imaginary)
    sines, cosines = np.ascontiguousarray(sines), np.ascontiguousarray(cosines)
    for factor, stride in _factors(len(real)):
        out = np.empty_like(parts[0]), np.empty_like(parts[1])
        _stage(factor, stride, cosines, sines, *parts, *out)
        parts = out
    return parts


def _factors(size: int) -> list[tuple[int, int]]:
    """Return the prime factors of ``size``, each with the product of those before it."""
    factors, stride, factor = [], 1, 2
    while stride < size:
        if factor * factor > size // stride:
            factor = size // stride
        if (size // stride) % factor:
            factor += 1
        else:
            factors.append((factor, stride))
            stride *= factor
    return factors


@kernel
def _stage(
    factor: int,
    stride: int,
    cosines: Array,
    sines: Array,
    real: Array,
    imaginary: Array,
    real_out: Array,
    imaginary_out: Array,
) -> None:
    """Run the stage of one ``factor``; ``stride`` is the product of the previous factors."""
    size, axes = real.shape
    rest, run = size // (stride * factor), stride * axes
    xs, ys = real.reshape(-1), imaginary.reshape(-1)
    us, vs = real_out.reshape(-1), imaginary_out.reshape(-1)
    for j in range(rest):
        for t in range(factor):
            begin = run * (factor * j + t)
            u, v = us[begin : begin + run], vs[begin : begin + run]
            for r in range(factor):
                turn = (r * t * (size // factor) + j * t * stride) % size
                c, s, other = cosines[turn], sines[turn], run * (j + rest * r)
                x, y = xs[other : other + run], ys[other : other + run]
                if r == 0:
                    for i in range(run):
                        u[i], v[i] = 0.0 + (c * x[i] + s * y[i]), 0.0 + (c * y[i] - s * x[i])
                else:
                    for i in range(run):
                        u[i], v[i] = u[i] + (c * x[i] + s * y[i]), v[i] + (c * y[i] - s * x[i])


@kernel
def _squares(real: Array, imaginary: Array, sines: Array, cosines: Array, out: Array) -> None:
    """Return in ``out`` the squared magnitudes, from even rows as real, odd as imaginary part."""
    size, axes = real.shape
    for f in range(len(out)):
        a, b = f % size, (size - f) % size
        for k in range(axes):
            even, even_i = real[a, k] + real[b, k], imaginary[a, k] - imaginary[b, k]
            odd, odd_i = imaginary[a, k] + imaginary[b, k], real[b, k] - real[a, k]
            x = even + (cosines[f] * odd + sines[f] * odd_i)
            y = even_i + (cosines[f] * odd_i - sines[f] * odd)
            out[f, k] = 0.25 * (x * x + y * y)
