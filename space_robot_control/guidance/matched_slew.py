"""A turn of the base from one motion into another.

With q_after the attitude on the course that the base joins, ``q = q_after exp(phi)``, and the
rotation vector phi is a quintic polynomial of time that ends in zero with its rate and second
derivative. ``omega = J_r(phi) phidot`` with the right Jacobian (Chirikjian, Stochastic Models,
Information Theory, and Lie Groups, volume 2, 2012, section 10.5), of the angle ``t = |phi|``

    J_r x = x - a phi x x + b phi x (phi x x),   a = (1 - cos t) / t^2,   b = (t - sin t) / t^3
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from space_robot_model.dynamics.algebra import (
    Vector,
    add,
    cross,
    dot,
    scale,
    store,
    subtract,
    vector,
)
from space_robot_model.dynamics.attitude import multiply, rotated
from space_robot_model.elementary.functions import angle_of, sin_cos
from space_robot_model.elementary.matrices import dot_rows, norm, norms
from space_robot_model.elementary.splines import QuinticSpline
from space_robot_msgs_py.compiled.kernels import kernel, subroutine
from space_robot_msgs_py.errors import InputError

from .courses import Course

Array = NDArray[np.float64]

SAMPLES = 201
"""Times at which the size of the turn is checked."""
SMALL = 1e-3
"""Angle below which series are used, rad."""


class MatchedSlew:
    """The base leaves one course and joins another, with attitude, rate and acceleration.

    It turns the shorter way. From rest to rest it is the motion of a `Slew`. Before and after the
    turn it is on the one and on the other course; the quaternion's sign does not jump.
    """

    def __init__(self, begin: float, span: float, before: Course, after: Course) -> None:
        """Match the ends: the base leaves ``before`` at ``begin`` and is on ``after`` a span later.

        Raises:
            InputError: the rates at the begin would carry the base once round in this time.
        """
        self._begin, self._end = begin, begin + span
        self._before, self._after = before, after
        old, new = (course.at(np.array([begin]))[0] for course in (before, after))
        states = np.zeros((2, 3, 3))
        match_into(old, new, states[0])
        self._turn = QuinticSpline(np.array([0.0, span]), states)
        angles = norms(self._turn.at(np.linspace(0.0, span, SAMPLES))[:, 0])
        if not angles.max() < 2.0 * math.pi:
            raise InputError(
                f"in {span:g} s the base would turn once round on its way, for it moves at "
                f"{math.degrees(norm(states[0, 1])):.3g} degrees/s relative to its goal: choose a "
                "shorter duration"
            )
        self._sign = 1.0
        first = self.at(np.array([begin]))[0]
        self._sign = math.copysign(1.0, float(dot_rows(first[:4], old[:4])[0]))

    def at(self, time: Array) -> Array:
        """Return (T, 10) at times (T,), s: quaternion, velocity and acceleration, base frame."""
        rows = self._after.at(time)
        if np.any(is_turning := time < self._end):
            turned = np.ascontiguousarray(rows[is_turning])
            turned_into(self._turn.at(time[is_turning] - self._begin), turned)
            rows[is_turning] = turned
        rows[:, :4] *= self._sign
        if np.any(is_early := time < self._begin):
            rows[is_early] = self._before.at(time[is_early])
        return rows


@kernel
def match_into(old: Array, new: Array, turn: Array) -> None:
    """Write what leads from one motion (10,) of the base to another at the same time.

    ``turn`` (3, 3) is written: the rotation vector from the new attitude to the old one, the
    shorter way, rad, its rate and second derivative.
    """
    q = multiply((new[0], -new[1], -new[2], -new[3]), (old[0], old[1], old[2], old[3]))
    if q[0] < 0.0:
        q = (-q[0], -q[1], -q[2], -q[3])
    part = (q[1], q[2], q[3])
    sine = np.sqrt(dot(part, part))
    phi = (0.0, 0.0, 0.0)
    if sine > 0.0:
        phi = scale(part, 2.0 * angle_of(sine, q[0]) / sine)
    back = (q[0], -q[1], -q[2], -q[3])
    carried = rotated(back, vector(new, 4))
    omega = subtract(vector(old, 4), carried)
    # the axes on which `carried` is written turn with omega: its derivative there has -omega x it
    alpha = add(subtract(vector(old, 7), rotated(back, vector(new, 7))), cross(omega, carried))
    rate = by_inverse_jacobian(phi, omega)
    second = by_inverse_jacobian(phi, subtract(alpha, jacobian_rate(phi, rate)))
    store(phi, turn[0], 0)
    store(rate, turn[1], 0)
    store(second, turn[2], 0)


@kernel
def turned_into(turns: Array, rows: Array) -> None:
    """Replace motions ``rows`` (T, 10) by those that ``turns`` (T, 3, 3), see above, lead to."""
    for i in range(len(rows)):
        row = rows[i]
        phi, rate = vector(turns[i, 0], 0), vector(turns[i, 1], 0)
        ratio, cosine = half_turn(phi)
        w, part = cosine, scale(phi, 0.5 * ratio)
        back = (w, -part[0], -part[1], -part[2])
        carried, omega = rotated(back, vector(row, 4)), by_jacobian(phi, rate)
        alpha = add(by_jacobian(phi, vector(turns[i, 2], 0)), jacobian_rate(phi, rate))
        alpha = add(subtract(rotated(back, vector(row, 7)), cross(omega, carried)), alpha)
        q = multiply((row[0], row[1], row[2], row[3]), (w, part[0], part[1], part[2]))
        row[0], row[1], row[2], row[3] = q
        store(add(carried, omega), row, 4)
        store(alpha, row, 7)


@subroutine
def half_turn(phi: Vector) -> tuple[float, float]:
    """Return ``sin(t / 2) / (t / 2)`` and ``cos(t / 2)``."""
    half = 0.5 * np.sqrt(dot(phi, phi))
    sine, cosine = sin_cos(half)
    ratio = sine / half if half > SMALL else 1.0 - half * half / 6.0
    return ratio, cosine


@subroutine
def coefficients(phi: Vector) -> tuple[float, float, float, float]:
    """Return ``a``, ``b`` and their derivatives with respect to t, divided by t."""
    ratio, cosine = half_turn(phi)
    square, sine = dot(phi, phi), ratio * cosine  # sin(t) / t
    a = 0.5 * ratio * ratio  # 1 - cos t = 2 sin^2(t / 2), which loses no digits for small t
    if square < SMALL * SMALL:
        return (
            a,
            1.0 / 6.0 - square / 120.0,
            -1.0 / 12.0 + square / 180.0,
            -1.0 / 60.0 + square / 1260.0,
        )
    b = (1.0 - sine) / square
    return a, b, (sine - 2.0 * a) / square, (a - 3.0 * b) / square


@subroutine
def by_jacobian(phi: Vector, rate: Vector) -> Vector:
    """Return ``J_r(phi) rate``."""
    a, b, _, _ = coefficients(phi)
    across = cross(phi, rate)
    return add(subtract(rate, scale(across, a)), scale(cross(phi, across), b))


@subroutine
def jacobian_rate(phi: Vector, rate: Vector) -> Vector:
    """Return the derivative of ``J_r(phi)`` times ``rate``, with which phi changes."""
    _, b, a_slope, b_slope = coefficients(phi)
    along, across = dot(phi, rate), cross(phi, rate)
    change = subtract(scale(cross(phi, across), b_slope), scale(across, a_slope))
    return add(scale(change, along), scale(cross(rate, across), b))


@subroutine
def by_inverse_jacobian(phi: Vector, omega: Vector) -> Vector:
    """Return ``J_r(phi)^-1 omega`` for angles up to pi."""
    ratio, cosine = half_turn(phi)
    square = dot(phi, phi)
    factor = 1.0 / 12.0 + square / 720.0
    if square > SMALL * SMALL:
        factor = (1.0 - cosine / ratio) / square  # (1 - (t / 2) cot(t / 2)) / t^2
    across = cross(phi, omega)
    return add(add(omega, scale(across, 0.5)), scale(cross(phi, across), factor))
