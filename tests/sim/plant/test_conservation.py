"""Momentum and kinetic energy against Pinocchio: what the plant's flights are judged by."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from oracles import pinocchio_model, pinocchio_state, rotation_of
from random_robots import Case, State, cases

from space_robot_msgs_py.samples import RobotState
from space_robot_sim.plant.conservation import generalised_velocity, kinetic_energy, momentum

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
@given(cases())
def test_momentum_agrees_with_pinocchio(case: Case) -> None:
    """Centroidal momentum, moved from the CoM to the inertial origin."""
    robot, state, rng = case
    position = rng.normal(size=3)
    model = pinocchio_model(robot)
    data = model.createData()
    configuration, velocity = pinocchio_state(state, position)
    about_com = pin.computeCentroidalMomentum(model, data, configuration, velocity)
    com = pin.centerOfMass(model, data, configuration)
    linear, angular = momentum(robot, measured(state, position))
    expected = about_com.angular + np.cross(com, about_com.linear)
    scale = np.abs(expected).max() + np.abs(about_com.linear).max()
    np.testing.assert_allclose(linear, about_com.linear, atol=1e-12 * scale)
    np.testing.assert_allclose(angular, expected, atol=1e-12 * scale)


@FEW
@given(cases())
def test_kinetic_energy_agrees_with_pinocchio(case: Case) -> None:
    robot, state, rng = case
    model = pinocchio_model(robot)
    expected = pin.computeKineticEnergy(model, model.createData(), *pinocchio_state(state))
    sample = measured(state, rng.normal(size=3))
    assert kinetic_energy(robot, sample) == pytest.approx(expected, rel=1e-12)


@FEW
@given(cases(joints=[1, 3]))
def test_generalised_velocity_is_on_inertial_axes(case: Case) -> None:
    sample = measured(case.state, np.zeros(3))
    np.testing.assert_allclose(
        generalised_velocity(case.robot, sample), case.state.velocity, atol=1e-13
    )
