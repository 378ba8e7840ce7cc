"""Elements, gravity and the flight software's propagation against SciPy and 50 digits."""

from __future__ import annotations

from decimal import Decimal, localcontext

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from oracles.orbit import DIGITS, EARTH_RADIUS, MU, exact, fall, free_path
from pydantic import ValidationError
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation

from space_robot_model.orbit.elements import ElementSettings, state_of, sun_of
from space_robot_model.orbit.ephemeris import AssumedOrbit, Ephemeris

ANGLE = st.floats(-360.0, 360.0)


@settings(max_examples=150)
@given(st.floats(300e3, 4e7), st.floats(0.0, 0.95), st.floats(0.0, 180.0), ANGLE, ANGLE, ANGLE)
def test_state_of_agrees_with_keplers_equation_and_rotation_matrices(
    perigee: float, e: float, inclination: float, raan: float, argument: float, mean: float
) -> None:
    a = (EARTH_RADIUS + perigee) / (1.0 - e)
    elements = ElementSettings(
        height=a - EARTH_RADIUS,
        eccentricity=e,
        inclination_deg=inclination,
        raan_deg=raan,
        perigee_deg=argument,
        anomaly_deg=mean,
    )
    anomaly = np.radians(mean)
    eccentric = brentq(
        lambda x: x - e * np.sin(x) - anomaly, anomaly - 1.0, anomaly + 1.0, xtol=1e-15, rtol=1e-15
    )
    true = 2.0 * np.arctan2(
        np.sqrt(1.0 + e) * np.sin(eccentric / 2.0), np.sqrt(1.0 - e) * np.cos(eccentric / 2.0)
    )
    parameter = a * (1.0 - e**2)
    radius = parameter / (1.0 + e * np.cos(true))
    turn = Rotation.from_euler("ZXZ", [raan, inclination, argument], degrees=True)
    position = turn.apply(radius * np.array([np.cos(true), np.sin(true), 0.0]))
    speed = np.sqrt(MU / parameter)
    velocity = turn.apply(speed * np.array([-np.sin(true), e + np.cos(true), 0.0]))
    r, v = state_of(elements)
    loss = 1e-14 / (1.0 - e) ** 2  # of the anomaly's digits, near the perigee
    np.testing.assert_allclose(r, position, rtol=0, atol=(1e-14 + loss) * 2.0 * a)
    np.testing.assert_allclose(v, velocity, rtol=0, atol=(1e-14 + loss) * speed * (1.0 + e) * 10.0)


def test_an_orbit_through_the_earth_is_refused() -> None:
    with pytest.raises(ValidationError, match="perigee must be outside"):
        ElementSettings(height=1000e3, eccentricity=0.2)


@given(st.floats(0.0, 180.0), ANGLE, st.floats(-90.0, 90.0), ANGLE)
def test_the_sun_stands_above_the_orbit_and_at_noon(
    inclination: float, raan: float, beta: float, noon: float
) -> None:
    """From the node along the orbit, then by the beta angle towards the normal."""
    sun = sun_of(ElementSettings(inclination_deg=inclination, raan_deg=raan), beta, noon)
    plane = Rotation.from_euler("ZXZ", [raan, inclination, noon], degrees=True)
    b = np.radians(beta)
    expected = plane.apply([np.cos(b), 0.0, np.sin(b)])
    np.testing.assert_allclose(sun, expected, rtol=0, atol=1e-14)
    assumed = {"inclination_deg": inclination, "raan_deg": raan}
    known = ephemeris(orbital_elements=ISS | assumed, beta_angle_deg=beta, noon_deg=noon)
    np.testing.assert_array_equal(known.sun, sun)


ISS = {"height": 420e3, "inclination_deg": 51.6, "raan_deg": 30.0, "anomaly_deg": 200.0}
GTO = {"height": 18e6, "eccentricity": 0.72, "inclination_deg": 7.0, "anomaly_deg": -10.0}
TARGET = {"name": "target", "position": [30.0, -50.0, 20.0], "velocity": [0.01, 0.03, -0.02]}


def ephemeris(**settings: object) -> Ephemeris:
    """Return an ephemeris, by default of a station's orbit."""
    return Ephemeris(AssumedOrbit.model_validate({"orbital_elements": ISS, **settings}))


def period(elements: dict[str, float]) -> float:
    """Return the time of an orbit, s."""
    return float(2.0 * np.pi * np.sqrt((EARTH_RADIUS + elements["height"]) ** 3 / MU))


@settings(max_examples=60)
@given(st.floats(200e3, 4e7), st.floats(0.0, 180.0), st.floats(0.0, 20_000.0), st.booleans())
def test_acceleration_and_jerk_are_those_of_gravity_at_the_place(
    height: float, inclination: float, time: float, j2: bool
) -> None:
    """By decimal numbers, the jerk by central differences along the velocity."""
    elements = {"height": height, "inclination_deg": inclination, "anomaly_deg": 77.0}
    motion = ephemeris(orbital_elements=elements, j2=j2).motion(np.array([time]))
    r, v = motion.position[0], motion.velocity[0]
    with localcontext() as context:
        context.prec, step = DIGITS, Decimal("1e-15")
        at, aside = exact(r), step * exact(v)
        gravity = fall(at, j2).astype(float)
        rate = ((fall(at + aside, j2) - fall(at - aside, j2)) / (2 * step)).astype(float)
    atol = 1e-15 * np.linalg.norm(gravity)
    np.testing.assert_allclose(motion.acceleration[0], gravity, rtol=0, atol=atol)
    np.testing.assert_allclose(motion.jerk[0], rate, rtol=0, atol=2e-15 * np.linalg.norm(rate))


def test_the_motion_is_the_same_to_the_bit_in_whatever_order_it_is_asked_for() -> None:
    times = np.linspace(0.0, 3000.0, 1001)
    whole, parts = ephemeris(target=TARGET), ephemeris(target=TARGET)
    expected = np.array(whole.motion(times, of_target=True))
    for chunk in (slice(0, 7), slice(400, 500), slice(7, 400), slice(500, None)):
        got = np.array(parts.motion(times[chunk], of_target=True))
        np.testing.assert_array_equal(got, expected[:, chunk])


def test_before_tick_0_it_is_where_it_is_then() -> None:
    known = ephemeris()
    np.testing.assert_array_equal(known.motion(np.array([-5.0])), known.motion(np.zeros(1)))
    assert known.motion(np.empty(0)).position.shape == (0, 3)


def test_errors_are_on_the_orbits_axes() -> None:
    errors = {"radial": 3.0, "along": -200.0, "normal": 40.0}
    rates = {"radial_velocity": 0.1, "along_velocity": -0.2, "normal_velocity": 0.3}
    start = np.zeros(1)
    right, wrong = ephemeris().motion(start), ephemeris(errors=errors | rates).motion(start)
    r, v = right.position[0], right.velocity[0]
    normal = np.cross(r, v) / np.linalg.norm(np.cross(r, v))
    axes = np.column_stack([r / np.linalg.norm(r), v / np.linalg.norm(v), normal])
    place, motion = wrong.position[0] - r, wrong.velocity[0] - v
    np.testing.assert_allclose(place @ axes, [3.0, -200.0, 40.0], rtol=0, atol=1e-8)
    np.testing.assert_allclose(motion @ axes, [0.1, -0.2, 0.3], rtol=0, atol=1e-11)


@pytest.mark.parametrize(("elements", "has_j2", "atol"), [(ISS, True, 1e-5), (GTO, False, 1e-3)])
def test_an_orbit_and_a_target_beside_it_agree_with_scipy(
    elements: dict[str, float], has_j2: bool, atol: float
) -> None:
    known = ephemeris(orbital_elements=elements, target=TARGET, j2=has_j2)
    times = np.linspace(0.0, period(elements), 200)
    r, v = state_of(known.assumed.orbital_elements)
    expected = free_path(r, v, times, has_j2)
    place, speed = np.array(TARGET["position"]), np.array(TARGET["velocity"])
    apart = free_path(r + place, v + speed, times, has_j2) - expected
    motions = known.motion(times), known.motion(times, of_target=True)
    for motion, path in zip(motions, (expected, apart), strict=True):
        np.testing.assert_allclose(motion.position, path[:, :3], rtol=0, atol=atol)
        np.testing.assert_allclose(motion.velocity, path[:, 3:], rtol=0, atol=1e-3 * atol)
