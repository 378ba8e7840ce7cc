"""Flight software's propagation against Kepler's equation, SciPy and decimal numbers."""

from __future__ import annotations

from decimal import Decimal, localcontext

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from orbiting_robots import DIGITS, EARTH_RADIUS, J2, MU, exact, exact_gravity, plus
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from space_robot_model.orbit.elements import ElementSettings, state_of
from space_robot_model.orbit.ephemeris import AssumedOrbit, Ephemeris

Array = NDArray[np.float64]

ISS = {"height": 420e3, "inclination_deg": 51.6, "raan_deg": 30.0, "anomaly_deg": 200.0}
GTO = {"height": 18e6, "eccentricity": 0.72, "inclination_deg": 7.0, "anomaly_deg": -10.0}
TARGET = {"name": "target", "position": [30.0, -50.0, 20.0], "velocity": [0.01, 0.03, -0.02]}


def ephemeris(**settings: object) -> Ephemeris:
    """Return an ephemeris, by default of a station's orbit."""
    return Ephemeris(AssumedOrbit.model_validate({"orbital_elements": ISS, **settings}))


def period(elements: dict[str, float]) -> float:
    """Return the time of an orbit, s."""
    return float(2.0 * np.pi * np.sqrt((EARTH_RADIUS + elements["height"]) ** 3 / MU))


def fallen(start: Array, times: Array) -> Array:
    """Return states (T, 6) under gravity with J2, by SciPy."""

    def derivative(_: float, x: Array) -> Array:
        r = float(np.linalg.norm(x[:3]))
        pull = 1.5 * J2 * (EARTH_RADIUS / r) ** 2
        share = 1.0 + pull * (np.array([1.0, 1.0, 3.0]) - 5.0 * (x[2] / r) ** 2)
        return np.concatenate([x[3:], -MU / r**3 * x[:3] * share])

    span = (0.0, float(times[-1]))
    solution = solve_ivp(
        derivative, span, start, method="DOP853", rtol=1e-13, atol=1e-9, t_eval=times
    )
    return np.asarray(solution.y.T)


def test_an_orbit_with_j2_and_a_target_beside_it_agree_with_scipy() -> None:
    known = ephemeris(target=TARGET)
    times = np.linspace(0.0, period(ISS), 200)
    position, velocity = state_of(known.assumed.orbital_elements)
    start = np.concatenate((position, velocity))
    beside = np.concatenate((TARGET["position"], TARGET["velocity"]))  # type: ignore[arg-type]
    expected = fallen(start, times)
    apart = fallen(start + beside, times) - expected
    motion, target = known.motion(times), known.target_motion(times)
    np.testing.assert_allclose(motion.position, expected[:, :3], rtol=0, atol=1e-5)
    np.testing.assert_allclose(motion.velocity, expected[:, 3:], rtol=0, atol=1e-8)
    np.testing.assert_allclose(target.position, apart[:, :3], rtol=0, atol=1e-5)
    np.testing.assert_allclose(target.velocity, apart[:, 3:], rtol=0, atol=1e-8)


@pytest.mark.parametrize("elements", [ISS, GTO])
def test_without_j2_it_agrees_with_keplers_equation(elements: dict[str, float]) -> None:
    """The elements' state of a later mean anomaly, to the digits of the perigee's time."""
    known = ephemeris(orbital_elements=elements, j2=False)
    times = np.linspace(0.0, 1.5 * period(elements), 31)
    motion = known.motion(times)
    for k, time in enumerate(times):
        turned = elements["anomaly_deg"] + 360.0 * time / period(elements)
        later = elements | {"anomaly_deg": float(np.remainder(turned, 360.0))}
        position, velocity = state_of(ElementSettings.model_validate(later))
        np.testing.assert_allclose(motion.position[k], position, rtol=0, atol=1e-4)
        np.testing.assert_allclose(motion.velocity[k], velocity, rtol=0, atol=1e-7)


def test_a_circular_orbit_turns_with_the_mean_motion() -> None:
    motion = ephemeris(j2=False).motion(np.linspace(0.0, period(ISS), 5001))
    momentum = np.linalg.norm(np.cross(motion.position, motion.velocity), axis=1)
    rate = momentum / np.sum(motion.position**2, axis=1)
    np.testing.assert_allclose(rate, 2.0 * np.pi / period(ISS), rtol=1e-12)


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
        context.prec = DIGITS
        step = Decimal("1e-15")
        x, y, z = (step * part for part in exact(v))
        ahead = exact_gravity(plus(exact(r), (x, y, z)), j2)
        behind = exact_gravity(plus(exact(r), (-x, -y, -z)), j2)
        gravity = np.array([float(a) for a in exact_gravity(exact(r), j2)])
        rate = np.array([float((a - b) / (2 * step)) for a, b in zip(ahead, behind, strict=True)])
    atol = 1e-15 * np.linalg.norm(gravity)
    np.testing.assert_allclose(motion.acceleration[0], gravity, rtol=0, atol=atol)
    np.testing.assert_allclose(motion.jerk[0], rate, rtol=0, atol=2e-15 * np.linalg.norm(rate))


def test_position_velocity_and_acceleration_belong_together() -> None:
    """By central differences, at nodes and between them; a distance of 7000 km has 1e-9 m."""
    known, step = ephemeris(target=TARGET), 0.5
    times = np.linspace(995.0, 1025.0, 61)
    for motion in (known.motion, known.target_motion):
        ahead, here, behind = motion(times + step), motion(times), motion(times - step)
        for k, atol in enumerate((1e-8, 1e-9, 1e-12)):
            difference = (ahead[k] - behind[k]) / (2.0 * step)
            rate = here[k + 1]
            slack = atol + 1e-6 * step**2 * np.abs(rate).max()
            np.testing.assert_allclose(difference, rate, rtol=0, atol=slack)


def test_the_motion_is_the_same_to_the_bit_in_whatever_order_it_is_asked_for() -> None:
    times = np.linspace(0.0, 3000.0, 1001)
    whole, parts = ephemeris(target=TARGET), ephemeris(target=TARGET)
    expected = np.array(whole.target_motion(times))
    for chunk in (slice(0, 7), slice(400, 500), slice(7, 400), slice(500, None)):
        got = np.array(parts.target_motion(times[chunk]))
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


def test_the_sun_stands_where_the_settings_say() -> None:
    known = ephemeris(beta_angle_deg=25.0, noon_deg=70.0)
    plane = Rotation.from_euler("ZXZ", [30.0, 51.6, 70.0], degrees=True)
    beta = np.radians(25.0)
    expected = plane.apply([np.cos(beta), 0.0, np.sin(beta)])
    np.testing.assert_allclose(known.sun, expected, rtol=0, atol=1e-15)
