"""What laws see at a tick: every signal beside its definition, measured and estimated, with and
without a base to control."""

from __future__ import annotations

import copy
import pickle
from typing import Any, NamedTuple

import numpy as np
import pytest
from closed_loop import NAVIGATION, PERIOD
from hypothesis import given, settings
from hypothesis import strategies as st
from law_equations import random_gains
from oracles import attitude_jacobian_base, quaternion_of, rotation_of
from scipy.spatial.transform import Rotation
from strategies import random_quaternion, random_robot

from space_robot import Scenario
from space_robot_control.controller.controller import Controller
from space_robot_control.controller.time_delay_estimation import LONGEST_GAP
from space_robot_control.laws import ControlLaw, find_law, laws
from space_robot_control.laws.base import CONSTANT_INERTIA, NO_ESTIMATE, NOMINAL_INERTIA
from space_robot_control.navigation.navigation import Navigation, navigate
from space_robot_control.navigation.rate_filters import low_pass_weight
from space_robot_model.dynamics.attitude import attitude_error_into
from space_robot_model.elementary.matrices import Array
from space_robot_model.hardware.base_actuators import BaseActuatorSettings
from space_robot_model.robot import Robot
from space_robot_model.robot.kinematics import tool_state
from space_robot_msgs_py.errors import InputError
from space_robot_msgs_py.samples import Reference, ReferenceChunk, RobotState

FREE = BaseActuatorSettings(base_actuation="none")
TICKS = 6
M_AXES = (
    *("error", "error_rate", "acceleration_desired", "n_hat", "rho", "rho_rate"),
    *("applied_force", "paired_force", "paired_acceleration", "rho_step", "rate_step"),
)
"""Signals with a value per axis."""
LAWS = sorted(laws())


def law_with(name: str, n: int) -> ControlLaw:
    """A law with random gains; ``tde_stc nominal`` has ``h_bar: nominal``."""
    law = find_law(name.split()[0])
    gains = random_gains(law, n + 3, seed=n)
    if name.endswith("nominal"):
        gains["h_bar"] = np.zeros(n + 3)
    return law(gains, PERIOD)


class Motion:
    """A robot that turns and moves somehow, and a reference that jumps about it, tick by tick."""

    def __init__(self, rng: np.random.Generator, n: int) -> None:
        self._rng, self._n = rng, n
        self._attitude = rotation_of(random_quaternion(rng))
        self._omega, self._theta, self._rate = (rng.normal(size=k) for k in (3, n, n))
        self.tick = int(rng.integers(0, 10**6))

    def step(self, ticks: int) -> tuple[RobotState, Any]:
        """State and reference ``ticks`` later; their quaternions have any sign."""
        rng, duration = self._rng, ticks * PERIOD
        self._attitude *= Rotation.from_rotvec(self._omega * duration)
        self._theta = self._theta + duration * self._rate
        self._omega = self._omega + 0.01 * rng.normal(size=3)
        self._rate = self._rate + 0.01 * rng.normal(size=self._n)
        self.tick += ticks
        state = RobotState.allocate(self._n)
        state.tick = self.tick
        state.quaternion[:] = quaternion_of(self._attitude) * rng.choice([-1.0, 1.0])
        state.omega_base[:], state.joint_positions[:] = self._omega, self._theta
        state.joint_velocities[:] = self._rate
        state.applied_torque[:] = rng.normal(size=self._n + 3)
        error = random_quaternion(rng)
        error[0] += 2.0  # away from half a turn
        desired = self._attitude * rotation_of(error / np.linalg.norm(error)).inv()
        quaternion = quaternion_of(desired) * rng.choice([-1.0, 1.0])
        base = np.concatenate([quaternion, rng.normal(size=6)])
        joints = rng.normal(size=(3, self._n))
        return state, ReferenceChunk(self.tick, joints[None], base[None]).references()


class Base(NamedTuple):
    """The base at a tick."""

    attitude: Rotation
    omega: Array
    error: Array
    """q_e."""
    rate: Array
    """epsdot_e."""


def near(quaternion: Array, other: Array) -> Array:
    """The quaternion, or its negative, which is the same attitude."""
    return quaternion if quaternion @ other >= 0.0 else -quaternion


def base_of(attitude: Rotation, omega: Array, desired: Rotation, omega_d: Array, q: Array) -> Base:
    """The base relative to a desired frame, on the side of ``q``."""
    relative = desired.inv() * attitude
    error = near(quaternion_of(relative), q)
    rate = attitude_jacobian_base(error) @ (omega - relative.inv().apply(omega_d))
    return Base(attitude, omega, error, rate)


class Expected:
    """The signals by their definitions, from one state and reference after another."""

    def __init__(self, controls_base: bool, corner_hz: float = 0.0) -> None:
        self._controls_base = controls_base
        self._weight = low_pass_weight(corner_hz, PERIOD) or 1.0
        self._base: Base | None = None
        self._tick = -1000
        self._of_last: tuple[Array, Array] = np.zeros(0), np.zeros(0)
        self._pair: tuple[Array, Array] = np.zeros(0), np.zeros(0)

    def after(
        self, state: RobotState, reference: Any, pair_of: tuple[Array, Array, Array] | None = None
    ) -> dict[str, Array]:
        """The signals of a tick.

        ``pair_of`` are base rate, joint rates and torque for the time-delay pair, if they are not
        those of the state.
        """
        r, last = reference[0], self._base
        desired, attitude = rotation_of(r.quaternion), rotation_of(state.quaternion)
        side = np.array([1.0, 0.0, 0.0, 0.0]) if last is None else last.error
        base = base_of(attitude, state.omega_base.copy(), desired, r.omega_base, side)
        j0, steps = attitude_jacobian_base(base.error), np.zeros((2, 3 + len(r.joint_positions)))
        began = j0
        if last is not None and self._follows(state.tick):
            began = attitude_jacobian_base(last.error)
            elapsed = (state.tick - self._tick) * PERIOD
            before = r.omega_base - elapsed * r.alpha_base
            turn = Rotation.from_rotvec(0.5 * elapsed * (before + r.omega_base))
            there = base_of(last.attitude, last.omega, desired * turn.inv(), before, base.error)
            steps[:, :3] = there.error[1:] - last.error[1:], there.rate - last.rate
        signals = {
            "quaternion": state.quaternion.copy(),
            "omega_base": state.omega_base.copy(),
            "joint_positions": state.joint_positions.copy(),
            "joint_velocities": state.joint_velocities.copy(),
            "attitude_error": base.error if self._controls_base else state.quaternion.copy(),
            "rho": np.concatenate([base.error[1:], state.joint_positions]),
            "rho_rate": np.concatenate([base.rate, state.joint_velocities]),
            "rho_step": steps[0],
            "rate_step": steps[1],
            "applied_force": force_of(began, state.applied_torque),
        }
        joints = [r.joint_positions, r.joint_velocities, r.joint_accelerations]
        rho_d = [np.concatenate([np.zeros(3), row]) for row in joints]
        signals["error"] = rho_d[0] - signals["rho"]
        signals["error_rate"] = rho_d[1] - signals["rho_rate"]
        signals["acceleration_desired"] = rho_d[2]
        rate, force = signals["rho_rate"], signals["applied_force"]
        if pair_of is not None:
            omega = pair_of[0] - attitude.inv().apply(desired.apply(r.omega_base))
            rate = np.concatenate([j0 @ omega, pair_of[1]])
            force = force_of(began, pair_of[2])
        if not self._controls_base:
            rate, force = rate.copy(), force.copy()
            for column in (*(signals[n] for n in M_AXES if n in signals), rate, force):
                column[:3] = 0.0
        self._observe(state.tick, force, rate, signals)
        signals["paired_force"], signals["paired_acceleration"] = self._pair
        self._base, self._tick = base, state.tick
        return signals

    def _follows(self, tick: int) -> bool:
        return 1 <= tick - self._tick <= LONGEST_GAP

    def _observe(self, tick: int, force: Array, rate: Array, signals: dict[str, Array]) -> None:
        """The low-pass of both; at the first tick of a pair, the force and the desired motion.

        What the reference's own step makes of the rate is no acceleration.
        """
        new = force.copy(), signals["acceleration_desired"].copy()
        if self._follows(tick):
            change = rate - self._of_last[1] - signals["rate_step"]
            acceleration = change / ((tick - self._tick) * PERIOD)
            old, w = self._pair, self._weight
            new = old[0] + w * (force - old[0]), old[1] + w * (acceleration - old[1])
        self._pair, self._of_last = new, (force.copy(), rate.copy())


def force_of(j0: Array, torque: Array) -> Array:
    """``F_S = J^-T tau``."""
    return np.concatenate([np.linalg.solve(j0.T, torque[:3]), torque[3:]])


def check(controller: Controller, state: RobotState, reference: Any, wanted: Any) -> None:
    """Compare all signals but those of the model."""
    signals: Any = controller.signals
    assert signals.tick == state.tick
    assert signals.time == pytest.approx(state.tick * PERIOD, rel=1e-15)
    for name, column in wanted.items():
        size = 1.0 + np.abs(column).max()
        np.testing.assert_allclose(
            getattr(signals, name), column, rtol=0.0, atol=1e-10 * size, err_msg=name
        )
    assert reference.dtype.names
    for name in reference.dtype.names:
        np.testing.assert_array_equal(getattr(signals.reference, name), reference[name][0])


steps = st.lists(
    st.sampled_from([1, 1, 1, 3, LONGEST_GAP, LONGEST_GAP + 1]), min_size=1, max_size=8
)


@settings(max_examples=40)
@given(
    seed=st.integers(0, 2**32 - 1),
    n=st.sampled_from([1, 6, 7]),
    name=st.sampled_from([*LAWS, "tde_stc nominal"]),
    controls_base=st.booleans(),
    corner_hz=st.sampled_from([0.0, 20.0]),
    gaps=steps,
)
def test_measured_signals_are_what_they_are_defined_to_be(
    seed: int, n: int, name: str, controls_base: bool, corner_hz: float, gaps: list[int]
) -> None:
    """Over short and long gaps, whatever the sign of the measured quaternion."""
    rng = np.random.default_rng(seed)
    robot = random_robot(rng, n)
    law = law_with(name, n)
    actuators = None if controls_base else FREE
    controller = Controller(robot, law, PERIOD, corner_hz, actuators=actuators)
    motion, expected = Motion(rng, n), Expected(controls_base, corner_hz)
    for gap in gaps:
        state, reference = motion.step(gap)
        command = controller.update(state, reference)
        wanted = expected.after(state, reference)
        signals: Any = controller.signals
        check(controller, state, reference, wanted)
        force, acceleration = wanted["paired_force"], wanted["paired_acceleration"]
        inertia = signals.nominal.inertia
        explained = {
            NO_ESTIMATE: force,
            CONSTANT_INERTIA: law.h_bar * acceleration if law.h_bar.size else force,
            NOMINAL_INERTIA: inertia @ acceleration,
        }[law.estimate]
        size = 1.0 + np.abs(force).max() + np.abs(explained).max()
        np.testing.assert_allclose(signals.n_hat, force - explained, rtol=0.0, atol=1e-9 * size)
        assert inertia.any() == law.needs_model
        if not controls_base:
            for axis_signal in M_AXES:
                assert (getattr(signals, axis_signal)[:3] == 0.0).all()
            assert (command.torque[:3] == 0.0).all()
            assert np.isfinite(controller.telemetry()).all()
            for output in ("s", "u", "force"):
                assert (getattr(controller.law.memory, output)[:3] == 0.0).all()


@settings(max_examples=20)
@given(
    seed=st.integers(0, 2**32 - 1),
    name=st.sampled_from(["pd", "tde_stc", "tde_stc nominal", "indi"]),
    controls_base=st.booleans(),
    corner_hz=st.sampled_from([0.0, 20.0]),
)
def test_behind_navigation_the_signals_are_its_estimates(
    seed: int, name: str, controls_base: bool, corner_hz: float
) -> None:
    """But the pair of the nominal inertia has the rates and the torque as they are measured, less
    the gyro's bias, so that all axes' are of the same time."""
    rng = np.random.default_rng(seed)
    actuators = None if controls_base else FREE
    law = law_with(name, 6)
    controller = Controller(
        random_robot(rng, 6), law, PERIOD, corner_hz, navigation=NAVIGATION, actuators=actuators
    )
    alone = Navigation.build(6, NAVIGATION, PERIOD)
    alone.attitude.bias[:] = controller.block[0].navigation.attitude.bias[:] = [0.1, -0.2, 0.3]
    motion, expected = Motion(rng, 6), Expected(controls_base, corner_hz)
    for _ in range(TICKS):
        state, reference = motion.step(1)
        controller.update(state, reference)
        navigate(alone, state.tick, state.block[0], PERIOD)
        estimate = state.copy()
        for part in ("quaternion", "omega_base", "joint_positions", "joint_velocities"):
            getattr(estimate, part)[:] = getattr(alone.estimate, part)
        estimate.applied_torque[:] = alone.estimate.applied_torque
        measured = state.omega_base - alone.attitude.bias, state.joint_velocities
        pair_of = (*measured, state.applied_torque) if law.needs_model else None
        check(controller, state, reference, expected.after(estimate, reference, pair_of))


def test_after_a_swap_the_pair_begins_anew_where_its_rates_are_others(paper_robot: Robot) -> None:
    """Behind navigation alone: a difference of a measured rate and an estimated one is no
    acceleration."""
    for navigation in (None, NAVIGATION):
        rng = np.random.default_rng(3)
        controller = Controller(paper_robot, law_with("tde_stc", 6), PERIOD, navigation=navigation)
        motion = Motion(rng, 6)
        for name in ("tde_stc", "indi", "tde_stc nominal", "ctc"):
            controller.law = law_with(name, 6)
            anew = []
            for _ in range(3):
                controller.update(*motion.step(1))
                signals = controller.signals
                anew.append(
                    bool((signals.paired_acceleration == signals.acceleration_desired).all())
                )
            is_other = navigation is not None and name in ("indi", "ctc")
            assert anew[0] == (is_other or (name == "tde_stc")), name
            assert anew[1:] == [False, False], name


def test_the_error_passes_half_a_turn_without_a_jump() -> None:
    """Turned on and on, eta of q_e follows the cosine of half the angle, below zero, too."""
    desired, axis = random_quaternion(np.random.default_rng(2)), np.array([0.6, 0.0, -0.8])
    error = np.zeros(4)
    for angle in np.linspace(0.0, 4.0 * np.pi, 500):
        attitude = rotation_of(desired) * Rotation.from_rotvec(angle * axis)
        attitude_error_into(desired, quaternion_of(attitude), error)
        expected = [np.cos(angle / 2), *(np.sin(angle / 2) * axis)]
        np.testing.assert_allclose(error, expected, atol=1e-14)


# The tool


@pytest.mark.parametrize("name", ["paper", "dual_arm", "flexible_panels", "boom"])
def test_the_tool_is_that_of_the_nominal_robot(name: str) -> None:
    """Passive joints are locked; every tool has its name."""
    gains = {"k_p": 1.0, "k_d": 1.0}
    flight = Scenario(robot=name, controller="pd", gains=gains, duration=0.05).check()
    robot, controller = flight.controller.signals.robot, flight.controller
    rng, n = np.random.default_rng(1), robot.n
    attitude, theta = random_quaternion(rng), rng.normal(size=n)
    state = RobotState.allocate(n)
    state.quaternion[:], state.joint_positions[:] = attitude, theta
    controller.update(state, Reference.at_rest(n))
    for tool in (None, *(tool.name for tool in robot.tools)):
        actual = controller.signals.tool_state(tool)
        wanted = tool_state(robot, attitude, theta, tool)
        assert actual.tobytes() == wanted.tobytes()
        if tool is None:  # and by the robot's own Jacobian
            jacobian = robot.tool_jacobian(theta, attitude, "free")
            np.testing.assert_allclose(actual.free, jacobian, atol=1e-12)
    with pytest.raises(InputError, match="nonesuch"):
        controller.signals.tool_state("nonesuch")


# Laws in Python


def test_a_view_of_signals_cannot_be_copied_but_a_controller_can(paper_robot: Robot) -> None:
    """The copy has signals of its own, with the robot, and answers the same."""
    rng = np.random.default_rng(5)
    controller = Controller(paper_robot, law_with("adrc", 6), PERIOD)
    motion = Motion(rng, 6)
    controller.update(*motion.step(1))
    for copying in (copy.copy, copy.deepcopy, pickle.dumps):
        with pytest.raises(TypeError, match="a view of a record cannot be copied or pickled"):
            copying(controller.signals)
    copies = [copy.deepcopy(controller), pickle.loads(pickle.dumps(controller))]
    state, reference = motion.step(1)
    torque = controller.update(state, reference).torque.copy()
    for other in copies:
        np.testing.assert_array_equal(other.update(state, reference).torque, torque)
        assert other.signals.time == controller.signals.time
        position = other.signals.tool_state().position
        np.testing.assert_array_equal(position, controller.signals.tool_state().position)
        other.signals.error[:] = np.nan
        assert np.isfinite(controller.signals.error).all()
