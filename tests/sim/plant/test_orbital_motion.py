"""Robots in orbit: what gravity gives and is told of it; targets met or missed."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from oracles import quaternion_of, rotation_of
from oracles.momenta import momentum
from oracles.orbit import (
    EARTH_RADIUS,
    MU,
    BodyMotion,
    body_motions,
    free_path,
    weight_torque,
    whole_momenta,
)
from paths import CONFIG
from robots import (
    ANGLES_DEG,
    MOTORS,
    NO_FRICTION,
    circular_orbit,
    coast,
    held_place,
    meeting_target,
    orbiting_plant,
    rigid_robot,
    set_motion,
    target_of,
    tensor_of,
)
from scipy.spatial.transform import Rotation
from strategies import random_quaternion, random_robot

from space_robot_model.elementary.matrices import Array
from space_robot_model.orbit.elements import state_of
from space_robot_model.robot import Robot
from space_robot_msgs_py.samples import RobotState
from space_robot_sim.environment.neighbouring_orbit import free_fall, hill_axes, target_state
from space_robot_sim.environment.orbit import OrbitSettings
from space_robot_sim.environment.target import Target
from space_robot_sim.plant.plant import Plant
from space_robot_sim.plant.tick import REPORT_TICKS

ROBOT = Robot.from_yaml(CONFIG / "robots/paper.yaml")


ELEMENTS = {"height": 420e3, "inclination_deg": 51.6, "raan_deg": 30.0, "anomaly_deg": 20.0}


@settings(max_examples=25)
@given(st.integers(0, 10**6), st.booleans())
def test_the_torque_of_gravity_is_that_of_all_bodies_weights(seed: int, has_j2: bool) -> None:
    """Of any robot in any posture."""
    rng = np.random.default_rng(seed)
    robot = random_robot(rng, MOTORS)
    plant = orbiting_plant(
        robot,
        0.5,
        orbital_elements=ELEMENTS,
        gravity={"gradient": True, "j2": has_j2},
        initial_quaternion=random_quaternion(rng).tolist(),
        initial_joints_deg=rng.uniform(-180.0, 180.0, MOTORS).tolist(),
    )
    set_motion(plant, position=rng.normal(size=3))
    expected = weight_torque(robot, plant.truth, has_j2)
    size = 1e-11 * np.linalg.norm(expected)
    np.testing.assert_allclose(plant.truth.external_torques[:3], expected, rtol=0, atol=size)


def test_the_gradient_is_told_every_few_ticks_and_the_rest_at_each() -> None:
    """It is held in between, since it costs as much as a stage of the step."""
    plant = orbiting_plant(
        ROBOT,
        0.5,
        orbital_elements=ELEMENTS,
        initial_joints_deg=ANGLES_DEG,
        sunlight={"pressure": 4.56e-6, "noon_deg": 20.0},
        atmosphere={"density": 1e-12},
        magnetism={"strength": 3e-5, "residual_dipole": [1.0, 2.0, 3.0]},
    )
    set_motion(plant, omega=[0.01, 0.02, 0.015])
    rows = [coast(plant, min(tick, 1)).external_torques.copy() for tick in range(45)]
    changes = np.diff(rows, axis=0) != 0.0
    changed = np.flatnonzero(changes[:, :3].any(axis=1)) + 1
    np.testing.assert_array_equal(changed, [REPORT_TICKS, 2 * REPORT_TICKS])
    for source in (1, 2, 3):
        assert changes[:, 3 * source : 3 * source + 3].any(axis=1).all(), source


def test_without_an_orbit_nothing_of_it_is_told() -> None:
    plant = orbiting_plant(ROBOT, 0.5, orbital_elements={}, gravity={})
    set_motion(plant, omega=[0.01, 0.0, 0.0])
    state = coast(plant, 3)
    for name in ("orbit_position", "orbit_velocity", "magnetic_field", "external_torques"):
        assert not np.any(getattr(state, name)), name


PERIOD = 1e-3
CAPTURE, RELEASE, END = 200, 400, 500
"""Ticks."""
SPEED = 0.3
"""m/s of the release."""
REACH = 0.05
ORBIT = circular_orbit(420e3)
RATES = [0.1, -0.2, 0.15, 0.3, -0.1, 0.2]
TUMBLING = {
    "velocity": [0.2, -0.1, 0.3],
    "quaternion": [0.5, -0.1, 0.7, 0.4],
    "angular_velocity": [0.2, -0.1, 0.15],
    "reach": REACH,
}


def flying_plant(robot: Robot, events: list[str], orbit: OrbitSettings = ORBIT) -> Plant:
    """Return a plant whose base and arm move, and that nobody turns."""
    plant = orbiting_plant(
        robot,
        PERIOD,
        initial_joints_deg=ANGLES_DEG,
        friction=NO_FRICTION,
        events=events,
        **orbit.model_dump(),
    )
    set_motion(plant, [0.1, 0.2, -0.1], [0.02, -0.01, 0.03], [0.1, -0.05, 0.08], RATES)
    return plant


@pytest.fixture(scope="module")
def before(paper_robot: Robot) -> RobotState:
    """The state in which the capture happens, a moment before it."""
    return coast(flying_plant(paper_robot, []), CAPTURE).copy()


@pytest.fixture(scope="module")
def target(paper_robot: Robot, before: RobotState) -> Target:
    """One that the tool meets."""
    some = meeting_target(ORBIT, 0.0, np.zeros(3))
    place, _ = held_place(paper_robot, before, some)
    return meeting_target(ORBIT, CAPTURE * PERIOD, place, **TUMBLING)


def beside(target: Target, distance: float) -> Target:
    """Return a target that is as far as ``distance``, m, from the one that is met."""
    start = np.array(target.motion.position) + distance * np.array([2.0, -1.0, 2.0]) / 3.0
    motion = target.motion.model_copy(update={"position": start.tolist()})
    return target.model_copy(update={"motion": motion})


def flown_events(target: Target) -> list[str]:
    return [f"capture@{CAPTURE * PERIOD}:{target.inline}", f"release@{RELEASE * PERIOD}:{SPEED}"]


def test_what_is_met_is_held_with_the_momenta_of_both(
    paper_robot: Robot, before: RobotState, target: Target
) -> None:
    """Linear and angular about the origin, to 1e-12; not with a velocity from elsewhere."""
    plant = flying_plant(paper_robot, flown_events(target))
    after = coast(plant, CAPTURE)
    for name in ("base_position", "quaternion", "joint_positions"):
        np.testing.assert_array_equal(getattr(after, name), getattr(before, name))
    assert np.abs(after.joint_velocities - before.joint_velocities).max() > 1e-2
    meeting = target_state(target, ORBIT, CAPTURE * PERIOD)
    # the target is a little beside its place: its momentum about the origin is that of the place
    place, axes = held_place(paper_robot, before, target)
    np.testing.assert_allclose(place, meeting.position, rtol=0.0, atol=1e-7)
    motion = (np.array(v) for v in (meeting.motion.velocity, meeting.motion.angular_velocity))
    own = BodyMotion.of(target.mass, place, axes, tensor_of(target), *motion)
    expected = np.array(whole_momenta([*body_motions(paper_robot, before), own]))
    scale = float(np.abs(expected).max())
    assert scale > 1.0
    found = momentum(plant.robot, after)
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-12 * scale)
    assert plant.robot.mass.sum() == pytest.approx(paper_robot.mass.sum() + target.mass)
    assert plant.captures.misses == {}
    held = momentum(plant.robot, coast(plant, RELEASE - CAPTURE - 1))
    state = coast(plant, 1)
    assert plant.robot is plant.captures.robot_at(0)
    bodies, (place, axes) = body_motions(paper_robot, state), held_place(paper_robot, state, target)
    hand = bodies[6]
    w = np.linalg.solve(hand.inertia, hand.spin)
    along = hand.axes @ paper_robot.tool.rotation[:, 2]
    gone = hand.velocity + np.cross(w, place - hand.position) + SPEED * along
    own = BodyMotion.of(target.mass, place, axes, tensor_of(target), gone, w)
    expected = np.array(whole_momenta([*bodies, own]))
    np.testing.assert_allclose(held, expected, rtol=0.0, atol=1e-7 * scale)


@pytest.mark.parametrize(
    ("distance", "hits"), [(REACH - 1e-4, True), (REACH + 1e-4, False), (0.3, False)]
)
def test_the_reach_is_the_largest_distance_and_what_is_missed_changes_no_bit(
    paper_robot: Robot, target: Target, distance: float, hits: bool
) -> None:
    """Nor does the release of what is not held."""
    plant = flying_plant(paper_robot, flown_events(beside(target, distance)))
    coast(plant, CAPTURE)
    assert bool(plant.captures.misses) is not hits
    held = target.mass if hits else 0.0
    assert plant.robot.mass.sum() == pytest.approx(paper_robot.mass.sum() + held, rel=1e-14)
    if not hits:
        # distances stay what they were, but for some 1e-8 of relative gravity
        assert plant.captures.misses == {CAPTURE: pytest.approx(distance, rel=1e-6)}
        end, without = coast(plant, END - CAPTURE), flying_plant(paper_robot, [])
        assert end.block.tobytes() == coast(without, END).block.tobytes()
        assert plant.robot is plant.captures.robot_at(0)


# Targets that fall freely: SciPy, and the plant with the same body in it

HEIGHT = 420e3
N = np.sqrt(MU / (EARTH_RADIUS + HEIGHT) ** 3)
"""rad/s."""
ECCENTRIC = {
    "height": 17.7e6,
    "eccentricity": 0.7,
    "inclination_deg": 28.0,
    "perigee_deg": 60.0,
    "anomaly_deg": 10.0,
}


def orbital_axes(orbit: OrbitSettings) -> Array:
    """Return radial, along, normal (3, 3) as columns of a circular orbit at its begin."""
    r, v = state_of(orbit.orbital_elements)
    x, z = r / np.linalg.norm(r), np.cross(r, v) / np.linalg.norm(np.cross(r, v))
    return np.column_stack([x, np.cross(z, x), z])


@pytest.mark.parametrize("has_j2", [False, True])
def test_on_an_eccentric_orbit_it_is_scipys_path_less_the_points(has_j2: bool) -> None:
    """The axes turn with the true anomaly there; positions of 1e7 m are rounded to 1e-9 m."""
    orbit = OrbitSettings.model_validate({"orbital_elements": ECCENTRIC, "gravity": {"j2": has_j2}})
    r, v = state_of(orbit.orbital_elements)
    axes, time = hill_axes(r, v), 1500.0
    rate = np.cross(r, v) / (r @ r)
    start, speed = axes @ [2e3, -3e3, 1e3], axes @ [1.0, -2.0, 0.5]
    target = target_of(position=[2e3, -3e3, 1e3], velocity=[1.0, -2.0, 0.5])
    meeting = target_state(target, orbit, time)
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
    axes = orbital_axes(orbit)
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
    meeting = target_state(target, orbit, ticks * period)
    assert np.linalg.norm(meeting.position - axes @ start) > 50.0
    np.testing.assert_allclose(meeting.position, state.base_position, rtol=0.0, atol=1e-6)
    np.testing.assert_allclose(meeting.motion.velocity, state.base_velocity, rtol=0.0, atol=1e-8)
    spun = rotation_of(state.quaternion).apply(state.omega_base)
    assert np.linalg.norm(spun - turn.apply(omega)) > 1e-3
    np.testing.assert_allclose(meeting.motion.angular_velocity, spun, rtol=0.0, atol=1e-8)
    assert meeting.reach == 0.7
    times = np.array([0.0, 0.5, 30.0, 31.0, ticks * period])
    positions, quaternions = free_fall(target, orbit, times)
    met = [target_state(target, orbit, time).position for time in times.tolist()]
    np.testing.assert_allclose(positions, met, rtol=0.0, atol=1e-6)
    turned = rotation_of(state.quaternion).inv() * rotation_of(quaternions[-1])
    assert turned.magnitude() < 1e-6
    (point,) = free_path(*state_of(orbit.orbital_elements), ticks * period, has_j2)
    found = np.concatenate([state.orbit_position, state.orbit_velocity])
    np.testing.assert_allclose(found, point, rtol=1e-11)
