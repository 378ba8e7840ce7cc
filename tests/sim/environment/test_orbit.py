"""Orbits of the plant, air, light and magnetic field at a place, against formulas written out."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import ArrayLike, NDArray
from orbiting_robots import (
    EARTH_RADIUS,
    EARTH_RATE,
    KEPLER,
    MU,
    coast,
    mean_motion,
    orbiting_plant,
    rigid_robot,
    set_motion,
    set_orbit,
)
from scipy.spatial.transform import Rotation

from space_robot_sim.environment.orbit import Orbit, density_at, magnetic_field
from space_robot_sim.environment.orbit_settings import OrbitSettings
from space_robot_sim.plant.plant import Plant

Array = NDArray[np.float64]

ROBOT = rigid_robot(
    20.0,
    [1.0, 1.0, 1.0],
    plates=[{"area": 2.0, "normal": [0.0, 0.0, side]} for side in (1.0, -1.0)],
)
"""With a disk that the Sun shines on wherever it is, but in the disk's plane."""
ANGLE = st.floats(-360.0, 360.0)
FIELD = {"strength": 2.98e-5, "tilt_deg": 9.41, "pole_deg": -72.68}


def orbit_of(**groups: Any) -> Orbit:
    """Return the record of settings by group, on a circular orbit at 400 km."""
    elements = {"orbital_elements": {"height": 400e3}}
    return Orbit.build(6, OrbitSettings.model_validate({**elements, **groups}))


@pytest.mark.parametrize("e", [0.0, 0.3, 0.7])
def test_an_orbit_returns_after_its_period_with_its_energy(e: float) -> None:
    """``2 pi sqrt(a^3 / mu)`` and ``-mu / (2 a)``; the integrator's steps are those of an orbit."""
    a = (EARTH_RADIUS + 300e3) / (1.0 - e)
    elements = {"height": a - EARTH_RADIUS, "eccentricity": e, "inclination_deg": 30.0}
    ticks = round(6000.0 / (1.0 - e) ** 1.5)
    period = 2.0 * np.pi / mean_motion(a) / ticks
    plant = orbiting_plant(ROBOT, period, orbital_elements=elements)
    start = plant.truth.copy()
    energies = []
    for _ in range(10):
        state = coast(plant, ticks // 10)
        v, r = state.orbit_velocity, state.orbit_position
        energies.append(0.5 * v @ v - MU / np.linalg.norm(r))
    np.testing.assert_allclose(energies, -0.5 * MU / a, rtol=1e-11)
    state = coast(plant, ticks - plant.tick)
    np.testing.assert_allclose(state.orbit_position, start.orbit_position, rtol=0, atol=1e-2)
    np.testing.assert_allclose(state.orbit_velocity, start.orbit_velocity, rtol=0, atol=1e-5)


@settings(max_examples=60)
@given(st.floats(100e3, 4e7), st.floats(10e3, 300e3))
def test_density_is_exponential(height: float, scale: float) -> None:
    air = {"density": 3.725e-12, "at_height": 400e3, "scale_height": scale}
    expected = 3.725e-12 * np.exp(-(height - 400e3) / scale)
    assert density_at(orbit_of(atmosphere=air), EARTH_RADIUS + height) == pytest.approx(
        expected, rel=1e-12, abs=1e-300
    )


def field(position: ArrayLike, time: float = 0.0, **magnetism: float) -> Array:
    """Return the field (3,) at a place, T."""
    out = np.empty(3)
    magnetic_field(orbit_of(magnetism={**FIELD, **magnetism}), np.array(position), time, out)
    return out


def test_an_upright_dipole_at_equator_and_poles() -> None:
    """North at the equator, into the ground at the north pole and twice as strong there."""
    strength, r = 2.98e-5, EARTH_RADIUS
    upright = {"tilt_deg": 0.0}
    np.testing.assert_allclose(field([r, 0.0, 0.0], **upright), [0.0, 0.0, strength], atol=1e-20)
    np.testing.assert_allclose(field([0.0, r, 0.0], **upright), [0.0, 0.0, strength], atol=1e-20)
    for side in (r, -r):
        np.testing.assert_allclose(
            field([0.0, 0.0, side], **upright), [0.0, 0.0, -2.0 * strength], atol=1e-20
        )
    np.testing.assert_allclose(
        field([2.0 * r, 0.0, 0.0], **upright), [0.0, 0.0, strength / 8.0], atol=1e-20
    )


def test_the_field_is_the_dipole_of_the_geomagnetic_reference_field() -> None:
    """Degree one of IGRF-13 in 2020; its radius is 6371.2 km, so that 2.98e-5 T is 0.3 % more.

    ``B = (a / r)^3 (3 (G . u) u - G)``, ``G = (g11, h11, g10)``, Greenwich at right ascension 0.
    """
    coefficients = 1e-9 * np.array([-1450.9, 4652.5, -29404.8])
    rng = np.random.default_rng(13)
    for _ in range(20):
        u = rng.normal(size=3)
        u /= np.linalg.norm(u)
        distance = EARTH_RADIUS + rng.uniform(300e3, 2e6)
        expected = (6371.2e3 / distance) ** 3 * (3.0 * coefficients @ u * u - coefficients)
        size = np.linalg.norm(expected)
        np.testing.assert_allclose(field(distance * u), expected, rtol=0, atol=4e-3 * size)
        strength = np.linalg.norm(coefficients) * (6371.2e3 / EARTH_RADIUS) ** 3
        exactly = field(distance * u, strength=strength)
        np.testing.assert_allclose(exactly, expected, rtol=0, atol=1e-4 * size)  # digits of degrees


@given(st.floats(0.0, 1e6))
def test_the_field_turns_with_the_earth(time: float) -> None:
    place = np.array([4e6, -3e6, 5e6])
    turn = Rotation.from_euler("z", EARTH_RATE * time)
    np.testing.assert_allclose(
        field(turn.apply(place), time), turn.apply(field(place)), rtol=0, atol=1e-17
    )


def test_the_robot_measures_the_field_on_its_axes_and_its_dipole_feels_it() -> None:
    moment = [0.3, -0.2, 0.5]
    settings = {
        "orbital_elements": {"height": 400e3, "inclination_deg": 60.0, "anomaly_deg": 50.0},
        "initial_quaternion": [0.3, -0.8, 0.4, 0.2],
        "magnetism": {**FIELD, "residual_dipole": moment},
    }
    plant = orbiting_plant(ROBOT, 0.5, **settings)
    set_motion(plant, omega=[0.01, -0.02, 0.015])
    state = coast(plant, 200)
    turn = Rotation.from_quat(np.roll(state.quaternion, -1))
    expected = field(state.orbit_position, 100.0)
    np.testing.assert_allclose(turn.apply(state.magnetic_field), expected, rtol=0, atol=1e-18)
    np.testing.assert_allclose(
        state.external_torques[9:], np.cross(turn.apply(moment), expected), rtol=0, atol=1e-17
    )


def sunlit(semi_major_axis: float, angle: float, **sunlight: float) -> bool:
    """Return whether the Sun shines at an angle from noon in an equatorial orbit, rad."""
    light = {"pressure": 4.56e-6, **sunlight}
    elements = {"height": semi_major_axis - EARTH_RADIUS}
    plant = orbiting_plant(
        ROBOT, 1.0, orbital_elements=elements, sunlight=light, initial_quaternion=[0.8, 0.3, 0.5, 0]
    )
    noon = np.radians(sunlight.get("noon_deg", 0.0))
    place = [np.cos(noon + angle), np.sin(noon + angle), 0.0]
    set_orbit(plant, semi_major_axis * np.array(place), [0.0, 0.0, 0.0])
    return bool(np.any(plant.memory.environment.surfaces.sunlight[3:]))


@pytest.mark.parametrize("beta", [0.0, 30.0, -50.0])
def test_the_shadow_begins_where_the_earths_cylinder_is(beta: float) -> None:
    """``cos u = -sqrt(1 - (R_E / r)^2) / cos(beta)`` from noon, as a triangle shows."""
    a = EARTH_RADIUS + 700e3
    entry = np.arccos(-np.sqrt(1.0 - (EARTH_RADIUS / a) ** 2) / np.cos(np.radians(beta)))
    for side in (1.0, -1.0):
        for angle, expected in ((entry - 1e-9, True), (entry + 1e-9, False), (np.pi, False)):
            assert sunlit(a, side * angle, beta_angle_deg=beta, noon_deg=25.0) is expected
    assert sunlit(a, 0.0, beta_angle_deg=beta)


def test_there_is_no_shadow_where_the_sun_stands_high_above_the_orbit() -> None:
    a = EARTH_RADIUS + 700e3
    limit = np.degrees(np.arcsin(EARTH_RADIUS / a))
    assert sunlit(a, np.pi, beta_angle_deg=limit + 1e-6)
    assert not sunlit(a, np.pi, beta_angle_deg=limit - 1e-6)


def air_speed(plant: Plant) -> Array:
    """Return the velocity against the air at the present tick, m/s."""
    return np.array(plant.memory.environment.orbit.wind)


def test_the_air_turns_with_the_earth() -> None:
    """``V + v - w x (R + d)`` of the base's centre of mass."""
    air = {"density": 1e-12}
    elements = {"height": 400e3, "inclination_deg": 60.0, "anomaly_deg": 77.0}
    plant = orbiting_plant(ROBOT, 1.0, orbital_elements=elements, atmosphere=air, gravity=KEPLER)
    place, motion = np.array([50.0, -80.0, 20.0]), np.array([3.0, 2.0, -1.0])
    set_motion(plant, position=place, velocity=motion)
    state = plant.truth
    turning = np.cross([0.0, 0.0, EARTH_RATE], state.orbit_position + place)
    expected = state.orbit_velocity + motion - turning
    np.testing.assert_allclose(air_speed(plant), expected, rtol=0, atol=1e-11)
