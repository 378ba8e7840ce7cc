"""A turn of the base from one motion into another."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .courses import Course

Array = NDArray[np.float64]


class MatchedSlew:
    """The base leaves one course and joins another, with attitude, rate and acceleration.

    The rotation vector from the course that it joins is a quintic polynomial. From rest to rest it
    is the motion of a `Slew`.
    """

    def __init__(self, begin: float, span: float, before: Course, after: Course) -> None:
        """Match the ends.

        Args:
            begin: s, when the base leaves ``before``.
            span: s until it is on ``after``, above 0.
            before: of the base, up to ``begin``.
            after: of the base, from ``begin + span`` on.

        Raises:
            InputError: in this time the base would turn more than once round.
        """
        raise NotImplementedError

    def at(self, time: Array) -> Array:
        """Return (T, 10) at times (T,), s: quaternion, velocity and acceleration, base frame."""
        raise NotImplementedError
