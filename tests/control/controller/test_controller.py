"""The controller: frames, signs of quaternions, and what it refuses."""

from __future__ import annotations

import numpy as np
import pytest
from closed_loop import GAINS, H_BAR, PAPER_DEG, PERIOD, Loop, law_of
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from oracles import RelativeMotion, attitude_jacobian_base, multiplied, quaternion_of, rotation_of
from random_robots import Case, cases, random_quaternion
from scipy.spatial.transform import Rotation

from space_robot_control.controller.controller import TRANSFER_S, Controller
from space_robot_control.controller.signal_kernels import LARGEST
from space_robot_control.controller.time_delay_estimation import LONGEST_GAP
from space_robot_control.laws import find_law
from space_robot_model.robot import Robot
from space_robot_model.robot.dynamics import forward_dynamics
from space_robot_msgs_py.errors import SingularAttitudeError, UnusableStateError
from space_robot_msgs_py.samples import Reference, ReferenceChunk, RobotState
from space_robot_sim.environment.friction import FrictionSettings
from space_robot_sim.plant.plant import Plant, PlantSettings

Array = NDArray[np.float64]

NO_FRICTION = FrictionSettings(coulomb=0.0, viscous=0.0)


def measured(case: Case) -> RobotState:
    """The case's state as the sensors report it."""
    s = case.state
    sample = RobotState.allocate(case.robot.n)
    sample.quaternion[:] = s.quaternion
    sample.omega_base[:] = rotation_of(s.quaternion).inv().apply(s.w0)
    sample.joint_positions[:], sample.joint_velocities[:] = s.theta, s.rate
    return sample


# Frames and signs


@settings(max_examples=40)
@given(cases(joints=[6]))
def test_computed_torque_causes_the_acceleration_it_demands(case: Case) -> None:
    """F_S = J^-T tau at any attitude: the torque, in the base frame, makes rhodd = u_PD.

    The reference turns and accelerates too; u_PD and rhodd are worked out here by SciPy and the
    product rule of quaternions.
    """
    robot, s, rng = case
    axes = robot.n + 3
    base = np.concatenate([random_quaternion(rng), rng.normal(size=6)])
    assume(abs(base[:4] @ s.quaternion) > 0.05)
    joints = rng.normal(size=(3, robot.n))
    k_p, k_d = rng.uniform(1.0, 50.0, axes), rng.uniform(1.0, 10.0, axes)
    controller = Controller(robot, find_law("ctc")({"k_p": k_p, "k_d": k_d}, PERIOD), PERIOD)
    torque = controller.update(
        measured(case), ReferenceChunk(0, joints[None], base[None]).references()
    ).torque
    # what is wanted
    relative = RelativeMotion.of(base, s)
    error = np.concatenate([-relative.error[1:], joints[0] - s.theta])
    error_rate = np.concatenate([-relative.rate, joints[1] - s.rate])
    u_pd = np.concatenate([np.zeros(3), joints[2]]) + k_d * error_rate + k_p * error
    np.testing.assert_allclose(controller.law.memory.u, u_pd, rtol=1e-9, atol=1e-9)
    # what happens
    force = np.concatenate([np.zeros(3), rotation_of(s.quaternion).apply(torque[:3]), torque[3:]])
    result = forward_dynamics(robot, s.quaternion, s.theta, s.w0, s.rate, force)[3:]
    result[:3] = relative.second_rate(result[:3])
    np.testing.assert_allclose(result, u_pd, atol=1e-8 * np.abs(u_pd).max())


def test_both_signs_of_the_reference_give_the_same_torque(paper_robot: Robot) -> None:
    """Bit for bit, even where the sign changes from tick to tick."""
    plain, other = (
        Loop(paper_robot, law_of("tde_stc"), initial_quaternion=[0.99, 0.05, -0.1, 0.02])
        for _ in range(2)
    )
    for tick in range(0, 200, 2):
        chunk = other.mission.chunk(tick, 2)
        chunk.base[1, :4] *= -1.0
        other.references.add(chunk)
    np.testing.assert_array_equal(plain.fly(200)[1], other.fly(200)[1])


@pytest.mark.parametrize("name", ["ctc", "tde_smc", "tde_tsmc", "tde_stc"])
def test_both_signs_of_the_measurement_give_the_same_torque(paper_robot: Robot, name: str) -> None:
    """A sensor that reports -q all along: the error's first eta is not negative in either case."""
    start = [0.9, 0.2, -0.3, 0.25]
    plain, other = (
        Loop(paper_robot, law_of(name), initial_quaternion=start, friction=NO_FRICTION)
        for _ in range(2)
    )
    other.flipped = True
    errors, torques = plain.fly(300)
    errors_other, torques_other = other.fly(300)
    np.testing.assert_array_equal(torques_other, torques)
    np.testing.assert_array_equal(errors_other, errors)


def test_measurement_that_changes_sign_in_flight_gives_no_jolt(paper_robot: Robot) -> None:
    """q and -q are one attitude, so a sensor may pass from one to the other at any tick."""
    loop = Loop(paper_robot, law_of("tde_stc"), initial_quaternion=[0.9999, 0.005, 0.01, -0.005])
    before = loop.fly(1500)[1][-1]
    loop.flipped = True
    np.testing.assert_allclose(loop.fly(1)[1][0], before, atol=0.1)


# References that do not go on where they were

STEADY = {
    "tde_smc": {"lambda": 5.0, "g": 0.1},
    "tde_stc": {"lambda": 5.0, "k_1": 0.1, "k_2": 1e-3},
    "tde_tsmc": {"k_p": 25.0, "k_d": 10.0, "k_1": 0.5},
    "indi": {"k_p": 25.0, "k_d": 10.0},
    "dob": {"bandwidth": 80.0, "k_p": 25.0, "k_d": 10.0},
    "adrc": {"omega_c": 5.0, "omega_o": 200.0},
}
"""Laws that compare with the last tick, none with more than K_D = 10 and K_P = 25."""
ALONG = np.array([0.6, -0.64, 0.48])


def slew_at(time: float) -> tuple[Rotation, Array, Array]:
    """Attitude, rate and acceleration of a base that turns faster and faster."""
    acceleration = 0.05 * ALONG
    return Rotation.from_rotvec(0.5 * time**2 * acceleration), time * acceleration, acceleration


def broken_at(time: float, way: str) -> tuple[Rotation, Array, Array]:
    """The same until 0.4 s, then held there; turned away; or held for 0.1 s alone."""
    if time <= 0.4 or (way == "comes back" and time > 0.5):
        return slew_at(time)
    away = [0.02, 0.01, -0.01] if way == "is elsewhere" else np.zeros(3)
    return slew_at(0.4)[0] * Rotation.from_rotvec(away), np.zeros(3), np.zeros(3)


@pytest.mark.parametrize("way", ["is held", "is elsewhere", "comes back"])
@pytest.mark.parametrize("name", STEADY)
def test_a_step_of_the_reference_is_no_acceleration_of_the_robot(
    paper_robot: Robot, name: str, way: str
) -> None:
    """The torque changes by the order of K_D times the step, not of the step in a tick."""
    gains = {gain: np.full(9, value) for gain, value in STEADY[name].items()}
    if name != "indi":
        gains["inertia" if name in ("dob", "adrc") else "h_bar"] = np.array(H_BAR)
    controller = Controller(paper_robot, find_law(name)(gains, PERIOD), PERIOD)
    posture = PAPER_DEG[0]
    plant = Plant(paper_robot, PlantSettings(initial_joints_deg=posture), PERIOD)
    joints = np.zeros((1, 3, 6))
    joints[0, 0] = np.radians(posture)
    torques = []
    for tick in range(1100):
        attitude, omega, alpha = broken_at(tick * PERIOD, way)
        base = np.concatenate([quaternion_of(attitude), omega, alpha])[None]
        command = controller.update(plant.state, ReferenceChunk(tick, joints, base).references())
        torques.append(command.torque[:3].copy())
        plant.step(command)
    of_base = H_BAR[0] if name != "indi" else controller.signals.nominal.inertia[:3, :3].max()
    spike = 0.25 * of_base * 0.02 / PERIOD  # 1/4: J0 of rate and torque
    changes = np.abs(np.diff(torques, axis=0)).max(axis=1)
    assert changes.max() < 0.05 * spike
    assert changes[800:].max() > 10.0 * changes[700:800].max()  # it is a step, all the same


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


@pytest.mark.parametrize(
    ("field", "value", "kind"),
    [
        ("quaternion", np.nan, "state not finite"),
        ("omega_base", np.inf, "state not finite"),
        ("joint_positions", np.nan, "state not finite"),
        ("joint_velocities", -np.inf, "state not finite"),
        ("applied_torque", np.nan, "state not finite"),
        ("joint_velocities", -2.0 * LARGEST, "state too large"),
        ("applied_torque", 1e300, "state too large"),
        ("quaternion", 1.1, "quaternion not unit"),
        ("quaternion", 0.0, "quaternion not unit"),
    ],
)
@pytest.mark.parametrize("place", [0, -1])
def test_an_unusable_state_is_refused_and_forgotten(
    paper_robot: Robot, field: str, value: float, kind: str, place: int
) -> None:
    """Wherever the bad number stands; the flight goes on as if it had not come."""
    if field == "quaternion":
        place = 0
    shown, spared = (Loop(paper_robot, law_of("tde_stc")) for _ in range(2))
    for loop in (shown, spared):
        loop.fly(20)
    state = shown.plant.state.copy()
    getattr(state, field)[place] = value
    with pytest.raises(UnusableStateError, match="at tick 20 the") as caught:
        shown.controller.update(state, shown.references.at(20))
    assert (caught.value.tick, caught.value.kind) == (20, kind)
    np.testing.assert_array_equal(shown.fly(20)[1], spared.fly(20)[1])


def test_numbers_of_opposite_sign_do_not_hide_one_another(paper_robot: Robot) -> None:
    """Infinities, or huge ones, that a plain sum would cancel."""
    controller = Controller(paper_robot, law_of("ctc"), PERIOD)
    for value in (np.inf, 1e200):
        state = RobotState.allocate(6)
        state.quaternion[0], state.joint_velocities[:2] = 1.0, [value, -value]
        with pytest.raises(UnusableStateError):
            controller.update(state, Reference.at_rest(6))


# Force and torque


@settings(max_examples=30)
@given(cases(joints=[6]), st.integers(0, 2**32 - 1))
def test_on_a_turning_base_torque_becomes_force_with_the_attitude_it_began_at(
    case: Case, seed: int
) -> None:
    """Applied from the last tick on, so F_S = J0^-T tau with that tick's J0, whoever asks; after a
    gap that is not known and the present J0 is nearest."""
    rng = np.random.default_rng(seed)
    later = random_quaternion(rng)
    if later @ case.state.quaternion < 0.0:
        later = -later
    assume(min(abs(case.state.quaternion[0]), abs(later[0])) > 0.05)
    torque = rng.normal(size=9)
    reference = Reference.at_rest(6)
    for ticks, began_at in (
        (1, case.state.quaternion),
        (LONGEST_GAP, case.state.quaternion),
        (LONGEST_GAP + 1, later),
    ):
        controller = Controller(case.robot, law_of("tde_stc"), PERIOD)
        state = measured(case)
        controller.update(state, reference)
        sign = np.sign(controller.signals.attitude_error @ state.quaternion)
        state.tick, state.quaternion[:], state.applied_torque[:] = ticks, later, torque
        controller.update(state, reference)
        # either quaternion of an attitude will do, but the same one throughout
        j0 = attitude_jacobian_base(sign * began_at)
        force = controller.signals.applied_force
        np.testing.assert_allclose(j0.T @ force[:3], torque[:3], rtol=1e-9, atol=1e-9)
        np.testing.assert_array_equal(force[3:], torque[3:])
        np.testing.assert_array_equal(controller.block[0].pair.applied_force, force)
        state.tick += 1  # the next interval began at ``later``
        controller.update(state, reference)
        j0 = attitude_jacobian_base(sign * later)
        np.testing.assert_allclose(j0.T @ force[:3], torque[:3], rtol=1e-9, atol=1e-9)


# Taking over


@pytest.mark.parametrize(("period", "ticks"), [(5e-4, 40), (1e-3, 20), (2e-3, 10), (0.1, 1)])
def test_a_transfer_lasts_20_ms(paper_robot: Robot, period: float, ticks: int) -> None:
    """At any period; at least a tick. What is applied is not what the law would do."""
    controller = Controller(paper_robot, find_law("ctc")(GAINS["ctc"], period), period)
    state = RobotState.allocate(6)
    state.joint_positions[:], state.applied_torque[:] = 0.1, 1.0
    shares = []
    for tick in range(1, ticks + 4):
        state.tick = tick
        controller.update(state, Reference.at_rest(6))
        own = controller.law.force(controller.signals)
        shares.append(np.abs(controller.block[0].force - own).max())
    assert all(share > 0.0 for share in shares[:ticks])
    assert shares[ticks:] == [0.0] * 3


def test_a_law_takes_over_within_the_transfer_and_then_is_alone(paper_robot: Robot) -> None:
    """The first torque is the one that was applied; 20 ms later it is the law's own."""
    loop = Loop(paper_robot, law_of("tde_stc"))
    before = loop.fly(1000)[1][-1]
    loop.controller.law = law_of("ctc")
    ticks = round(TRANSFER_S / PERIOD)
    shares = []
    for tick in range(ticks + 5):
        torque = loop.fly(1)[1][0]
        memory = loop.controller.block[0]
        own = loop.controller.law.force(loop.controller.signals)
        shares.append(np.abs(memory.force - own).max())
        if tick == 0:
            np.testing.assert_allclose(torque, before, atol=1e-9)
    assert shares[0] > 0.0
    fade = 1.0 - np.minimum(np.arange(ticks + 5) / ticks, 1.0)
    np.testing.assert_allclose(shares, shares[0] * fade, atol=1e-12)
    assert shares[ticks:] == [0.0] * 5


def test_at_tick_0_nothing_is_taken_over(paper_robot: Robot) -> None:
    """The law's own torque from the beginning."""
    loop = Loop(paper_robot, law_of("ctc"), initial_quaternion=[0.99, 0.1, 0.05, 0.05])
    loop.fly(1)
    own = loop.controller.law.force(loop.controller.signals)
    np.testing.assert_array_equal(loop.controller.block[0].force, own)


@pytest.mark.parametrize("name", GAINS)
def test_close_to_half_a_turn_the_torque_is_finite(paper_robot: Robot, name: str) -> None:
    controller = Controller(paper_robot, law_of(name), PERIOD)
    state = RobotState.allocate(6)
    state.quaternion[:] = [1e-4, np.sqrt(1.0 - 1e-8), 0.0, 0.0]
    assert np.isfinite(controller.update(state, Reference.at_rest(6)).torque).all()


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
