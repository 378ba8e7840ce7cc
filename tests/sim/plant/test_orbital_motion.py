"""Robots in orbit: energy and momentum about the Earth, torques; targets met or missed."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from oracles.momenta import momentum
from oracles.orbit import (
    MU,
    BodyMotion,
    EarthTotals,
    angular_momentum,
    body_motions,
    centre_of_mass,
    earth_totals,
    whole_inertia,
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
    set_motion,
    tensor_of,
)
from strategies import random_quaternion, random_robot

from space_robot_model.robot import Robot
from space_robot_msgs_py.samples import RobotState
from space_robot_sim.environment.neighbouring_orbit import meet
from space_robot_sim.environment.orbit_settings import OrbitSettings
from space_robot_sim.environment.target import Target
from space_robot_sim.plant.plant import Plant
from space_robot_sim.plant.surroundings import REPORT_TICKS

Array = NDArray[np.float64]
ROBOT = Robot.from_yaml(CONFIG / "robots/paper.yaml")
DURATION_S = 5600.0
RATE = 0.003
"""rad/s, of base and joints."""
CIRCULAR: dict[str, Any] = {
    "height": 400e3,
    "inclination_deg": 51.6,
    "raan_deg": 30.0,
    "anomaly_deg": 20.0,
}
ECCENTRIC: dict[str, Any] = {**CIRCULAR, "height": 800e3, "eccentricity": 0.05}


def moving(period: float, elements: dict[str, Any], j2: bool) -> Plant:
    """Return the paper's robot, some metres from the orbit's point, all in motion."""
    plant = orbiting_plant(
        ROBOT,
        period,
        initial_joints_deg=ANGLES_DEG,
        initial_quaternion=[0.3, -0.8, 0.4, 0.2],
        friction=NO_FRICTION,
        gravity={"gradient": True, "j2": j2},
        orbital_elements=elements,
    )
    set_motion(
        plant,
        position=[3.0, -2.0, 1.0],
        velocity=[0.003, 0.002, -0.001],
        omega=RATE * np.array([1.0, -0.7, 0.4]),
        joint_rates=RATE * np.array([0.3, -0.5, 0.4, -0.6, 0.2, 0.8]),
    )
    return plant


def flown(
    period: float, duration: float, elements: dict[str, Any], j2: bool
) -> tuple[list[EarthTotals], Array]:
    """Return the totals at the ends of ten parts of a flight, and the momenta about the CoM."""
    plant = moving(period, elements, j2)
    totals, spins = [], []
    for part in range(11):
        if part:
            coast(plant, round(duration / period / 10))
        totals.append(earth_totals(ROBOT, plant.truth, j2))
        spins.append(angular_momentum(ROBOT, plant.truth))
    return totals, np.array(spins)


def drift(values: list[Any]) -> Array:
    """Return the largest change from the first value."""
    return np.abs(np.array(values) - values[0]).max(axis=0)


@pytest.mark.parametrize(("j2", "elements"), [(False, CIRCULAR), (True, ECCENTRIC)])
def test_energy_and_angular_momentum_about_the_earth_are_conserved(
    j2: bool, elements: dict[str, Any]
) -> None:
    """Over an orbit: with J2 the component about the Earth's axis alone."""
    totals, spins = flown(0.25, DURATION_S, elements, j2)
    energy, angular = drift([t.energy for t in totals]), drift([t.angular for t in totals])
    assert energy < 1e-9 * abs(totals[0].energy)
    assert drift(list(spins)).max() > 1.0, "gravity turns the robot"
    exchanged = angular[2:] if j2 else angular
    assert exchanged.max() < 1e-3, "and takes from the orbit what it gives"
    if j2:
        assert angular[:2].min() > 1e3
    whole = [float(t.whole_energy / totals[0].whole_energy - 1) for t in totals]
    about_axis = [float(t.whole_angular[2] / totals[0].whole_angular[2] - 1) for t in totals]
    assert np.abs(whole).max() < 1e-12
    assert np.abs(about_axis).max() < 1e-12


ELEMENTS = {"height": 420e3, "inclination_deg": 51.6, "raan_deg": 30.0, "anomaly_deg": 20.0}


def gradient_of_rigid_body(robot: Robot, state: RobotState) -> Array:
    """Return ``3 mu / r^3 u x I u`` at the common centre of mass, N m, inertial axes."""
    r = state.orbit_position + centre_of_mass(robot, state)
    distance = float(np.linalg.norm(r))
    u = r / distance
    return np.asarray(3.0 * MU / distance**3 * np.cross(u, whole_inertia(robot, state) @ u))


@settings(max_examples=25)
@given(st.integers(0, 10**6))
def test_gravity_gradient_is_that_of_a_rigid_body(seed: int) -> None:
    """Of any robot in any posture, to d / R; and of its bodies' weights, to rounding."""
    rng = np.random.default_rng(seed)
    robot = random_robot(rng, MOTORS)
    plant = orbiting_plant(
        robot,
        0.5,
        orbital_elements=ELEMENTS,
        initial_quaternion=random_quaternion(rng).tolist(),
        initial_joints_deg=rng.uniform(-180.0, 180.0, MOTORS).tolist(),
    )
    set_motion(plant, position=rng.normal(size=3))
    torque = plant.truth.external_torques[:3]
    size = 3.0 * MU / np.linalg.norm(plant.truth.orbit_position) ** 3
    size *= np.linalg.norm(whole_inertia(robot, plant.truth))
    of_whole = gradient_of_rigid_body(robot, plant.truth)
    np.testing.assert_allclose(torque, of_whole, rtol=0, atol=5.0 / 6.8e6 * size)


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


def events_of(target: Target) -> list[str]:
    return [f"capture@{CAPTURE * PERIOD}:{target.inline}", f"release@{RELEASE * PERIOD}:{SPEED}"]


def test_what_is_met_is_held_with_the_momenta_of_both(
    paper_robot: Robot, before: RobotState, target: Target
) -> None:
    """Linear and angular about the origin, to 1e-12; not with a velocity from elsewhere."""
    plant = flying_plant(paper_robot, events_of(target))
    after = coast(plant, CAPTURE)
    for name in ("base_position", "quaternion", "joint_positions"):
        np.testing.assert_array_equal(getattr(after, name), getattr(before, name))
    assert np.abs(after.joint_velocities - before.joint_velocities).max() > 1e-2
    meeting = meet(target, ORBIT, CAPTURE * PERIOD)
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
    coast(plant, RELEASE - CAPTURE)
    assert plant.robot is plant.captures.robot_at(0)


def states_of(plant: Plant, ticks: int) -> bytes:
    """Return all bits of the truth at each tick of a flight."""
    blocks = []
    for _ in range(ticks):
        coast(plant, 1)
        blocks.append(plant.truth.block.tobytes())
    return b"".join(blocks)


def test_what_is_missed_changes_no_bit_nor_does_its_release(
    paper_robot: Robot, target: Target
) -> None:
    missing = flying_plant(paper_robot, events_of(beside(target, 0.3)))
    without = flying_plant(paper_robot, [])
    assert states_of(missing, END) == states_of(without, END)
    assert missing.robot is missing.captures.robot_at(0)
    assert missing.robot.mass.sum() == paper_robot.mass.sum()
    ((tick, distance),) = missing.captures.misses.items()
    assert tick == CAPTURE
    # distances stay what they were, but for some 1e-8 of relative gravity
    assert distance == pytest.approx(0.3, rel=1e-6)


@pytest.mark.parametrize(("distance", "hits"), [(REACH - 1e-4, True), (REACH + 1e-4, False)])
def test_the_reach_is_the_largest_distance(
    paper_robot: Robot, target: Target, distance: float, hits: bool
) -> None:
    plant = flying_plant(paper_robot, events_of(beside(target, distance)))
    coast(plant, CAPTURE)
    assert bool(plant.captures.misses) is not hits
    held = target.mass if hits else 0.0
    assert plant.robot.mass.sum() == pytest.approx(paper_robot.mass.sum() + held, rel=1e-14)
