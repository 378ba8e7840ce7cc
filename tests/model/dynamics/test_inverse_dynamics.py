"""The torque a desired motion asks for against Pinocchio, and against forward dynamics."""

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
from random_robots import Case, State, branched_cases, cases, random_state

from space_robot_model.robot.dynamics import inverse_dynamics
from space_robot_msgs_py.compiled.records import Block
from space_robot_msgs_py.samples import Reference

Array = NDArray[np.float64]

FEW = settings(max_examples=30)


def references_of(states: list[State], accelerations: Array) -> Block:
    """``accelerations``: (N, n+3), of the base about inertial axes, then of the joints."""
    found = np.empty(len(states), Reference.dtype(states[0].theta.size))
    for row, state, acceleration in zip(found, states, accelerations, strict=True):
        back = rotation_of(state.quaternion).as_matrix().T
        row["quaternion"], row["joint_positions"] = state.quaternion, state.theta
        row["omega_base"], row["joint_velocities"] = back @ state.w0, state.rate
        row["alpha_base"], row["joint_accelerations"] = back @ acceleration[:3], acceleration[3:]
    return found


def in_inertial(state: State, torque: Array) -> Array:
    """The force (n+6,) on inertial axes of a torque on the base's axes and the joints."""
    base = rotation_of(state.quaternion).as_matrix() @ torque[:3]
    return np.concatenate([np.zeros(3), base, torque[3:]])


@FEW
@given(cases() | branched_cases())
def test_it_is_what_moves_pinocchios_robot_so(case: Case) -> None:
    """And the base's CoM is free: no force holds it."""
    robot, rng = case.robot, case.rng
    states = [case.state, random_state(rng, robot.n)]
    accelerations = rng.normal(size=(2, robot.n + 3))
    torques = inverse_dynamics(robot, references_of(states, accelerations))
    for state, torque, wanted in zip(states, torques, accelerations, strict=True):
        moved = pinocchio_forward_dynamics(robot, state, in_inertial(state, torque))
        np.testing.assert_allclose(moved[3:], wanted, atol=1e-8 * (1.0 + np.abs(moved).max()))


@FEW
@given(cases() | branched_cases())
def test_it_is_the_equation_of_motion_without_the_base_translation(case: Case) -> None:
    """``tau = H22 a + c2 - H21 H11^-1 (H12 a + c1)``, H and c by Pinocchio."""
    robot, state = case.robot, case.state
    wanted = case.rng.normal(size=robot.n + 3)
    inertia, bias = pinocchio_mass_matrix(robot, state), pinocchio_bias_force(robot, state)
    drift = -np.linalg.solve(inertia[:3, :3], inertia[:3, 3:] @ wanted + bias[:3])
    expected = inertia @ np.concatenate([drift, wanted]) + bias
    (torque,) = inverse_dynamics(robot, references_of([state], wanted[np.newaxis]))
    np.testing.assert_allclose(
        in_inertial(state, torque), expected, atol=1e-10 * np.abs(expected).max()
    )
