"""Cubic and quintic splines with two continuous derivatives, the same bits on every processor.

SciPy solves for the rates with LAPACK, whose sums differ between processors.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.compiled.kernels import kernel

from .matrices import Array


def _locate(knots: Array, time: Array) -> tuple[NDArray[np.intp], Array, Array, NDArray[np.bool_]]:
    # knot before each time, the span to the next (T, 1), the share of it that has passed, and
    # whether the time is outside: then it counts as the nearer end
    inside = np.clip(time, knots[0], knots[-1])
    k = np.clip(np.searchsorted(knots, inside, side="right") - 1, 0, len(knots) - 2)
    span = (knots[k + 1] - knots[k])[:, np.newaxis]
    share = (inside - knots[k])[:, np.newaxis] / span
    return k, span, share, (time < knots[0]) | (time > knots[-1])


class CubicSpline:
    """A cubic spline through values at given times, at given rates at both ends."""

    def __init__(
        self,
        times: Array,
        values: Array,
        first_rate: Array | float = 0.0,
        last_rate: Array | float = 0.0,
    ) -> None:
        """Solve for the rates.

        Args:
            times: (K,) s, rising, at least two.
            values: (K, D) at these times.
            first_rate: (D,) at the first time, 1/s.
            last_rate: (D,) at the last time.
        """
        self.times, self.values = times, np.ascontiguousarray(values)
        self.rates = np.empty_like(self.values)
        self.rates[0], self.rates[-1] = first_rate, last_rate
        _fill_rates(self.times, self.values, self.rates, np.zeros(len(times)))

    def at(self, time: Array) -> Array:
        """Return (T, 3, D): value, rate (1/s) and second derivative (1/s2).

        Outside its times the spline is at rest at the nearer end.
        """
        k, span, u, is_outside = _locate(self.times, time)
        first, rise = self.values[k], self.values[k + 1] - self.values[k]
        m0, m1 = self.rates[k] * span, self.rates[k + 1] * span
        square, cube = 3.0 * rise - 2.0 * m0 - m1, m0 + m1 - 2.0 * rise
        rows = np.empty((len(time), 3, self.values.shape[1]))
        rows[:, 0] = first + u * (m0 + u * (square + u * cube))
        rows[:, 1] = (m0 + u * (2.0 * square + u * 3.0 * cube)) / span
        rows[:, 2] = (2.0 * square + u * 6.0 * cube) / (span * span)
        rows[is_outside, 1:] = 0.0
        return rows


@kernel
def _fill_rates(times: Array, values: Array, rates: Array, work: Array) -> None:
    # Thomas' elimination of the tridiagonal system of inner rates with which the second derivative
    # is continuous (de Boor, A Practical Guide to Splines, IV)
    last = len(times) - 1
    for k in range(1, last):
        before, after = 1.0 / (times[k] - times[k - 1]), 1.0 / (times[k + 1] - times[k])
        pivot = 2.0 * (before + after) - before * work[k - 1] if k > 1 else 2.0 * (before + after)
        work[k] = after / pivot
        for d in range(values.shape[1]):
            slope = before * before * (values[k, d] - values[k - 1, d])
            slope += after * after * (values[k + 1, d] - values[k, d])
            rates[k, d] = (3.0 * slope - before * rates[k - 1, d]) / pivot
    for k in range(last - 1, 0, -1):
        for d in range(values.shape[1]):
            rates[k, d] -= work[k] * rates[k + 1, d]


class QuinticSpline:
    """A spline with two continuous derivatives, by Hermite's interpolation of fifth order."""

    def __init__(self, times: Array, states: Array) -> None:
        """Take the states.

        Args:
            times: (K,) s, rising, at least two.
            states: (K, 3, D) value, rate (1/s) and second derivative (1/s2) at these times.
        """
        self.times, self.states = times, states

    def at(self, time: Array) -> Array:
        """Return (T, 3, D): value, rate and second derivative.

        Outside its times the spline is at rest at the nearer end.
        """
        k, h, u, is_outside = _locate(self.times, time)
        first, last = self.states[k], self.states[k + 1]
        c0, c1, c2 = first[:, 0], first[:, 1] * h, 0.5 * first[:, 2] * h * h
        # what is left of the values at the end, and of h times and h^2 times their derivatives
        p = last[:, 0] - c0 - c1 - c2
        v = last[:, 1] * h - c1 - 2.0 * c2
        a = last[:, 2] * h * h - 2.0 * c2
        c3 = 10.0 * p - 4.0 * v + 0.5 * a
        c4 = -15.0 * p + 7.0 * v - a
        c5 = 6.0 * p - 3.0 * v + 0.5 * a
        rows = np.empty((len(time), *self.states.shape[1:]))
        rows[:, 0] = c0 + u * (c1 + u * (c2 + u * (c3 + u * (c4 + u * c5))))
        rows[:, 1] = (c1 + u * (2.0 * c2 + u * (3.0 * c3 + u * (4.0 * c4 + u * 5.0 * c5)))) / h
        rows[:, 2] = (2.0 * c2 + u * (6.0 * c3 + u * (12.0 * c4 + u * 20.0 * c5))) / (h * h)
        rows[is_outside, 1:] = 0.0
        return rows
