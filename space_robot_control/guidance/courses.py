"""Motions of the joints and of the base over time, from which a mission is put together.

Each gives position, rate and acceleration that belong together at any time. Before it begins and
after it ends it is at rest, unless the base turns on.

Times are in s, joints in rad, or m of prismatic ones. The base's attitude is a unit quaternion
``[w, x, y, z]``; its angular velocity and acceleration are on its own axes.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from space_robot_model.elementary.matrices import dot_rows, norm

if TYPE_CHECKING:
    from space_robot_model.elementary.splines import CubicSpline, QuinticSpline
    from space_robot_model.orbit.ephemeris import Ephemeris
    from space_robot_model.robot import Robot

    from .goals import PointingGoal

Array = NDArray[np.float64]


KNOT_S = 0.01
"""Spacing of the knots of a spline along a path, and of the samples of a segment, s."""
FEWEST_KNOTS, MOST_KNOTS = 101, 20_001
"""Number of these: a segment is the same motion in any duration, so a long one needs no more."""


class Course(Protocol):
    """A motion of the joints, (T, 3, n), or of the base, (T, 10), as in a `ReferenceChunk`."""

    def at(self, time: Array) -> Array:
        """Return the motion at times (T,), s."""
        ...


class Piece(NamedTuple):
    """A planned segment."""

    begin: float
    end: float
    joints: Course
    base: Course
    goal: Array
    """(n,) joints at the end."""
    attitude: Array
    """(4,) quaternion at the end."""
    motion: str = "joints"
    """What is moved how, in a word or two."""
    mode: PointingGoal | None = None
    """What the base points at from the end on, as ``base`` does; None: it is at rest then."""


class BaseMotion(NamedTuple):
    """How the base moves where a segment begins."""

    quaternion: Array
    """(4,) attitude, unit."""
    course: Course | None = None
    """What it goes on along unless a segment leads it elsewhere; None: it is at rest."""
    mode: PointingGoal | None = None
    """What it points at so."""
    before: Course | None = None
    """What a segment that leads it elsewhere begins with; None: ``course``."""

    @property
    def held(self) -> Course:
        """The course of a segment that does not lead the base."""
        return self.course or at_rest(self.quaternion)


class SegmentStart(NamedTuple):
    """Where a segment begins."""

    robot: Robot
    """As the flight software knows it."""
    time: float
    joints: Array
    """(n,)"""
    base: BaseMotion
    origin: Callable[[], Array]
    """Returns the origin (3,) of the inertial frame from the robot's centre of mass, m."""
    ephemeris: Callable[[], Ephemeris | None]
    """Returns that of the assumed orbit; None: there is none."""


Maker = Callable[[float], tuple[Course, Course]]
"""Courses of joints and base as a function of a segment's duration, s."""
JointMaker = Callable[[float, Course], Course]
"""Course of the joints as a function of the duration, s, and the course of the base."""


def quintic(u: Array) -> tuple[Array, Array, Array]:
    """Return ``10 u^3 - 15 u^4 + 6 u^5`` and its first two derivatives, ``u`` from 0 to 1."""
    return (
        u * u * u * (10.0 + u * (-15.0 + 6.0 * u)),
        30.0 * u * u * (1.0 - u) * (1.0 - u),
        60.0 * u * (1.0 - u) * (1.0 - 2.0 * u),
    )


def knots(span: float) -> Array:
    """Return the times (K,) from 0 to ``span``, s, of the knots of a spline along a path."""
    count = math.ceil(min(span / KNOT_S, MOST_KNOTS)) + 1
    return np.linspace(0.0, span, min(max(FEWEST_KNOTS, count), MOST_KNOTS))


def sample_times(begin: float, end: float) -> Array:
    """Return the times (K,), s, at which a planned segment is checked."""
    span = end - begin
    count = round(min(span / KNOT_S, MOST_KNOTS)) + 1
    return np.linspace(begin, end, min(max(FEWEST_KNOTS, count), MOST_KNOTS))


class QuinticLeg(NamedTuple):
    """Joints from rest to rest: ``theta_a + (theta_b - theta_a)(10 u^3 - 15 u^4 + 6 u^5)``."""

    begin: float
    span: float
    start: Array
    """(n,)"""
    rise: Array
    """(n,) goal minus start."""

    def at(self, time: Array) -> Array:
        """Return (T, 3, n) at times (T,)."""
        share, rate, acceleration = quintic(
            np.clip((time - self.begin)[:, np.newaxis] / self.span, 0.0, 1.0)
        )
        rows = np.empty((len(time), 3, len(self.start)))
        rows[:, 0] = self.start + self.rise * share
        rows[:, 1] = self.rise * rate / self.span
        rows[:, 2] = self.rise * acceleration / (self.span * self.span)
        return rows


class BentLeg(NamedTuple):
    """Joints from rest to rest on a path that is bent, with a quintic course ``s`` from 0 to 1.

    ``theta(s) = theta_a + (theta_b - theta_a) s + sum_k bend_k sin(k pi s)``
    """

    begin: float
    span: float
    start: Array
    """(n,)"""
    rise: Array
    """(n,) goal minus start."""
    bends: Array
    """(K, n) amplitudes, rad or m."""

    def at(self, time: Array) -> Array:
        """Return (T, 3, n) at times (T,)."""
        from space_robot_model.elementary.functions import sines_cosines  # slow to import

        u = np.clip((time - self.begin)[:, np.newaxis] / self.span, 0.0, 1.0)
        share, rate, acceleration = quintic(u)
        rate, acceleration = rate / self.span, acceleration / (self.span * self.span)
        rows = np.empty((len(time), 3, len(self.start)))
        rows[:, 0] = self.start + self.rise * share
        slope, curve = self.rise + np.zeros_like(rows[:, 0]), np.zeros_like(rows[:, 0])
        for k, bend in enumerate(self.bends, 1):
            frequency = k * math.pi
            sines, cosines = sines_cosines(frequency * share)
            rows[:, 0] += bend * sines
            slope += frequency * bend * cosines
            curve -= frequency * frequency * bend * sines
        rows[:, 1] = slope * rate
        rows[:, 2] = slope * acceleration + curve * rate * rate
        return rows


class Slew(NamedTuple):
    """The base turns about one axis from rest to rest; the angle is quintic."""

    begin: float
    span: float
    quaternion: Array
    """(4,) at the begin."""
    axis: Array
    """(3,) unit, in the base frame; its components do not change during the turn."""
    angle: float
    """rad."""

    def at(self, time: Array) -> Array:
        """Return (T, 10) at times (T,): quaternion, angular velocity and acceleration."""
        rows = np.zeros((len(time), 10))
        rows[:, :4] = self.quaternion
        if self.angle == 0.0:  # most missions hold the base: no import for them
            return rows
        share, rate, acceleration = quintic(np.clip((time - self.begin) / self.span, 0.0, 1.0))
        rows[:, :4] = multiplied(self.quaternion, turned_by(self.axis, self.angle * share))
        rows[:, 4:7] = (self.angle * rate / self.span)[:, np.newaxis] * self.axis
        rows[:, 7:] = (self.angle * acceleration / self.span**2)[:, np.newaxis] * self.axis
        return rows


class SteadyTurn(NamedTuple):
    """The base turns about one axis at a constant rate."""

    begin: float
    quaternion: Array
    """(4,) at the begin."""
    omega: Array
    """(3,) angular velocity, rad/s, base frame."""

    def at(self, time: Array) -> Array:
        """Return (T, 10) at times (T,): quaternion, angular velocity and acceleration."""
        rows, rate = np.zeros((len(time), 10)), norm(self.omega)
        rows[:, :4], rows[:, 4:7] = self.quaternion, self.omega
        if rate:
            turns = turned_by(self.omega / rate, rate * (time - self.begin))
            rows[:, :4] = multiplied(self.quaternion, turns)
        return rows


class SplineCourse(NamedTuple):
    """Joints along a spline."""

    begin: float
    """s, time zero of the spline."""
    spline: CubicSpline | QuinticSpline

    def at(self, time: Array) -> Array:
        """Return (T, 3, n) at times (T,)."""
        return self.spline.at(time - self.begin)


class BrakedTurn(NamedTuple):
    """The base comes to rest about the axis that it turns about."""

    begin: float
    span: float
    """s until it is at rest."""
    quaternion: Array
    """(4,) at the begin."""
    omega: Array
    """(3,) angular velocity at the begin, rad/s, base frame."""
    alpha: Array
    """(3,) angular acceleration at the begin; its part along ``omega`` goes on."""

    def at(self, time: Array) -> Array:
        """Return (T, 10) at times (T,): quaternion, angular velocity and acceleration."""
        from space_robot_model.elementary.splines import QuinticSpline

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
        """Return (T, 10) at times (T,): quaternion, angular velocity and acceleration."""
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


def at_rest(quaternion: Array) -> Slew:
    """Return the course of a base that is held at an attitude (4,)."""
    return Slew(0.0, 1.0, quaternion, np.zeros(3), 0.0)


def multiplied(first: Array, second: Array) -> Array:
    """Return the products (..., 4) of quaternions ``[w, x, y, z]``."""
    w, x, y, z = np.moveaxis(np.asarray(first), -1, 0)
    a, b, c, d = np.moveaxis(np.asarray(second), -1, 0)
    return np.stack(
        (
            w * a - x * b - y * c - z * d,
            w * b + x * a + y * d - z * c,
            w * c - x * d + y * a + z * b,
            w * d + x * c - y * b + z * a,
        ),
        axis=-1,
    )


def turned_by(axis: Array, angles: Array) -> Array:
    """Return the quaternions (K, 4) of turns by angles (K,), rad, about a unit axis (3,)."""
    from space_robot_model.elementary.functions import sines_cosines  # slow to import

    sines, cosines = sines_cosines(0.5 * angles)
    return np.column_stack((cosines, sines[:, np.newaxis] * axis))


def turn_between(first: Array, second: Array) -> tuple[Array, float]:
    """Return axis (3,) in the first frame and angle (rad, 0 to pi) of the shortest turn."""
    from space_robot_model.elementary.functions import arctan2  # slow to import

    turn = multiplied(first * np.array([1.0, -1.0, -1.0, -1.0]), second)
    turn = -turn if turn[0] < 0.0 else turn  # the other sign is the same attitude the longer way
    sine = norm(turn[1:])
    if sine == 0.0:
        return np.array([1.0, 0.0, 0.0]), 0.0
    return turn[1:] / sine, 2.0 * float(arctan2(sine, float(turn[0])))
