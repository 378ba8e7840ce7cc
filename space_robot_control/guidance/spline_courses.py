"""Motions of the joints and of the base along splines."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from space_robot_model.elementary.matrices import dot_rows, norm
from space_robot_model.elementary.splines import CubicSpline, QuinticSpline

from .courses import Slew, multiplied, turned_by

Array = NDArray[np.float64]


class SplineCourse(NamedTuple):
    """Joints along a spline."""

    begin: float
    """s, time zero of the spline."""
    spline: CubicSpline | QuinticSpline

    def at(self, time: Array) -> Array:
        """Return (T, 3, n) at times (T,), s."""
        return self.spline.at(time - self.begin)


class BrakedTurn(NamedTuple):
    """The base comes to rest about the axis that it turns about."""

    begin: float
    """s."""
    span: float
    """s until it is at rest."""
    quaternion: Array
    """(4,) attitude at the begin, unit."""
    omega: Array
    """(3,) angular velocity at the begin, rad/s, base frame."""
    alpha: Array
    """(3,) angular acceleration at the begin; its part along ``omega`` goes on."""

    def at(self, time: Array) -> Array:
        """Return (T, 10) at times (T,), s: quaternion, velocity and acceleration, base frame."""
        rate = norm(self.omega)
        if rate == 0.0:
            return Slew(self.begin, self.span, self.quaternion, self.omega, 0.0).at(time)
        axis = self.omega / rate
        first = [0.0, rate, float(dot_rows(axis, self.alpha)[0])]
        states = np.array([first, [0.5 * self.span * rate, 0.0, 0.0]])[:, :, np.newaxis]
        turn = QuinticSpline(np.array([0.0, self.span]), states).at(time - self.begin)
        rows = np.empty((len(time), 10))
        rows[:, :4] = multiplied(self.quaternion, turned_by(axis, turn[:, 0, 0]))
        rows[:, 4:7], rows[:, 7:] = turn[:, 1] * axis, turn[:, 2] * axis
        return rows


class AttitudeCourse(NamedTuple):
    """The base along a cubic spline of the components of its quaternion, then normalised."""

    begin: float
    """s, time zero of the spline."""
    spline: CubicSpline
    """Of quaternions in one hemisphere."""

    def at(self, time: Array) -> Array:
        """Return (T, 10) at times (T,), s: quaternion, velocity and acceleration, base frame."""
        p, p_rate, p_second = np.moveaxis(self.spline.at(time - self.begin), 1, 0)
        length = np.sqrt(dot_rows(p, p))
        q = p / length
        stretch = dot_rows(p, p_rate) / length
        q_rate = (p_rate - q * stretch) / length
        stretch_rate = (
            dot_rows(p_rate, p_rate) + dot_rows(p, p_second) - stretch * stretch
        ) / length
        q_second = (p_second - 2.0 * q_rate * stretch - q * stretch_rate) / length
        back = q * np.array([1.0, -1.0, -1.0, -1.0])
        # omega = 2 q* qdot; its derivative has |qdot|^2 in the scalar part only
        omega, alpha = multiplied(back, 2.0 * q_rate), multiplied(back, 2.0 * q_second)
        return np.hstack((q, omega[:, 1:], alpha[:, 1:]))
