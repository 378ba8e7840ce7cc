"""The controller: frames, signs of quaternions, what it refuses, and the hardware of a base."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from allocation_bench import couples
from closed_loop import GAINS, PERIOD, Loop, law_of
from hypothesis import assume, given, settings
from oracles import RelativeMotion, multiplied, pinocchio_forward_dynamics, rotation_of
from strategies import Case, cases, random_quaternion

from space_robot_control.allocation.settings import AllocationSettings
from space_robot_control.controller.controller import Controller
from space_robot_control.controller.supervisor import Supervisor
from space_robot_control.controller.tick import HOLDING, SAFE
from space_robot_control.laws import find_law
from space_robot_model.hardware.base_actuators import BaseActuatorSettings
from space_robot_model.robot import Robot
from space_robot_msgs_py.errors import SingularAttitudeError
from space_robot_msgs_py.samples import Reference, ReferenceChunk, RobotState

FREE = BaseActuatorSettings(base_actuation="none")
REST = Reference.at_rest(6)


def measured(case: Case) -> RobotState:
    """The case's state as the sensors report it."""
    s = case.state
    sample = RobotState.allocate(case.robot.n)
    sample.quaternion[:] = s.quaternion
    sample.omega_base[:] = rotation_of(s.quaternion).inv().apply(s.w0)
    sample.joint_positions[:], sample.joint_velocities[:] = s.theta, s.rate
    return sample


# Frames and signs


@pytest.mark.parametrize(
    ("name", "actuators"), [("ctc", None), ("pd_feedforward", None), ("ctc", FREE)]
)
@settings(max_examples=25)
@given(case=cases(joints=[1, 6, 7]))
def test_the_acceleration_that_a_law_demands_is_what_happens(
    name: str, actuators: Any, case: Case
) -> None:
    """By Pinocchio's articulated bodies, at any attitude and with any momentum.

    The reference turns and accelerates too; u is worked out here by SciPy and the product rule of
    quaternions. Under ``pd_feedforward`` the base accelerates as its reference, whatever the joints
    do under PD control.
    """
    robot, s, rng = case
    axes, is_free = robot.n + 3, actuators is not None
    base = np.concatenate([random_quaternion(rng), rng.normal(size=6)])
    assume(is_free or abs(base[:4] @ s.quaternion) > 0.1)
    joints = rng.normal(size=(3, robot.n))
    k_p, k_d = rng.uniform(1.0, 50.0, axes), rng.uniform(1.0, 10.0, axes)
    if name == "pd_feedforward":
        k_p[:3] = k_d[:3] = 0.0
    law = find_law(name)({"k_p": k_p, "k_d": k_d}, PERIOD)
    controller = Controller(robot, law, PERIOD, actuators=actuators)
    reference = ReferenceChunk(0, joints[None], base[None]).references()
    torque = controller.update(measured(case), reference).torque
    relative = RelativeMotion.of(base, s)
    error = np.concatenate([-relative.error[1:], joints[0] - s.theta])
    error_rate = np.concatenate([-relative.rate, joints[1] - s.rate])
    u, pd = law.memory.u, k_p * error + k_d * error_rate
    if is_free:
        pd[:3] = 0.0
        np.testing.assert_array_equal(torque[:3], 0.0)
    if name == "ctc":
        u_pd = np.concatenate([np.zeros(3), joints[2]]) + pd
        np.testing.assert_allclose(u, u_pd, rtol=1e-9, atol=1e-9)
    else:
        np.testing.assert_allclose(torque[3:], pd[3:], rtol=1e-12, atol=1e-12)
        np.testing.assert_allclose(u[:3], 0.0, atol=1e-12)
    force = np.concatenate([np.zeros(3), rotation_of(s.quaternion).apply(torque[:3]), torque[3:]])
    result = pinocchio_forward_dynamics(robot, s, force)[3:]
    result[:3] = relative.second_rate(result[:3])
    inverse = np.linalg.inv(controller.signals.nominal.inertia)
    size = 1.0 + np.abs(torque).max() * np.linalg.norm(inverse, 2)
    first = 3 if is_free else 0
    np.testing.assert_allclose(result[first:], u[first:], rtol=0.0, atol=1e-11 * size)


# Contract


@pytest.mark.parametrize("desired", [[1.0, 0.0, 0.0, 0.0], [0.1, 0.7, -0.5, 0.5]])
@pytest.mark.parametrize("error", [[0.0, 1.0, 0.0, 0.0], [1e-9, 0.6, 0.0, 0.8]])
def test_an_error_of_half_a_turn_is_told_and_no_nan(
    paper_robot: Robot, error: list[float], desired: list[float]
) -> None:
    """Of the error from the desired attitude, wherever that is; half a turn itself flies."""
    controller = Controller(paper_robot, law_of("tde_stc"), PERIOD)
    state, reference = RobotState.allocate(6), Reference.at_rest(6)
    reference["quaternion"][0] = desired
    state.tick, state.quaternion[:] = 321, multiplied(np.array(desired), np.array(error))
    with pytest.raises(SingularAttitudeError, match=r"tick 321.*180 degrees from its desired") as e:
        controller.update(state, reference)
    assert e.value.tick == 321
    reference["quaternion"][0] = state.quaternion
    command = controller.update(state, reference)
    np.testing.assert_allclose(command.torque[:3], np.zeros(3), atol=1e-12)


@pytest.mark.parametrize(("period", "ticks"), [(5e-4, 40), (1e-3, 20), (2e-3, 10), (0.1, 1)])
def test_a_transfer_lasts_20_ms_and_fades_evenly(
    paper_robot: Robot, period: float, ticks: int
) -> None:
    """At any period; at least a tick. At first the force is the applied one, then the law's own."""
    controller = Controller(paper_robot, find_law("ctc")(GAINS["ctc"], period), period)
    state = RobotState.allocate(6)
    state.joint_positions[:], state.applied_torque[:] = 0.1, 1.0
    shares = []
    for tick in range(1, ticks + 4):
        state.tick = tick
        torque = controller.update(state, REST).torque
        own = controller.law.force(controller.signals)
        shares.append(np.abs(controller.block[0].force - own).max())
        if tick == 1:
            np.testing.assert_allclose(torque, 1.0, atol=1e-9)
    fade = 1.0 - np.minimum(np.arange(ticks + 3) / ticks, 1.0)
    assert shares[0] > 0.0
    np.testing.assert_allclose(shares, shares[0] * fade, rtol=1e-9, atol=1e-9)
    assert shares[ticks:] == [0.0] * 3


def test_telemetry_is_of_the_last_tick(paper_robot: Robot) -> None:
    """s, u, N_hat, e."""
    loop = Loop(paper_robot, law_of("tde_stc"))
    errors, _ = loop.fly(30)
    s, u, n_hat, e = loop.controller.telemetry()
    law, signals = loop.controller.law, loop.controller.signals
    np.testing.assert_array_equal(e, errors[-1])
    np.testing.assert_allclose(s, signals.error_rate + errors[-1], rtol=1e-13)
    np.testing.assert_allclose(law.force(signals), law.gains.h_bar * u + n_hat, rtol=1e-13)
    loop.controller.law = law_of("ctc")
    loop.fly(1)
    np.testing.assert_array_equal(loop.controller.telemetry()[2], np.zeros(9))


# Wheels, thrusters and torquers


CORNERS = [1.0, 1.0, 1.0, -1.0, 1.0, 1.0, -1.0, -1.0, 1.0, 1.0, -1.0, 1.0]
WHEELS: dict[str, Any] = {
    "axes": CORNERS,
    "rotor_inertia": [0.05],
    "max_torque": [50.0],
    "max_momentum": [100.0],
}
THRUSTERS = couples(10.0)
TORQUERS: dict[str, Any] = {"axes": np.eye(3).ravel().tolist(), "max_dipole": [400.0]}
FIELD = np.array([1e-5, -2e-5, 3e-5])
"""T, base axes."""
SPEEDS = [10.0, 20.0, -5.0, 40.0]


def controller_of(robot: Robot, law: str = "ctc", **hardware: Any) -> Controller:
    actuators = BaseActuatorSettings(base_actuation="hardware", **hardware)
    return Controller(
        robot,
        law_of(law),
        PERIOD,
        actuators=actuators,
        allocation=AllocationSettings(failure_ticks=20, modulation="sigma_delta"),
    )


def state_at(tick: int) -> RobotState:
    """Off the reference, in a magnetic field, with wheels that store a momentum."""
    state = RobotState.allocate(6)
    state.tick = tick
    state.quaternion[:] = [1.0, 1e-6, -1e-6, 1e-6]
    state.wheel_velocities[:4], state.magnetic_field[:] = SPEEDS, FIELD
    return state


@pytest.mark.parametrize("torquers", [{}, {"magnetic_torquers": TORQUERS}], ids=["without", "with"])
def test_wheels_and_torquers_are_asked_for_the_torque_of_the_base(
    paper_robot: Robot, torquers: dict[str, Any]
) -> None:
    """And dump momentum; without a law the field is read too."""
    controller = controller_of(paper_robot, wheels=WHEELS, **torquers)
    ideal = Controller(paper_robot, law_of("ctc"), PERIOD).update(state_at(0), REST).torque
    command = controller.update(state_at(0), REST)
    names = (*(f"wheel_{k}" for k in range(1, 5)), *(f"torquer_{k}" for k in range(1, 4)))
    assert controller.names.commanded[9:] == (names if torquers else names[:4])
    np.testing.assert_array_equal(command.torque[:9], ideal)
    assert np.abs(ideal[:3]).max() > 1.0
    axes, dipoles = np.reshape(CORNERS, (4, 3)) / np.sqrt(3.0), np.zeros(3)
    if torquers:
        dipoles = command.torque[13:]
        expected = 0.002 * np.cross(0.05 * np.array(SPEEDS) @ axes, FIELD) / (FIELD @ FIELD)
        np.testing.assert_allclose(dipoles, expected, rtol=1e-12)
        assert controller.allocation.values["largest_dipole"] == np.abs(dipoles).max()
        other = controller_of(paper_robot, wheels=WHEELS, **torquers)
        without_law = other.allocate_torque(state_at(0), np.zeros(9)).torque[13:]
        np.testing.assert_array_equal(without_law, dipoles)
    torque = np.cross(dipoles, FIELD) - command.torque[9:13] @ axes
    np.testing.assert_allclose(torque, ideal[:3], atol=1e-9)


@pytest.mark.parametrize(
    ("field", "wrong"),
    [("wheel_velocities", np.nan), *(("magnetic_field", x) for x in (np.nan, np.inf, -1e31))],
)
def test_while_it_holds_its_torque_valves_are_closed_and_dipoles_off(
    paper_robot: Robot, field: str, wrong: float
) -> None:
    """The torque of the wheels is held, then all are switched off."""
    hardware = {"wheels": WHEELS, "thrusters": THRUSTERS, "magnetic_torquers": TORQUERS}
    controller = controller_of(paper_robot, **hardware)
    supervisor = Supervisor(controller, hold_ticks=5)
    good = supervisor.answer(state_at(0), REST).torque
    good[controller.valves] = 10.0
    wheels = good[9:13].copy()
    for tick in range(1, 8):
        bad = state_at(tick)
        getattr(bad, field)[1] = wrong
        held = supervisor.answer(bad, REST)
        assert held.torque[13:].size == 12 + 3
        assert not held.torque[13:].any()
        assert supervisor.mode == (HOLDING if tick < 6 else SAFE)
        np.testing.assert_array_equal(held.torque[9:13], wheels if tick < 6 else np.zeros(4))
    assert supervisor.answer(state_at(8), REST).torque[25:].all()


def test_failed_and_full_wheels_and_pulses_are_told(paper_robot: Robot) -> None:
    assert Controller(paper_robot, law_of("ctc"), PERIOD).allocation.values == {}
    controller = controller_of(paper_robot, wheels=WHEELS, thrusters=THRUSTERS)
    assert controller.allocation.summary == ""
    asked = np.zeros(4)
    for tick in range(60):
        state = state_at(tick)
        state.wheel_velocities[:4] = [1600.0, -1600.0, 1600.0, 1600.0]
        state.wheel_torques[:4] = asked * [1.0, 0.0, 0.0, 1.0]
        asked = controller.update(state, REST).torque[9:13].copy()
    told = controller.allocation
    assert told.failed == ("wheel_2", "wheel_3")
    assert told.values["failed"] == "wheel_2, wheel_3"
    assert told.values["wheel_axes"] == 2
    assert "wheels turn 2 of 3 axes" in told.summary
    assert told.values["fullest_wheel"] == pytest.approx(0.8)
    assert told.values["unloading"] == "yes"
    assert told.values["pulses"] > 0
