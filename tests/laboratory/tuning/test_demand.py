"""The forces that a mission asks for: what a disturbance and friction add, on any attitude."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from space_robot.analysis.mission_plan import planned_segments
from space_robot.flight.plan import Flight, FlightPlan, resolve
from space_robot.tuning.demand import demand
from space_robot.tuning.inertia import SAMPLING, sampled_reference
from space_robot_control.guidance.mission import Mission, MissionSettings
from space_robot_model.robot import Robot
from space_robot_sim.environment.environment import EnvironmentSettings

Array = NDArray[np.float64]
STILL = {"friction": {"coulomb": 0.0, "viscous": 0.0}, "disturbance": {"scale": 0.0}}


def case(**parts: dict[str, float]) -> EnvironmentSettings:
    """Nothing but these."""
    return EnvironmentSettings.model_validate({**STILL, **parts})


def mission(turned: Rotation | None = None) -> MissionSettings:
    """The paper's, its base held at another attitude."""
    paper = Flight(resolve(FlightPlan(robot="paper"))).mission_settings
    if turned is None:
        return paper
    x, y, z, w = turned.as_quat()
    return paper.model_copy(update={"base_quaternion": [w, x, y, z]})


def force_of_torque(turned: Rotation, torque: Array) -> Array:
    """The generalised force of a torque about inertial axes along eps_e of a base as desired.

    By virtual work: ``f . d(eps_e) = torque . d(angle)``, the differences computed by SciPy.
    """
    step = 1e-6
    moved = [
        ((turned.inv() * Rotation.from_rotvec(side * step * axis) * turned).as_quat()[:3])
        for axis in np.eye(3)
        for side in (1.0, -1.0)
    ]
    slopes = [(moved[2 * i] - moved[2 * i + 1]) / (2.0 * step) for i in range(3)]
    return np.asarray(np.linalg.solve(np.array(slopes), torque))


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=3, deadline=None)
def test_a_disturbance_is_about_inertial_axes(paper_robot: Robot, seed: int) -> None:
    """As in the plant, whatever the attitude of the base; that of joints is as it is."""
    turned = Rotation.from_rotvec(np.random.default_rng(seed).uniform(-1.5, 1.5, 3))
    disturbed = case(disturbance={"scale": 2.0, "base_amplitude": 0.3, "inner_amplitude": 0.2})
    found = demand(paper_robot, mission(turned), [disturbed])
    time = SAMPLING * np.arange(len(sampled_reference(paper_robot, mission()).joints))

    def largest(amplitude: float, *frequencies: float) -> float:
        waves = [np.sin(2.0 * np.pi * f * time) for f in frequencies]
        return float(2.0 * amplitude * np.max(np.abs(np.sum(waves, axis=0))))

    base = np.abs(force_of_torque(turned, np.ones(3))) * largest(0.3, 0.5, 0.75)
    joints = np.repeat([largest(0.2, 0.25, 0.5), largest(0.002, 0.25)], 3)
    np.testing.assert_allclose(found.unknown, [*base, *joints], rtol=1e-6)


def test_friction_is_asked_of_the_joints_by_their_rates(paper_robot: Robot) -> None:
    rates = sampled_reference(paper_robot, mission()).joints[:, 1]
    found = demand(
        paper_robot, mission(), [case(), case(friction={"coulomb": 0.3, "viscous": 0.7})]
    )
    friction = np.max(np.abs(0.3 * np.sign(rates) + 0.7 * rates), axis=0)
    np.testing.assert_allclose(found.unknown, [0.0, 0.0, 0.0, *friction], atol=1e-12)
    smooth, rough = (
        demand(paper_robot, mission(), [one])
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
    both = demand(paper_robot, mission(), cases[::order])
    alone = [demand(paper_robot, mission(), [one]) for one in cases]
    for name in ("peak", "slope", "unknown"):
        worst = np.maximum(*(getattr(one, name) for one in alone))
        np.testing.assert_array_equal(getattr(both, name), worst)
    assert np.all(alone[0].unknown[:3] > alone[1].unknown[:3])
    assert np.all(alone[0].unknown[3:] < alone[1].unknown[3:])


def test_a_base_that_turns_asks_what_the_planner_says(paper_robot: Robot) -> None:
    """A segment that turns the base by 40 degrees; eps is half of an angle, so F is 2 torques."""
    segments = ["{base: {rpy_deg: [10, 40, -20]}, duration: 12}"]
    turning = MissionSettings(waypoints_deg=[0, 90, 200, 20, 30, 10], segments=segments)
    found = demand(paper_robot, turning, [case()])
    flown = Mission(paper_robot, turning, SAMPLING)
    (planned,) = planned_segments(paper_robot, flown)
    torque = np.abs(planned.demand.torque).max(axis=0)
    assert torque[:3].min() > 1.0
    np.testing.assert_allclose(found.nominal[:3], 2.0 * torque[:3], rtol=2e-2)
    np.testing.assert_allclose(found.nominal[3:], torque[3:], rtol=2e-2)
