"""Quintic splines through positions, rates and second derivatives, each piece for itself."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .spline import places

Array = NDArray[np.float64]


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
        k, h, u, is_outside = places(self.times, time)
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
