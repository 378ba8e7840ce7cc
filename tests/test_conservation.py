"""Momentum and kinetic energy against Pinocchio: what the plant's flights are judged by."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from conservation import NO_WHEELS, generalised_velocity, kinetic_energy, momentum
from hypothesis import given, settings
from hypothesis import strategies as st
from oracles import pinocchio_state, rotation_of
from random_robots import Case, State, cases
from wheel_oracles import pinocchio_with_wheels, random_rotors, settings_of

from space_robot_msgs_py.samples import RobotState

FEW = settings(max_examples=40)


def measured(state: State, position: np.ndarray) -> RobotState:
    """The state as the plant's sensors report it: angular velocity in the base frame."""
    sample = RobotState.allocate(len(state.theta))
    sample.base_position[:] = position
    sample.quaternion[:] = state.quaternion
    sample.base_velocity[:] = state.v0
    sample.omega_base[:] = rotation_of(state.quaternion).inv().apply(state.w0)
    sample.joint_positions[:] = state.theta
    sample.joint_velocities[:] = state.rate
    return sample


@FEW
@given(cases(), st.sampled_from([0, 1, 4]))
def test_momentum_and_kinetic_energy_agree_with_pinocchio(case: Case, count: int) -> None:
    """Centroidal momentum, moved from the CoM to the inertial origin; wheels are bodies there."""
    robot, state, rng = case
    position, rotors = rng.normal(size=3), random_rotors(rng, robot, count) if count else []
    sample = measured(state, position)
    sample.wheel_velocities[:count] = speeds = 100.0 * rng.normal(size=count)
    model = pinocchio_with_wheels(robot, rotors)
    data = model.createData()
    moving = state._replace(
        theta=np.concatenate([state.theta, rng.normal(size=count)]),
        rate=np.concatenate([state.rate, speeds]),
    )
    configuration, velocity = pinocchio_state(moving, position)
    about_com = pin.computeCentroidalMomentum(model, data, configuration, velocity)
    com = pin.centerOfMass(model, data, configuration)
    wheels = settings_of(rotors) if count else NO_WHEELS
    linear, angular = momentum(robot, sample, wheels)
    expected = about_com.angular + np.cross(com, about_com.linear)
    scale = np.abs(expected).max() + np.abs(about_com.linear).max()
    np.testing.assert_allclose(linear, about_com.linear, atol=1e-12 * scale)
    np.testing.assert_allclose(angular, expected, atol=1e-12 * scale)
    energy = pin.computeKineticEnergy(model, data, configuration, velocity)
    assert kinetic_energy(robot, sample, wheels) == pytest.approx(energy, rel=1e-12)


@FEW
@given(cases(joints=[1, 3]))
def test_generalised_velocity_is_on_inertial_axes(case: Case) -> None:
    sample = measured(case.state, np.zeros(3))
    np.testing.assert_allclose(
        generalised_velocity(case.robot, sample), case.state.velocity, atol=1e-13
    )
