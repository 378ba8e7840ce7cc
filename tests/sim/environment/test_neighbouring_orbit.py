"""Targets that fall freely: Hill's equations, SciPy, and the plant with the same body in it."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from oracles import quaternion_of, rotation_of
from oracles.orbit import EARTH_RADIUS, MU, free_path, tumbled
from robots import (
    circular_orbit,
    coast,
    orbiting_plant,
    rigid_robot,
    set_motion,
    target_of,
    tensor_of,
)
from scipy.spatial.transform import Rotation

from space_robot_model.orbit.elements import state_of
from space_robot_msgs_py.errors import InputError
from space_robot_sim.environment.neighbouring_orbit import fall, hill_axes, meet
from space_robot_sim.environment.orbit_settings import OrbitSettings
from space_robot_sim.environment.target import Target

Array = NDArray[np.float64]
HEIGHT = 420e3
N = np.sqrt(MU / (EARTH_RADIUS + HEIGHT) ** 3)
"""rad/s."""
ORBIT = circular_orbit(HEIGHT, j2=False)
ECCENTRIC = {
    "height": 17.7e6,
    "eccentricity": 0.7,
    "inclination_deg": 28.0,
    "perigee_deg": 60.0,
    "anomaly_deg": 10.0,
}


def axes_after(orbit: OrbitSettings, time: float) -> Array:
    """Return radial, along, normal (3, 3) as columns of a circular orbit."""
    r, v = state_of(orbit.orbital_elements)
    x, z = r / np.linalg.norm(r), np.cross(r, v) / np.linalg.norm(np.cross(r, v))
    turned = Rotation.from_rotvec(N * time * z).apply(x)
    return np.column_stack([turned, np.cross(z, turned), z])


@pytest.mark.parametrize("has_j2", [False, True])
def test_on_an_eccentric_orbit_it_is_scipys_path_less_the_points(has_j2: bool) -> None:
    """The axes turn with the true anomaly there; positions of 1e7 m are rounded to 1e-9 m."""
    orbit = OrbitSettings.model_validate({"orbital_elements": ECCENTRIC, "gravity": {"j2": has_j2}})
    r, v = state_of(orbit.orbital_elements)
    axes, time = hill_axes(r, v), 1500.0
    rate = np.cross(r, v) / (r @ r)
    start, speed = axes @ [2e3, -3e3, 1e3], axes @ [1.0, -2.0, 0.5]
    target = target_of(position=[2e3, -3e3, 1e3], velocity=[1.0, -2.0, 0.5])
    meeting = meet(target, orbit, time)
    (point,) = free_path(r, v, time, has_j2)
    (other,) = free_path(r + start, v + speed + np.cross(rate, start), time, has_j2)
    assert np.linalg.norm(other[:3] - point[:3]) > 1e3
    np.testing.assert_allclose(meeting.position, (other - point)[:3], rtol=0.0, atol=1e-5)
    np.testing.assert_allclose(meeting.motion.velocity, (other - point)[3:], rtol=0.0, atol=1e-8)


@pytest.mark.parametrize("has_j2", [False, True])
def test_the_plant_flies_the_same_body_to_the_same_place(has_j2: bool) -> None:
    """A rigid robot, put and spun as the target: 10 minutes at steps of 50 ms."""
    orbit, period, ticks = circular_orbit(HEIGHT, j2=has_j2), 0.05, 12_000
    turn, principal = Rotation.from_rotvec([0.4, -1.2, 2.0]), [6.0, 5.0, 4.0]
    omega, start, speed = [0.02, 0.01, -0.03], [120.0, -70.0, 40.0], [0.1, -0.2, 0.15]
    plant = orbiting_plant(
        rigid_robot(80.0, principal),
        period,
        initial_quaternion=quaternion_of(turn).tolist(),
        **orbit.model_dump(),
    )
    axes = axes_after(orbit, 0.0)
    velocity = axes @ (np.array(speed) + np.cross([0.0, 0.0, N], start))
    set_motion(plant, axes @ start, velocity, turn.apply(omega))
    state = coast(plant, ticks)
    content = {"name": "same", "mass": 80.0, "inertia": [*principal, 0.0, 0.0, 0.0]}
    motion = {
        "relative_to": "orbit",
        "position": start,
        "velocity": speed,
        "quaternion": (2.0 * quaternion_of(turn)).tolist(),
        "angular_velocity": omega,
        "reach": 0.7,
    }
    target = Target.from_dict({"target": {**content, "motion": motion}})
    meeting = meet(target, orbit, ticks * period)
    assert np.linalg.norm(meeting.position - axes @ start) > 50.0
    np.testing.assert_allclose(meeting.position, state.base_position, rtol=0.0, atol=1e-6)
    np.testing.assert_allclose(meeting.motion.velocity, state.base_velocity, rtol=0.0, atol=1e-8)
    spun = rotation_of(state.quaternion).apply(state.omega_base)
    assert np.linalg.norm(spun - turn.apply(omega)) > 1e-3
    np.testing.assert_allclose(meeting.motion.angular_velocity, spun, rtol=0.0, atol=1e-8)
    assert meeting.reach == 0.7
    (point,) = free_path(*state_of(orbit.orbital_elements), ticks * period, has_j2)
    found = np.concatenate([state.orbit_position, state.orbit_velocity])
    np.testing.assert_allclose(found, point, rtol=1e-11)


@pytest.mark.parametrize(
    ("motion", "orbit", "said"),
    [
        ({"angular_velocity": [900.0, 0.0, 1.0]}, ORBIT, r"motion\.angular_velocity: "),
        ({}, OrbitSettings(), r"motion\.relative_to orbit needs an orbit: "),
    ],
)
def test_what_cannot_be_followed_is_refused_in_one_line(
    motion: dict[str, list[float]], orbit: OrbitSettings, said: str
) -> None:
    with pytest.raises(InputError, match=rf"target 'drifter': {said}") as caught:
        meet(target_of(**motion), orbit, 1000.0)
    assert "\n" not in str(caught.value)


def test_the_path_is_that_of_what_is_met() -> None:
    """At each time, on the way of one integration; its attitude is SciPy's."""
    orbit, times = circular_orbit(HEIGHT, j2=True), np.array([0.0, 0.5, 30.0, 31.0, 400.0])
    motion = {"velocity": [0.1, -0.2, 0.05], "angular_velocity": [0.02, -0.03, 0.01]}
    target = target_of(position=[10.0, -20.0, 5.0], **motion)
    positions, quaternions = fall(target, orbit, times)
    point, start = np.concatenate(state_of(orbit.orbital_elements)), target.motion
    spin = start.quaternion, start.angular_velocity, point
    for time, position, quaternion in zip(times.tolist(), positions, quaternions, strict=True):
        np.testing.assert_allclose(position, meet(target, orbit, time).position, atol=1e-6)
        due, _ = tumbled(tensor_of(target), *spin, time)
        assert (rotation_of(due).inv() * rotation_of(quaternion)).magnitude() < 1e-4
