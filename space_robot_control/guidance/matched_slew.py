"""A turn of the base from one motion into another.

With q_after the attitude on the course that the base joins, ``q = q_after exp(phi)``, and the
rotation vector phi is a quintic polynomial of time that ends in zero with its rate and second
derivative.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from space_robot_model.elementary.matrices import dot_rows, norm, norms
from space_robot_model.elementary.splines import QuinticSpline
from space_robot_msgs_py.errors import InputError

from .courses import Course

Array = NDArray[np.float64]

SAMPLES = 201
"""Times at which the size of the turn is checked."""


class MatchedSlew:
    """The base leaves one course and joins another, with attitude, rate and acceleration.

    It turns the shorter way. From rest to rest it is the motion of a `Slew`. Before and after the
    turn it is on the one and on the other course; the quaternion's sign does not jump.
    """

    def __init__(self, begin: float, span: float, before: Course, after: Course) -> None:
        """Match the ends.

        Args:
            begin: s, when the base leaves ``before``.
            span: s until it is on ``after``, above 0.
            before: of the base, up to ``begin``.
            after: of the base, from ``begin + span`` on.

        Raises:
            InputError: the rates at the begin would carry the base once round in this time.
        """
        from .matched_slew_kernel import match_into  # slow to import

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
        from .matched_slew_kernel import turned_into  # slow to import

        rows = self._after.at(time)
        if np.any(is_turning := time < self._end):
            turned = np.ascontiguousarray(rows[is_turning])
            turned_into(self._turn.at(time[is_turning] - self._begin), turned)
            rows[is_turning] = turned
        rows[:, :4] *= self._sign
        if np.any(is_early := time < self._begin):
            rows[is_early] = self._before.at(time[is_early])
        return rows
