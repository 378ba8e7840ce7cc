"""A controller whose robot has a base that nothing turns: signals and torques of its joints alone.

Any attitude will do, half a turn included, where J0 is singular.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from closed_loop import PERIOD
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from oracles import rotation_of
from random_robots import Case, State, cases

from space_robot_control.controller.controller import Controller
from space_robot_control.laws import ControlLaw, LawGains, Signals, find_law, laws, per_axis
from space_robot_model.hardware.base_actuators import BaseActuatorSettings
from space_robot_model.robot import Robot
from space_robot_msgs_py.samples import ReferenceChunk, RobotState

Array = NDArray[np.float64]


FREE = BaseActuatorSettings(base_actuation="none")


LAWS = sorted(laws())


HALF_TURN = [0.0, 0.6, 0.0, 0.8]


class Inverting(ControlLaw):
    """A law of a user's: it inverts the nominal inertia, and asks for a torque on the base."""

    name = "inverting"
    uses_model = True

    class gains_type(LawGains):  # noqa: N801
        """One gain."""

        k: Array = per_axis("anything")

    def force(self, signals: Signals) -> Array:
        """Ask for something on every axis."""
        inverse = np.linalg.inv(signals.nominal.inertia)
        return np.asarray(self.gains.k * (inverse @ signals.error) + 1.0)


def law_with(name: str, rng: np.random.Generator, axes: int) -> ControlLaw:
    """A law with random gains."""
    law = Inverting if name == "inverting" else find_law(name)
    gains = {gain: rng.uniform(0.5, 20.0, axes) for gain in law.gain_descriptions()}
    return law(gains, PERIOD)


def measured(robot: Robot, s: State, torque: Array, tick: int) -> RobotState:
    """The state as the sensors report it."""
    sample = RobotState.allocate(robot.n)
    sample.tick = tick
    sample.quaternion[:] = s.quaternion
    sample.omega_base[:] = rotation_of(s.quaternion).inv().apply(s.w0)
    sample.joint_positions[:], sample.joint_velocities[:] = s.theta, s.rate
    sample.applied_torque[:] = torque
    return sample


def near(s: State, rng: np.random.Generator) -> Any:
    """A reference of the joints near a state, of a base somewhere else."""
    joints = np.stack([s.theta, s.rate, 0.0 * s.rate])
    joints += 0.1 * rng.normal(size=joints.shape)
    base = np.concatenate([[0.5, 0.5, -0.5, 0.5], rng.normal(size=6)])
    return ReferenceChunk(0, joints[None], base[None]).references()


@pytest.mark.parametrize("name", [*LAWS, "inverting"])
@settings(max_examples=8)
@given(case=cases(joints=[6]), half_turned=st.booleans())
def test_no_law_sees_the_base_nor_turns_it(name: str, case: Case, half_turned: bool) -> None:
    robot, s, rng = case
    if half_turned:
        s = s._replace(quaternion=np.array(HALF_TURN))
    controller = Controller(robot, law_with(name, rng, 9), PERIOD, actuators=FREE)
    for tick in range(4):
        given_torque = np.concatenate([np.zeros(3), rng.normal(size=robot.n)])
        command = controller.update(measured(robot, s, given_torque, tick), near(s, rng))
        signals = controller.signals
        for vector in (
            signals.error,
            signals.error_rate,
            signals.acceleration_desired,
            signals.n_hat,
            command.torque,
        ):
            assert (vector[:3] == 0.0).all()
            assert np.isfinite(vector).all()
        assert (command.torque[3:] != 0.0).all()
        assert np.isfinite(controller.telemetry()).all()
        if name in LAWS:  # the laws' own equations give nothing on the base's axes
            for output in ("s", "u", "force"):
                assert (getattr(controller.law.memory, output)[:3] == 0.0).all()


@settings(max_examples=15)
@given(case=cases(joints=[6]))
def test_the_attitude_of_the_base_does_not_matter(case: Case) -> None:
    """The robot seen from its base is the same: so are the torques."""
    robot, s, rng = case
    law, reference = law_with("ctc", rng, 9), near(s, rng)
    omega = rotation_of(s.quaternion).inv().apply(s.w0)
    torques = []
    for quaternion in (s.quaternion, np.array(HALF_TURN), np.array([1.0, 0.0, 0.0, 0.0])):
        turned = s._replace(quaternion=quaternion, w0=rotation_of(quaternion).apply(omega))
        controller = Controller(robot, law, PERIOD, actuators=FREE)
        state = measured(robot, turned, np.zeros(9), 0)
        torques.append(controller.update(state, reference).torque.copy())
    size = np.abs(torques[0]).max()
    np.testing.assert_allclose(torques[1:], [torques[0]] * 2, rtol=0, atol=1e-10 * size)
