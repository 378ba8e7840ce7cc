"""Difference of gravity against decimal arithmetic of 50 digits, and J2's precession."""

from __future__ import annotations

from decimal import localcontext

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from orbiting_robots import (
    DIGITS,
    EARTH_RADIUS,
    J2,
    MU,
    coast,
    exact,
    exact_gravity,
    mean_motion,
    orbiting_plant,
    plus,
    rigid_robot,
)
from scipy.integrate import solve_ivp

from space_robot_model.dynamics.model import Data
from space_robot_sim.environment.gravity_gradient import add_gravity_gradient

Array = NDArray[np.float64]

POINT = rigid_robot(2.0, [1.0, 1.0, 1.0])
DIRECTION = st.tuples(*[st.floats(-1.0, 1.0)] * 3).filter(lambda d: np.linalg.norm(d) > 0.1)
HEIGHTS = st.floats(200e3, 4e7)
DISTANCES = st.floats(-3.0, 5.0).map(lambda power: 10.0**power)
FEW = settings(max_examples=200)


def vector(direction: tuple[float, ...], length: float) -> Array:
    """Return a vector (3,) of that length."""
    return np.asarray(length * np.array(direction) / np.linalg.norm(direction))


def exact_difference(r: Array, d: Array, has_j2: bool) -> Array:
    """Return ``g(r + d) - g(r)``, rounded at the end."""
    with localcontext() as context:
        context.prec = DIGITS
        at = exact(r)
        end, begin = exact_gravity(plus(at, exact(d)), has_j2), exact_gravity(at, has_j2)
        return np.array([float(a - b) for a, b in zip(end, begin, strict=True)])


def difference(r: Array, d: Array, has_j2: bool) -> Array:
    """Return the same by the kernel, as the force on a body without extent over its mass."""
    data = Data.allocate(POINT.n)
    data.first_moment[:], data.inertia[:], data.bias[:] = 0.0, 0.0, 0.0
    add_gravity_gradient(POINT.model, r, d, float(has_j2), data)
    np.testing.assert_array_equal(data.bias[0, :3], np.zeros(3))
    return np.asarray(-data.bias[0, 3:] / POINT.model.mass[0])


@FEW
@given(DIRECTION, HEIGHTS, DIRECTION, DISTANCES, st.booleans())
def test_gravity_difference_loses_no_digits(
    direction: tuple[float, ...],
    height: float,
    aside: tuple[float, ...],
    distance: float,
    has_j2: bool,
) -> None:
    """Between 1 mm and 100 km from the point, relative to ``mu d / r^3``."""
    r, d = vector(direction, EARTH_RADIUS + height), vector(aside, distance)
    size = MU * distance / (EARTH_RADIUS + height) ** 3
    expected = exact_difference(r, d, has_j2)
    np.testing.assert_allclose(difference(r, d, has_j2), expected, rtol=0, atol=1e-14 * size)


def test_nothing_pulls_at_the_point_itself() -> None:
    r = vector((0.3, -0.5, 0.7), 7e6)
    for has_j2 in (False, True):
        np.testing.assert_array_equal(difference(r, np.zeros(3), has_j2), np.zeros(3))


def test_the_difference_of_a_small_distance_is_the_tidal_tensors() -> None:
    """``mu / r^3 (3 u u - E) d``, to d / r."""
    r, d = vector((0.3, -0.5, 0.7), 7e6), np.array([0.02, 0.01, -0.03])
    u = r / np.linalg.norm(r)
    tensor = MU / np.linalg.norm(r) ** 3 * (3.0 * np.outer(u, u) - np.eye(3))
    np.testing.assert_allclose(difference(r, d, False), tensor @ d, rtol=1e-7)


def node_of(position: Array, velocity: Array) -> float:
    """Return the right ascension of the ascending node, rad."""
    normal = np.cross(position, velocity)
    return float(np.arctan2(normal[0], -normal[1]))


@pytest.mark.parametrize("inclination_deg", [51.64, 98.19])
def test_j2_turns_the_node_at_the_secular_rate(inclination_deg: float) -> None:
    """``-3/2 n J2 (R_E / a)^2 cos i`` over eight orbits, to the next order, which is J2 itself.

    There, a is the mean semi-major axis: at a node, that of the elements is larger by
    ``3/2 J2 R_E^2 / a sin^2 i`` (Brouwer 1959). Beside it, the same orbit by SciPy.
    """
    a, inclination = EARTH_RADIUS + 700e3, np.radians(inclination_deg)
    elements = {"height": 700e3, "inclination_deg": inclination_deg, "raan_deg": 40.0}
    period = 2.0
    plant = orbiting_plant(
        POINT, period, orbital_elements=elements, gravity={"gradient": False, "j2": True}
    )
    start = np.concatenate([plant.truth.orbit_position, plant.truth.orbit_velocity])
    nodes = []  # at the ascending nodes, where what J2 does within an orbit is the same
    state, z = plant.truth, 0.0
    while len(nodes) < 9:
        before, z = z, coast(plant, 1).orbit_position[2]
        if before < 0.0 <= z:
            nodes.append((plant.tick * period, node_of(state.orbit_position, state.orbit_velocity)))
    (first, node), (last, end) = nodes[0], nodes[-1]
    rate = (end - node) / (last - first)
    mean = a - 1.5 * J2 * EARTH_RADIUS**2 / a * np.sin(inclination) ** 2
    secular = -1.5 * mean_motion(mean) * J2 * (EARTH_RADIUS / mean) ** 2 * np.cos(inclination)
    assert rate == pytest.approx(secular, rel=2.0 * J2)

    def derivative(_: float, x: Array) -> Array:
        r, z = float(np.linalg.norm(x[:3])), x[2]
        share = 1.5 * J2 * (EARTH_RADIUS / r) ** 2
        height = 5.0 * (z / r) ** 2
        pull = 1.0 + share * (np.array([1.0, 1.0, 3.0]) - height)
        return np.concatenate([x[3:], -MU / r**3 * x[:3] * pull])

    solution = solve_ivp(
        derivative, (0.0, last), start, method="DOP853", rtol=1e-13, atol=1e-7, t_eval=[last]
    )
    flown = np.concatenate([state.orbit_position, state.orbit_velocity])
    np.testing.assert_allclose(flown[:3], solution.y[:3, -1], rtol=0, atol=1e-3)
    np.testing.assert_allclose(flown[3:], solution.y[3:, -1], rtol=0, atol=1e-6)
