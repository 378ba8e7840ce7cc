"""Gravity at a place against decimal arithmetic of 50 digits."""

from __future__ import annotations

from decimal import Decimal, localcontext

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from orbiting_robots import DIGITS, EARTH_RADIUS, earth_potential, exact, exact_gravity, plus

from space_robot_model.orbit.gravity import gravity

Array = NDArray[np.float64]

DIRECTION = st.tuples(*[st.floats(-1.0, 1.0)] * 3).filter(lambda d: np.linalg.norm(d) > 0.1)
HEIGHTS = st.floats(200e3, 4e7)
FEW = settings(max_examples=200)


def vector(direction: tuple[float, ...], length: float) -> Array:
    """Return a vector (3,) of that length."""
    return np.asarray(length * np.array(direction) / np.linalg.norm(direction))


@FEW
@given(DIRECTION, HEIGHTS, st.booleans())
def test_gravity_agrees_with_many_digits(
    direction: tuple[float, ...], height: float, has_j2: bool
) -> None:
    r = vector(direction, EARTH_RADIUS + height)
    out = np.empty(3)
    gravity(r, float(has_j2), out)
    with localcontext() as context:
        context.prec = DIGITS
        expected = np.array([float(x) for x in exact_gravity(exact(r), has_j2)])
    np.testing.assert_allclose(out, expected, rtol=0, atol=1e-15 * np.linalg.norm(expected))


@FEW
@given(DIRECTION, HEIGHTS, st.booleans())
def test_gravity_is_the_gradient_of_its_potential(
    direction: tuple[float, ...], height: float, has_j2: bool
) -> None:
    """By central differences of decimal numbers, over a nanometre."""
    r = vector(direction, EARTH_RADIUS + height)
    out, gradient = np.empty(3), np.empty(3)
    gravity(r, float(has_j2), out)
    with localcontext() as context:
        context.prec = 2 * DIGITS
        step = 1e-9
        for axis in range(3):
            aside = exact(step * np.eye(3)[axis])
            back = exact(-step * np.eye(3)[axis])
            ends = [earth_potential(plus(exact(r), d), has_j2) for d in (aside, back)]
            gradient[axis] = float((ends[0] - ends[1]) / (2 * Decimal(step)))
    np.testing.assert_allclose(out, -gradient, rtol=0, atol=1e-15 * np.linalg.norm(out))
