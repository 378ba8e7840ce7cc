"""Targets that fall freely: Hill's equations, SciPy, and the plant with the same body in it."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from meeting_targets import circular_orbit, free_path, meeting_target, target_of, tensor_of, tumbled
from numpy.typing import ArrayLike, NDArray
from oracles import quaternion_of, rotation_of
from orbiting_robots import (
    EARTH_RADIUS,
    coast,
    mean_motion,
    orbiting_plant,
    rigid_robot,
    set_motion,
)
from scipy.spatial.transform import Rotation

from space_robot_model.orbit.elements import state_of
from space_robot_msgs_py.errors import InputError
from space_robot_sim.environment.neighbouring_orbit import fall, hill_axes, meet
from space_robot_sim.environment.orbit_settings import OrbitSettings
from space_robot_sim.environment.target import Target

Array = NDArray[np.float64]

HEIGHT = 420e3
N = mean_motion(EARTH_RADIUS + HEIGHT)
"""rad/s."""
ORBIT = circular_orbit(HEIGHT, j2=False)
ORBIT_S = 2.0 * np.pi / N
ECCENTRIC = {
    "height": 17.7e6,
    "eccentricity": 0.7,
    "inclination_deg": 28.0,
    "perigee_deg": 60.0,
    "anomaly_deg": 10.0,
}
UNIT = st.floats(-1.0, 1.0)
SPEEDS = (0.05, 1.0, 5.0)
"""rad/s."""


def axes_after(orbit: OrbitSettings, time: float) -> Array:
    """Return radial, along, normal (3, 3) as columns of a circular orbit."""
    r, v = state_of(orbit.orbital_elements)
    x, z = r / np.linalg.norm(r), np.cross(r, v) / np.linalg.norm(np.cross(r, v))
    turned = Rotation.from_rotvec(N * time * z).apply(x)
    return np.column_stack([turned, np.cross(z, turned), z])


def clohessy_wiltshire(position: ArrayLike, velocity: ArrayLike, time: float) -> Array:
    """Return position and velocity (6,): radial, along the path, along the normal."""
    (x, y, z), (u, v, w) = np.asarray(position), np.asarray(velocity)
    s, c, t = np.sin(N * time), np.cos(N * time), N * time
    return np.array(
        [
            (4.0 - 3.0 * c) * x + s / N * u + 2.0 / N * (1.0 - c) * v,
            6.0 * (s - t) * x + y - 2.0 / N * (1.0 - c) * u + (4.0 * s - 3.0 * t) / N * v,
            c * z + s / N * w,
            3.0 * N * s * x + c * u + 2.0 * s * v,
            6.0 * N * (c - 1.0) * x - 2.0 * s * u + (4.0 * c - 3.0) * v,
            -N * s * z + c * w,
        ]
    )


def on_hills_axes(target: Target, time: float) -> Array:
    """Return position and velocity (6,) of a target on and against the turning axes."""
    meeting, axes = meet(target, ORBIT, time), axes_after(ORBIT, time)
    position, velocity = meeting.position @ axes, meeting.motion.velocity @ axes
    return np.concatenate([position, velocity - np.cross([0.0, 0.0, N], position)])


@given(st.tuples(UNIT, UNIT, UNIT), st.tuples(UNIT, UNIT, UNIT), st.floats(1e3, 1e9))
def test_axes_are_radial_along_the_path_and_normal(
    radial: tuple[float, ...], motion: tuple[float, ...], size: float
) -> None:
    position, velocity = size * np.array(radial), 1e-3 * size * np.array(motion)
    if np.linalg.norm(np.cross(radial, motion)) < 1e-2:
        return
    axes = hill_axes(position, velocity)
    np.testing.assert_allclose(axes.T @ axes, np.eye(3), atol=1e-14)
    np.testing.assert_allclose(np.cross(axes[:, 0], axes[:, 1]), axes[:, 2], atol=1e-14)
    np.testing.assert_allclose(
        position @ axes, [np.linalg.norm(position), 0.0, 0.0], atol=1e-13 * size
    )
    along, normal = (velocity @ axes)[1:]
    assert along > 0.0
    assert abs(normal) < 1e-15 * size


@pytest.mark.parametrize("orbits", [0.01, 0.3, 1.0])
def test_a_drift_is_that_of_hills_equations(orbits: float) -> None:
    """What differs falls with the square of the distance, and is a few times d^2 / R."""
    time = orbits * ORBIT_S
    position, velocity = np.array([1.0, -2.0, 1.5]), N * np.array([1.0, 2.0, -1.0])
    differences, paths = [], []
    for size in (100.0, 1000.0):
        start = size * position, size * velocity
        target = target_of(position=start[0].tolist(), velocity=start[1].tolist())
        expected = clohessy_wiltshire(*start, time)
        difference = on_hills_axes(target, time) - expected
        differences.append(np.linalg.norm(difference[:3]))
        differences.append(np.linalg.norm(difference[3:]) / N)
        paths.append(float(np.linalg.norm(expected[:3])))
    longest = max(np.linalg.norm(1000.0 * position), paths[1])
    assert differences[2] / differences[0] == pytest.approx(100.0, rel=0.02)
    assert differences[3] / differences[1] == pytest.approx(100.0, rel=0.02)
    assert max(differences[2:]) < 10.0 * longest**2 / (EARTH_RADIUS + HEIGHT)


def test_a_target_that_stands_ahead_on_the_same_path_stays_there() -> None:
    """Its path is the reference point's, a little later; it turns once in an orbit."""
    ahead = 200.0 / (EARTH_RADIUS + HEIGHT)
    radius = EARTH_RADIUS + HEIGHT
    start = [radius * (np.cos(ahead) - 1.0), radius * np.sin(ahead), 0.0]
    for time in (0.0, 0.2 * ORBIT_S, 0.9 * ORBIT_S):
        found = on_hills_axes(target_of(position=start), time)
        np.testing.assert_allclose(found[:3], start, rtol=0.0, atol=1e-6)
        np.testing.assert_allclose(found[3:], 0.0, rtol=0.0, atol=1e-9)


@pytest.mark.parametrize("time", [0.0, 700.0])
def test_the_velocity_is_that_of_the_position(time: float) -> None:
    """Against what does not turn; also at tick 0, where it is given against turning axes."""
    orbit = circular_orbit(HEIGHT)
    motion = {"position": [30.0, -20.0, 10.0], "velocity": [0.1, 0.05, -0.2]}
    before, now, after = (meet(target_of(**motion), orbit, time + dt) for dt in (0.0, 0.5, 1.0))
    mean = after.position - before.position
    np.testing.assert_allclose(now.motion.velocity, mean, rtol=0.0, atol=1e-6)
    assert now.motion.relative_to == "inertial"


def test_at_tick_0_it_is_where_it_was_put() -> None:
    orbit = circular_orbit(HEIGHT)
    turn = Rotation.from_rotvec([0.4, -1.2, 2.0])
    target = target_of(
        position=[3.0, 4.0, -5.0],
        velocity=[0.1, 0.2, 0.3],
        quaternion=(2.0 * quaternion_of(turn)).tolist(),
        angular_velocity=[0.01, -0.02, 0.03],
        reach=0.7,
    )
    meeting, axes = meet(target, orbit, 0.0), axes_after(orbit, 0.0)
    np.testing.assert_allclose(meeting.position, axes @ [3.0, 4.0, -5.0], atol=1e-14)
    velocity = np.array([0.1, 0.2, 0.3]) + np.cross([0.0, 0.0, N], [3.0, 4.0, -5.0])
    np.testing.assert_allclose(meeting.motion.velocity, axes @ velocity, atol=1e-15)
    omega = turn.apply([0.01, -0.02, 0.03])
    np.testing.assert_allclose(meeting.motion.angular_velocity, omega, atol=1e-16)
    assert meeting.reach == 0.7


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
    point = free_path(r, v, time, has_j2)
    other = free_path(r + start, v + speed + np.cross(rate, start), time, has_j2)
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
        "quaternion": quaternion_of(turn).tolist(),
        "angular_velocity": omega,
    }
    target = Target.from_dict({"target": {**content, "motion": motion}})
    meeting = meet(target, orbit, ticks * period)
    assert np.linalg.norm(meeting.position - axes @ start) > 50.0
    np.testing.assert_allclose(meeting.position, state.base_position, rtol=0.0, atol=1e-6)
    np.testing.assert_allclose(meeting.motion.velocity, state.base_velocity, rtol=0.0, atol=1e-8)
    spun = rotation_of(state.quaternion).apply(state.omega_base)
    assert np.linalg.norm(spun - turn.apply(omega)) > 1e-3
    np.testing.assert_allclose(meeting.motion.angular_velocity, spun, rtol=0.0, atol=1e-8)


@pytest.mark.parametrize("time", [60.0, 900.0])
def test_it_tumbles_under_the_gravity_gradient_as_scipy_says(time: float) -> None:
    target = target_of(quaternion=[0.5, -0.1, 0.7, 0.4], angular_velocity=[2e-3, -1e-3, 1.5e-3])
    point = np.concatenate(state_of(ORBIT.orbital_elements))
    inertia, motion = tensor_of(target), target.motion
    q, w = tumbled(inertia, motion.quaternion, motion.angular_velocity, point, time)
    found = np.array(meet(target, ORBIT, time).motion.angular_velocity)
    np.testing.assert_allclose(found, rotation_of(q).apply(w), rtol=0.0, atol=1e-9)
    # so large is what the gradient does
    nowhere = np.array([1e12, 0.0, 0.0, 0.0, 0.0, 0.0])
    q, w = tumbled(inertia, motion.quaternion, motion.angular_velocity, nowhere, time)
    assert np.linalg.norm(found - rotation_of(q).apply(w)) > 1e-8 * time


@pytest.mark.parametrize("speed", SPEEDS)
def test_far_from_the_earth_it_keeps_energy_and_angular_momentum(speed: float) -> None:
    """To 1e-5 after 10 s, however fast it tumbles; its attitude is SciPy's."""
    far, time = circular_orbit(9e8, j2=False), 10.0
    direction = np.array([0.5, 0.3, -0.8])
    omega = speed * direction / np.linalg.norm(direction)
    target = target_of(quaternion=[0.5, -0.1, 0.7, 0.4], angular_velocity=omega.tolist())
    inertia = tensor_of(target)
    point = np.concatenate(state_of(far.orbital_elements))
    q, w = tumbled(inertia, target.motion.quaternion, omega, point, time)
    found = np.array(meet(target, far, time).motion.angular_velocity)
    own = rotation_of(q).inv().apply(found)
    np.testing.assert_allclose(own, w, rtol=0.0, atol=1e-5 * speed)
    assert own @ inertia @ own == pytest.approx(omega @ inertia @ omega, rel=1e-5)
    momentum = rotation_of(target.motion.quaternion).apply(inertia @ omega)
    kept = rotation_of(q).apply(inertia @ own)
    np.testing.assert_allclose(kept, momentum, rtol=0.0, atol=1e-5 * np.linalg.norm(momentum))


def test_a_linear_correction_brings_it_anywhere() -> None:
    orbit = circular_orbit(HEIGHT)
    target = meeting_target(orbit, 60.0, [1.0, -2.0, 0.5], velocity=[0.01, -0.02, 0.0])
    np.testing.assert_allclose(meet(target, orbit, 60.0).position, [1.0, -2.0, 0.5], atol=1e-7)


@pytest.mark.parametrize(
    "motion",
    [
        {"position": [2e6, -1e6, 1e6]},
        {"velocity": [900.0, -900.0, 900.0]},
        {"angular_velocity": [3.0, -2.0, 4.0]},
    ],
)
def test_whatever_a_file_may_say_can_be_followed(motion: dict[str, list[float]]) -> None:
    """Limits are those of what is given: on its way a target may be faster."""
    meeting = meet(target_of(**motion), ORBIT, 20.0)
    assert np.isfinite(meeting.position).all()
    assert np.isfinite(meeting.motion.velocity).all()
    assert np.isfinite(meeting.motion.angular_velocity).all()


def test_what_turns_too_fast_is_refused_in_one_line() -> None:
    with pytest.raises(InputError, match=r"target 'drifter': motion\.angular_velocity: ") as caught:
        meet(target_of(angular_velocity=[900.0, 0.0, 1.0]), ORBIT, 1000.0)
    assert "\n" not in str(caught.value)


def test_without_an_orbit_it_is_refused_in_one_line() -> None:
    with pytest.raises(InputError, match=r"motion\.relative_to orbit needs an orbit: ") as caught:
        meet(target_of(), OrbitSettings(), 1.0)
    assert "target 'drifter'" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_the_path_is_that_of_what_is_met() -> None:
    """At each time, on the way of one integration."""
    orbit = circular_orbit(HEIGHT, j2=True)
    motion = {"velocity": [0.1, -0.2, 0.05], "angular_velocity": [0.02, -0.03, 0.01]}
    target = target_of(position=[10.0, -20.0, 5.0], **motion)
    times = np.array([0.0, 0.5, 30.0, 31.0, 400.0])
    positions, quaternions = fall(target, orbit, times)
    inertia = tensor_of(target)
    path = np.concatenate(state_of(orbit.orbital_elements))
    for time, position, quaternion in zip(times, positions, quaternions, strict=True):
        meeting = meet(target, orbit, float(time))
        np.testing.assert_allclose(position, meeting.position, atol=1e-6)
        due, _ = tumbled(
            inertia, target.motion.quaternion, target.motion.angular_velocity, path, float(time)
        )
        away = rotation_of(due).inv() * rotation_of(quaternion)
        assert away.magnitude() < 1e-4
