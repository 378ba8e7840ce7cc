"""Keplerian elements and the Sun's direction, against formulas written out."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from orbiting_robots import EARTH_RADIUS, MU
from pydantic import ValidationError
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation

from space_robot_model.orbit.elements import ElementSettings, state_of, sun_of

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
