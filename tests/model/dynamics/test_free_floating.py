"""H_f and c_f, the joints of a robot whose base is free, against Pinocchio's H and c."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from numpy.typing import NDArray
from oracles import (
    pinocchio_bias_force,
    pinocchio_forward_dynamics,
    pinocchio_mass_matrix,
    rotation_of,
)
from random_robots import Case, State, branched_cases, cases

from space_robot_model.dynamics.free_floating import free_floating_into
from space_robot_model.dynamics.rho_space import RhoSpaceModel
from space_robot_model.robot import Robot
from space_robot_model.robot.dynamics import free_inverse_dynamics
from space_robot_msgs_py.samples import ReferenceChunk

Array = NDArray[np.float64]

FEW = settings(max_examples=40)


def free_floating(robot: Robot, s: State) -> tuple[Array, Array]:
    """The model by the code under test, base axes included."""
    out = RhoSpaceModel.allocate(robot.n)
    omega_base = rotation_of(s.quaternion).inv().apply(s.w0)
    free_floating_into(robot.model, s.quaternion, s.theta, omega_base, s.rate, out)
    return out.inertia, out.bias


def half_turned(s: State) -> State:
    """The state with its base turned by 180 degrees, where J0 is singular."""
    axis = s.quaternion[1:] / np.linalg.norm(s.quaternion[1:])
    return s._replace(quaternion=np.concatenate([[0.0], axis]))


@FEW
@given(cases() | branched_cases())
def test_joints_are_the_schur_complement_of_pinocchios_h_and_c(case: Case) -> None:
    """At any attitude, half a turn included; the base's axes stand apart."""
    robot = case.robot
    for s in (case.state, half_turned(case.state)):
        h, c = pinocchio_mass_matrix(robot, s), pinocchio_bias_force(robot, s)
        share = h[6:, :6] @ np.linalg.inv(h[:6, :6])
        h_f, c_f = h[6:, 6:] - share @ h[:6, 6:], c[6:] - share @ c[:6]
        inertia, bias = free_floating(robot, s)
        np.testing.assert_allclose(inertia[3:, 3:], h_f, rtol=0, atol=1e-11 * np.abs(h).max())
        np.testing.assert_allclose(bias[3:], c_f, rtol=0, atol=1e-10 * np.abs(c).max())
        apart = np.hstack([np.eye(3), np.zeros((3, robot.n))])
        np.testing.assert_array_equal(inertia[:3], apart)
        np.testing.assert_array_equal(inertia[:, :3], apart.T)
        np.testing.assert_array_equal(bias[:3], 0.0)


@FEW
@given(cases() | branched_cases())
def test_torques_of_the_joints_alone_cause_the_acceleration_wanted(case: Case) -> None:
    """``tau = H_f thetadd + c_f`` with any momentum, by Pinocchio's articulated bodies."""
    robot, s, rng = case
    wanted = rng.normal(size=robot.n)
    inertia, bias = free_floating(robot, s)
    force = np.zeros(robot.n + 6)
    force[6:] = inertia[3:, 3:] @ wanted + bias[3:]
    found = pinocchio_forward_dynamics(robot, s, force)[6:]
    size = 1.0 + np.abs(np.linalg.inv(inertia[3:, 3:])).max() * np.abs(force).max()
    np.testing.assert_allclose(found, wanted, rtol=0, atol=1e-11 * size)


@FEW
@given(cases() | branched_cases())
def test_inverse_dynamics_is_pinocchios_without_momentum(case: Case) -> None:
    """The base turns as momentum asks, and its axes get nothing."""
    robot, s, rng = case
    accelerations = rng.normal(size=robot.n)
    joints = np.stack([s.theta, s.rate, accelerations])[np.newaxis]
    base = np.concatenate([s.quaternion, rng.normal(size=6)])[np.newaxis]
    torque = free_inverse_dynamics(robot, ReferenceChunk(0, joints, base).references())[0]
    assert (torque[:3] == 0.0).all()
    h = pinocchio_mass_matrix(robot, s)
    turning = -np.linalg.solve(h[:6, :6], h[:6, 6:] @ s.rate)
    moving = s._replace(v0=turning[:3], w0=turning[3:])
    found = pinocchio_forward_dynamics(robot, moving, np.concatenate([np.zeros(3), torque]))[6:]
    size = 1.0 + np.abs(np.linalg.inv(free_floating(robot, s)[0])).max() * np.abs(torque).max()
    np.testing.assert_allclose(found, accelerations, rtol=0, atol=1e-11 * size)
