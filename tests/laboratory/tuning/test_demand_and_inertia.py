"""What a mission asks for, by power; H_S in many configurations, by Pinocchio."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from oracles import pinocchio_mass_matrix, rho_space_inertia
from robots import PASSIVE_ROBOT
from scipy.spatial.transform import Rotation
from strategies import State, random_quaternion, random_robot

from space_robot.analysis.mission_plan import planned_segments
from space_robot.flight.plan import Flight, Scenario, resolve
from space_robot.tuning.inertia import (
    SAMPLING,
    free_inertia,
    inertia_along,
    inertia_in_rho,
    loose_inertia,
    sampled_reference,
    semi_floating_inertia,
)
from space_robot.tuning.task import force_demand
from space_robot_control.guidance.mission import Mission, MissionSettings
from space_robot_model.robot import Robot
from space_robot_model.robot.dynamics import mass_matrix
from space_robot_model.robot.find import find_robot
from space_robot_sim.environment.environment import EnvironmentSettings

STILL = {"friction": {"coulomb": 0.0, "viscous": 0.0}, "disturbance": {"scale": 0.0}}


def case(**parts: dict[str, float]) -> EnvironmentSettings:
    """Nothing but these."""
    return EnvironmentSettings.model_validate({**STILL, **parts})


def mission() -> MissionSettings:
    return Flight(resolve(Scenario(robot="paper"))).mission_settings


def test_friction_is_asked_of_the_joints_by_their_rates(paper_robot: Robot) -> None:
    rates = sampled_reference(paper_robot, mission()).joints[:, 1]
    found = force_demand(
        paper_robot, mission(), [case(), case(friction={"coulomb": 0.3, "viscous": 0.7})]
    )
    friction = np.max(np.abs(0.3 * np.sign(rates) + 0.7 * rates), axis=0)
    np.testing.assert_allclose(found.unknown, [0.0, 0.0, 0.0, *friction], atol=1e-12)
    smooth, rough = (
        force_demand(paper_robot, mission(), [one])
        for one in (case(), case(friction={"coulomb": 5.0, "viscous": 0.0}))
    )
    np.testing.assert_array_equal(rough.slope, smooth.slope)  # its jumps left out
    assert np.all(rough.peak[3:] > smooth.peak[3:])
    np.testing.assert_array_equal(rough.nominal, smooth.peak)


@pytest.mark.parametrize("order", [1, -1])
def test_the_worst_case_counts_axis_by_axis(paper_robot: Robot, order: int) -> None:
    """Whichever comes first."""
    cases = [
        case(disturbance={"scale": 1.0, "base_amplitude": 5.0}),
        case(friction={"coulomb": 0.0, "viscous": 9.0}),
    ]
    both = force_demand(paper_robot, mission(), cases[::order])
    alone = [force_demand(paper_robot, mission(), [one]) for one in cases]
    for name in ("peak", "slope", "unknown"):
        worst = np.maximum(*(getattr(one, name) for one in alone))
        np.testing.assert_array_equal(getattr(both, name), worst)
    assert np.all(alone[0].unknown[:3] > alone[1].unknown[:3])
    assert np.all(alone[0].unknown[3:] < alone[1].unknown[3:])


def test_a_base_that_turns_asks_what_the_planner_says(paper_robot: Robot) -> None:
    """A segment that turns the base by 40 degrees; eps is half of an angle, so F is 2 torques."""
    segments = ["{base: {rpy_deg: [10, 40, -20]}, duration: 12}"]
    turning = MissionSettings(joints_deg=[0, 90, 200, 20, 30, 10], segments=segments)
    found = force_demand(paper_robot, turning, [case()])
    flown = Mission(paper_robot, turning, SAMPLING)
    (planned,) = planned_segments(paper_robot, flown)
    torque = np.abs(planned.demand.torque).max(axis=0)
    assert torque[:3].min() > 1.0
    np.testing.assert_allclose(found.nominal[:3], 2.0 * torque[:3], rtol=2e-2)
    np.testing.assert_allclose(found.nominal[3:], torque[3:], rtol=2e-2)


def eps(attitude: Rotation) -> np.ndarray:
    x, y, z, w = attitude.as_quat()
    return np.array([x, y, z]) * (1.0 if w >= 0.0 else -1.0)


@given(st.lists(st.floats(-0.9, 0.9), min_size=3, max_size=3))
def test_disturbances_about_inertial_axes_are_turned_to_the_bases(vector: list[float]) -> None:
    """At rest nothing else is asked for; the disturbance is the same about each inertial axis."""
    attitude = Rotation.from_rotvec(vector)
    x, y, z, w = attitude.as_quat()
    place = [10.0, 50.0, 90.0, 20.0, 30.0, 40.0]
    still = MissionSettings(joints_deg=place, segments=["{hold: 4}"], base_quaternion=[w, x, y, z])
    found = force_demand(find_robot("paper"), still, [case(disturbance={"scale": 1.0})])
    time = 0.05 * np.arange(81)
    wave = np.sin(2 * np.pi * 0.5 * time) + np.sin(2 * np.pi * 0.75 * time)
    torque = attitude.inv().apply(np.full(3, 0.010))
    step = 1e-6  # about the desired attitude
    rates = [
        (eps(Rotation.from_rotvec(step * axis)) - eps(Rotation.from_rotvec(-step * axis)))
        / (2.0 * step)
        for axis in np.eye(3)
    ]
    force = np.linalg.solve(np.array(rates), torque)  # F . epsdot = torque . omega, of any omega
    np.testing.assert_allclose(found.peak[:3], np.abs(force) * np.abs(wave).max(), rtol=1e-5)
    np.testing.assert_array_equal(found.nominal, 0.0)
    assert found.peak[3] == pytest.approx(
        0.005 * np.abs(np.sin(2 * np.pi * 0.25 * time) + np.sin(2 * np.pi * 0.5 * time)).max()
    )


UPRIGHT = np.array([1.0, 0.0, 0.0, 0.0])


@given(st.integers(0, 2**32 - 1), st.sampled_from([1, 2, 6, 9]))
@settings(max_examples=25, deadline=None)
def test_it_is_pinocchios(seed: int, n: int) -> None:
    rng = np.random.default_rng(seed)
    robot, theta = random_robot(rng, n), rng.uniform(-np.pi, np.pi, (3, n))
    found = inertia_in_rho(semi_floating_inertia(robot, theta))
    for inertia, positions in zip(found, theta, strict=True):
        expected = rho_space_inertia(robot, UPRIGHT, positions)
        np.testing.assert_allclose(inertia, expected, rtol=1e-9, atol=1e-9 * np.max(expected))


def test_both_ends_of_a_mission_are_looked_at() -> None:
    flight = Flight(resolve(Scenario(robot="seven_joint")))
    found = inertia_along(flight.robot, flight.mission_settings, step=7.0)
    assert found.shape == (6, 10, 10)  # 0, 7, ... 28 and beyond the end at 30 s
    ends = np.radians(flight.mission_settings.joints_deg), flight.mission.pieces[-1].goal
    for row, theta in zip((0, -1), ends, strict=True):
        expected = rho_space_inertia(flight.robot, UPRIGHT, theta)
        np.testing.assert_allclose(found[row], expected, rtol=1e-10, atol=1e-8)
    with pytest.raises(ValueError, match="the start has 6 joints; the robot has 7"):
        inertia_along(flight.robot, mission())


@given(st.integers(0, 2**32 - 1), st.sampled_from([1, 2, 6, 9]))
@settings(max_examples=25, deadline=None)
def test_without_base_it_is_pinocchios_with_six_coordinates_eliminated(seed: int, n: int) -> None:
    """At any attitude, from H_r and from H_S."""
    rng = np.random.default_rng(seed)
    robot, quaternion = random_robot(rng, n), random_quaternion(rng)
    theta = rng.uniform(-np.pi, np.pi, (2, n))
    h_r = semi_floating_inertia(robot, theta)
    zero = np.zeros(3)
    for k, inertia in enumerate(free_inertia(h_r)):
        h = pinocchio_mass_matrix(robot, State(quaternion, theta[k], zero, zero, 0.0 * theta[k]))
        expected = h[6:, 6:] - h[6:, :6] @ np.linalg.solve(h[:6, :6], h[:6, 6:])
        np.testing.assert_allclose(inertia, expected, rtol=0, atol=1e-10 * np.abs(h).max())
    found = free_inertia(inertia_in_rho(h_r))
    np.testing.assert_allclose(found, free_inertia(h_r), rtol=0, atol=1e-8 * np.max(h_r))


def test_loose_joints_give_way_and_locked_ones_do_not() -> None:
    """The accelerations of attitude and motors under their forces alone, from the whole inertia."""
    flight = Flight(resolve(Scenario(robot=PASSIVE_ROBOT)))
    robot, rest = flight.robot, [spring.rest for spring in flight.robot.springs]
    theta = np.array([[0.3, 0.5, -0.8, 0.1, -0.4, 1.0], [-1.2, 1.1, 2.0, -0.7, 0.6, 0.2]])
    moved = range(3, 12)
    for positions, found in zip(theta, loose_inertia(robot, theta), strict=True):
        whole = mass_matrix(robot, [1.0, 0.0, 0.0, 0.0], [*positions, *rest])
        expected = np.linalg.inv(np.linalg.inv(whole)[np.ix_(moved, moved)])
        np.testing.assert_allclose(found, expected, rtol=1e-10, atol=1e-10)
        locked = semi_floating_inertia(robot.nominal, positions[np.newaxis])[0]
        assert np.linalg.eigvalsh(locked - found).min() > -1e-12
    both = inertia_along(robot, flight.mission_settings, step=2.0)
    assert both.shape == (10, 9, 9)
    start = robot.from_degrees(flight.mission_settings.joints_deg)[np.newaxis]
    for row, inertia in (
        (0, semi_floating_inertia(robot.nominal, start)),
        (5, loose_inertia(robot, start)),
    ):
        np.testing.assert_allclose(both[row], inertia_in_rho(inertia)[0], rtol=1e-12)
