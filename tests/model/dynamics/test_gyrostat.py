"""Reaction wheels in the articulated-body algorithm, against a dense system with Pinocchio's H."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from oracles import pinocchio_bias_force, pinocchio_mass_matrix, rotation_of
from random_robots import State, random_quaternion, random_robot

from space_robot_model.dynamics.aba import aba
from space_robot_model.dynamics.kinematics import forward_kinematics, spatial_velocities
from space_robot_model.dynamics.model import Data
from space_robot_msgs_py.compiled.records import assign
from space_robot_msgs_py.samples import MOST_WHEELS


@given(st.sampled_from([1, 6]), st.integers(1, MOST_WHEELS), st.integers(0, 2**32 - 1))
@settings(max_examples=60, deadline=None)
def test_wheels_accelerate_as_the_dense_equations_say(n: int, wheels: int, seed: int) -> None:
    """Free and locked ones, on any axes; what holds the locked ones comes out, too."""
    rng = np.random.default_rng(seed)
    robot = random_robot(rng, n)
    axes = rng.normal(size=(wheels, 3))
    axes /= np.linalg.norm(axes, axis=1)[:, np.newaxis]
    inertia = rng.uniform(0.1, 1.0, wheels) * np.linalg.eigvalsh(robot.inertia[0])[0] / wheels
    state = State(
        random_quaternion(rng),
        rng.normal(size=n),
        np.zeros(3),
        rng.normal(size=3),
        rng.normal(size=n),
    )
    stands = rng.integers(0, 2, wheels).astype(bool)
    speeds = np.where(stands, 0.0, rng.normal(size=wheels) * 50.0)
    force = rng.normal(size=6 + n + wheels)

    model, data, out = robot.model.copy(), Data.allocate(n), np.empty(6 + n + wheels)
    assign(model, wheel_count=wheels)
    model.wheel_axis[:wheels], model.wheel_inertia[:wheels] = axes, inertia
    data.locked[n : n + wheels] = stands
    velocities = np.concatenate([state.rate, speeds])
    forward_kinematics(model, state.quaternion, state.theta, data)
    spatial_velocities(model, state.w0, velocities, data)
    aba(model, state.w0, velocities, force, data, out)

    turned = rotation_of(state.quaternion).apply(axes).T
    base, last = slice(3, 6), slice(6 + n, None)
    mass = np.zeros((force.size, force.size))
    mass[: 6 + n, : 6 + n] = pinocchio_mass_matrix(robot, state)
    mass[base, last] = turned * inertia
    mass[last, base] = mass[base, last].T
    mass[last, last] = np.diag(inertia)
    bias = np.zeros(force.size)
    bias[: 6 + n] = pinocchio_bias_force(robot, state)
    bias[base] += np.cross(state.w0, turned @ (inertia * speeds))
    free = np.ones(force.size, bool)
    free[last] = ~stands
    expected = np.zeros(force.size)
    expected[free] = np.linalg.solve(mass[np.ix_(free, free)], (force - bias)[free])
    np.testing.assert_allclose(out, expected, rtol=0.0, atol=1e-11 * np.abs(expected).max())
    holding = (force - bias - mass @ expected)[last][stands]
    found = data.holding[n : n + wheels][stands]
    assert found == pytest.approx(holding, rel=1e-9, abs=1e-9 * np.abs(expected).max())
