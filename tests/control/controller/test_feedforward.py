"""``pd_feedforward`` on its nominal robot: the base accelerates as its reference, whatever the
joints do."""

from __future__ import annotations

import numpy as np
from closed_loop import PERIOD
from hypothesis import assume, given, settings
from oracles import RelativeMotion, pinocchio_forward_dynamics, rotation_of
from random_robots import Case, cases, random_quaternion

from space_robot_control.controller.controller import Controller
from space_robot_control.laws import find_law
from space_robot_msgs_py.samples import ReferenceChunk, RobotState


@settings(max_examples=40)
@given(cases(joints=[1, 6, 7]))
def test_the_base_has_the_acceleration_of_its_reference(case: Case) -> None:
    """By Pinocchio's articulated bodies, at any attitude and with any momentum; the joints
    accelerate as the law says. The reference turns and accelerates, too."""
    robot, s, rng = case
    n = robot.n
    gains = {"k_p": 50.0 * rng.random(n + 3), "k_d": 20.0 * rng.random(n + 3)}
    for gain in gains.values():
        gain[:3] = 0.0
    controller = Controller(robot, find_law("pd_feedforward")(gains, PERIOD), PERIOD)
    state = RobotState.allocate(n)
    state.quaternion[:], state.joint_positions[:] = s.quaternion, s.theta
    state.omega_base[:] = rotation_of(s.quaternion).inv().apply(s.w0)
    state.joint_velocities[:] = s.rate
    base = np.concatenate([random_quaternion(rng), rng.normal(size=6)])
    assume(abs(base[:4] @ s.quaternion) > 0.1)
    joints = rng.normal(size=(3, n))
    reference = ReferenceChunk(0, joints[None], base[None]).references()
    torque = controller.update(state, reference).torque
    # the torques of the joints are those of PD control
    pd = gains["k_p"][3:] * (joints[0] - s.theta) + gains["k_d"][3:] * (joints[1] - s.rate)
    np.testing.assert_allclose(torque[3:], pd, rtol=1e-12, atol=1e-12)
    # what happens
    force = np.concatenate([np.zeros(3), rotation_of(s.quaternion).apply(torque[:3]), torque[3:]])
    acceleration = pinocchio_forward_dynamics(robot, s, force)[3:]
    result = acceleration.copy()
    result[:3] = RelativeMotion.of(base, s).second_rate(acceleration[:3])
    u = controller.law.memory.u  # no acceleration of the error is wanted: the gains are zero
    np.testing.assert_allclose(u[:3], np.zeros(3), atol=1e-12)
    size = 1.0 + np.abs(torque).max() * np.linalg.norm(
        np.linalg.inv(controller.signals.nominal.inertia), 2
    )
    np.testing.assert_allclose(result, u, rtol=0.0, atol=1e-11 * size)
