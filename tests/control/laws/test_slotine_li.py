"""The adaptive law against its equations in NumPy, and its Lyapunov function on ideal plants."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import scipy.linalg
from hypothesis import given, settings
from hypothesis import strategies as st
from oracles import attitude_jacobian_base, rotation_of
from oracles.second_moments import Jacobians, jacobians, second_moments
from scipy.integrate import solve_ivp
from strategies import Case, branched_cases, cases, random_robot, random_state

from space_robot_control.laws import Signals
from space_robot_control.laws.slotine_li import SlotineLi
from space_robot_model.dynamics.regressor import (
    Regressor,
    force_in_rho,
    force_on_vectors_into,
    motions_into,
    take_rho,
    vectors_into,
)
from space_robot_model.dynamics.rho_space import RhoSpaceModel, rho_space_into
from space_robot_model.elementary.matrices import Array
from space_robot_model.robot import Robot
from space_robot_msgs_py.compiled.records import assign

PERIOD = 5e-4
FEW = settings(max_examples=12, deadline=None)


class NumpyLaw:
    """The law in dense matrices; projections by SciPy's generalised eigenvalues."""

    def __init__(self, robot: Robot, gains: dict[str, Array]) -> None:
        self.robot, self.gains = robot, gains
        spread, gamma = self.of_bodies(gains["spread"]), self.of_bodies(gains["gamma"])
        self.lower, self.upper = (second_moments(robot, 1.0 + k * spread) for k in (-1.0, 1.0))
        self.metric = second_moments(robot, np.sqrt(gamma))
        self.estimate = second_moments(robot)

    @staticmethod
    def of_bodies(gain: Array) -> Array:
        """The base's first axis, then the joints."""
        return np.concatenate([gain[:1], gain[3:]])

    def force(self, model: Jacobians, s: Array, v: Array, v_rate: Array) -> Array:
        """``Y pi + K_D s``."""
        return model.force(self.estimate, v, v_rate) + self.gains["k_d"] * s

    def adapt(self, model: Jacobians, s: Array, v: Array, v_rate: Array) -> None:
        """One step by Euler, then below the upper bound, then above the lower one."""
        change = PERIOD * self.metric @ model.gradient(s, v, v_rate) @ self.metric
        of_s, of_v = (
            np.sqrt(np.einsum("kl,ka,la", self.metric, one, one))
            for one in (model.of_vectors @ s, model.of_vectors @ v_rate + model.rates @ v)
        )
        width = np.trace(np.linalg.solve(self.metric, self.upper - self.lower))
        change *= min(1.0, width / max(PERIOD * of_s * of_v, 1e-300))
        self.estimate = self.estimate + change
        for bound, side in ((self.upper, -1.0), (self.lower, 1.0)):
            values, vectors = scipy.linalg.eigh(side * (self.estimate - bound), self.metric)
            moved = self.metric @ vectors
            lack = np.maximum(-values, 0.0)
            self.estimate = self.estimate + side * (moved * lack) @ moved.T

    def distance(self, one: Array, other: Array) -> float:
        """In the norm of ``Gamma^-1``."""
        difference = np.linalg.solve(self.metric, one - other)
        return float(np.trace(difference @ difference))


def random_gains(rng: np.random.Generator, axes: int, gamma: float) -> dict[str, Array]:
    return {
        "lambda": rng.uniform(1.0, 3.0, axes),
        "k_d": rng.uniform(1.0, 50.0, axes),
        "gamma": gamma * rng.uniform(0.5, 2.0, axes),
        "spread": rng.uniform(0.2, 0.8, axes),
    }


def signals_of(case: Case, scale: float = 1.0, is_free: bool = False) -> Any:
    """Random signals of a robot, the errors of a size; its block is kept in ``block``."""
    n, rng = case.robot.n, case.rng
    block = Signals.block(n)
    assign(block[0], model=case.robot.model, base_is_free=float(is_free))
    signals: Any = Signals.view(block)
    signals.block = block
    renew(signals, case, scale)
    signals.quaternion[:] = case.state.quaternion
    signals.quaternion[0] = abs(case.state.quaternion[0]) + 0.2
    signals.quaternion[:] /= np.linalg.norm(signals.quaternion)
    signals.attitude_error[:] = signals.quaternion
    signals.joint_positions[:] = case.state.theta
    signals.omega_base[:] = rng.normal(size=3)
    return signals


def renew(signals: Any, case: Case, scale: float = 1.0) -> None:
    """Draw other motion and errors."""
    for name in ("error", "error_rate", "acceleration_desired", "rho_rate"):
        size = scale if "error" in name else 1.0
        getattr(signals, name)[:] = size * case.rng.normal(size=case.robot.n + 3)


def motion(signals: Any, gains: dict[str, Array]) -> tuple[Array, Array, Array]:
    """s, v and vdot."""
    s = signals.error_rate + gains["lambda"] * signals.error
    v_rate = signals.acceleration_desired + gains["lambda"] * signals.error_rate
    return s, s + signals.rho_rate, v_rate


def model_of(case: Case, signals: Any) -> Jacobians:
    """The oracle's model where the signals are."""
    quaternion, rate = signals.quaternion, signals.rho_rate
    return jacobians(case.robot, quaternion, signals.joint_positions, rate)


@pytest.mark.parametrize("gamma", [1e-4, 3.0])
@FEW
@given(case=cases([3, 6]) | branched_cases([3, 6]))
def test_kernel_is_the_equation(gamma: float, case: Case) -> None:
    """Forces and estimates over some ticks; with the larger gain the projection acts, mostly."""
    gains, signals = random_gains(case.rng, case.robot.n + 3, gamma), signals_of(case)
    law, form = SlotineLi(gains, PERIOD), NumpyLaw(case.robot, gains)
    for _ in range(6):
        renew(signals, case, 0.3)
        s, v, v_rate = motion(signals, gains)
        model = model_of(case, signals)
        expected = form.force(model, s, v, v_rate)
        np.testing.assert_allclose(
            law.force(signals), expected, rtol=0, atol=1e-9 * np.abs(expected).max()
        )
        form.adapt(model, s, v, v_rate)
        size = np.sqrt(np.diag(form.upper))
        difference = (np.asarray(law.memory.estimate) - form.estimate) / np.outer(size, size)
        assert np.abs(difference).max() < 1e-9


@FEW
@given(case=cases([3, 6]) | branched_cases([3, 6]))
def test_a_base_that_nothing_turns_gets_no_torque(case: Case) -> None:
    """Its reference moves as ``[Y pi]_0 + K_0 s_0 = 0`` says; the joints have the same law."""
    robot, gains = case.robot, random_gains(case.rng, case.robot.n + 3, 1e-4)
    law, form, signals = (
        SlotineLi(gains, PERIOD),
        NumpyLaw(robot, gains),
        signals_of(case, 1.0, True),
    )
    base_rate = np.zeros(3)
    for tick in range(5):
        renew(signals, case, 0.3)
        signals.omega_base[:] += 0.1 * case.rng.normal(size=3)
        s, v, v_rate = motion(signals, gains)
        w0 = rotation_of(signals.quaternion).apply(signals.omega_base)
        base_rate = base_rate if tick else w0
        rate = np.concatenate([w0, signals.rho_rate[3:]])
        s[:3], v[:3], v_rate[:3] = base_rate - w0, base_rate, 0.0
        model = jacobians(robot, signals.quaternion, signals.joint_positions, rate, in_rho=False)
        rest = model.force(form.estimate, v, v_rate)[:3] + 0.25 * gains["k_d"][:3] * s[:3]
        v_rate[:3] = -np.linalg.solve(model.inertia(form.estimate)[:3, :3], rest)
        expected = form.force(model, s, v, v_rate)
        force = law.force(signals)
        np.testing.assert_array_equal(force[:3], 0.0)
        np.testing.assert_allclose(
            force[3:], expected[3:], rtol=0, atol=1e-9 * np.abs(expected).max()
        )
        form.adapt(model, s, v, v_rate)
        base_rate = base_rate + PERIOD * v_rate[:3]


@FEW
@given(
    case=cases([1, 3, 6]) | branched_cases([1, 3, 6]),
    scale=st.sampled_from([1.0, 1e2, 1e5, 1e15, 1e30]),
    gamma=st.sampled_from([0.0, 1e-2, 1.0, 1e3]),
)
def test_no_error_makes_the_estimate_unphysical(case: Case, scale: float, gamma: float) -> None:
    """It stays above the lightest robot, whose moments are positive definite, whatever s is."""
    gains = random_gains(case.rng, case.robot.n + 3, gamma)
    law, form, signals = SlotineLi(gains, PERIOD), NumpyLaw(case.robot, gains), signals_of(case)
    width = np.sqrt(np.diag(form.upper))
    scaled = np.outer(width, width)
    for _ in range(8):
        renew(signals, case, scale)
        law.force(signals)
        estimate = np.asarray(law.memory.estimate)
        np.testing.assert_array_equal(estimate, estimate.T)
        assert np.linalg.eigvalsh((estimate - form.lower) / scaled)[0] > -1e-10
        assert np.linalg.eigvalsh(estimate / scaled)[0] > 0.0
        assert np.linalg.eigvalsh((1.05 * form.upper - estimate) / scaled)[0] > -0.5
    inertia = model_of(case, signals).inertia(estimate)
    assert np.linalg.eigvalsh(inertia)[0] > 0.0


def test_the_estimate_starts_at_the_nominal_robot_and_outlives_changes_of_gains() -> None:
    rng = np.random.default_rng(3)
    case = Case(random_robot(rng, 6), random_state(rng, 6), rng)
    gains, signals = random_gains(rng, 9, 1e-3), signals_of(case)
    law = SlotineLi(gains, PERIOD)
    first = law.force(signals).copy()
    learned = np.asarray(law.memory.estimate).copy()
    assert np.abs(learned - second_moments(case.robot)).max() > 1e-6
    law.gain_values = {**gains, "gamma": np.zeros(9)}
    law.force(signals)
    np.testing.assert_array_equal(law.memory.estimate, learned)
    law.gain_values = gains
    law.reset()
    np.testing.assert_array_equal(law.force(signals), first)


def desired(t: float, axes: int) -> tuple[Array, Array, Array]:
    """rho_d and its rates: each axis swings with a frequency of its own."""
    frequency = 0.5 + 0.15 * np.arange(axes)
    amplitude = np.where(np.arange(axes) < 3, 0.1, 0.6)
    angle = frequency * t
    return (
        amplitude * np.sin(angle),
        amplitude * frequency * np.cos(angle),
        -amplitude * frequency**2 * np.sin(angle),
    )


class IdealPlant:
    """The continuous law with its estimate, and a plant whose bodies are off; both by kernels."""

    def __init__(self, off: float) -> None:
        rng = np.random.default_rng(5)
        self.robot = robot = random_robot(rng, 2)
        factor = 1.0 + off * rng.choice([-1.0, 1.0], robot.n + 1)
        mass, inertia = robot.mass * factor, robot.inertia * factor[:, None, None]
        self.plant = replace(robot, mass=mass, inertia=inertia)
        self.axes, self.size, self.slope = robot.n + 3, 2 * robot.n + 3, 3.0
        at_rest = jacobians(robot, np.eye(4)[0], np.zeros(robot.n), np.zeros(self.axes))
        effective = 1.0 / np.diag(np.linalg.inv(at_rest.inertia(second_moments(robot))))
        same = np.ones(self.axes)
        self.gains = {"k_d": 20.0 * effective, "gamma": 3.0 * same, "spread": 0.6 * same}
        self.form = NumpyLaw(robot, self.gains)
        self.work, self.out = Regressor.allocate(robot.n), RhoSpaceModel.allocate(robot.n)

    def motion(self, t: float, x: Array) -> tuple[Array, Array, Array, Array, Array]:
        """Quaternion, rate, s, v and vdot of a state."""
        rho, rate = x[: self.axes], x[self.axes : 2 * self.axes]
        rho_d, rate_d, acceleration_d = desired(t, self.axes)
        s = rate_d - rate + self.slope * (rho_d - rho)
        v_rate = acceleration_d + self.slope * (rate_d - rate)
        quaternion = np.concatenate([[np.sqrt(1.0 - rho[:3] @ rho[:3])], rho[:3]])
        return quaternion, rate, s, s + rate, v_rate

    def frame(self, t: float) -> tuple[Array, Array]:
        """Rate and acceleration of the desired frame, which never comes to rest."""
        frequencies, phases = np.array([0.9, 1.3, 0.7]), np.array([0.0, 1.0, 2.0])
        angle = frequencies * t + phases
        return 0.4 * np.sin(angle), 0.4 * frequencies * np.cos(angle)

    def estimate(self, x: Array) -> Array:
        return x[2 * self.axes : -1].reshape(self.size, self.size)

    def rates(self, t: float, x: Array) -> Array:
        """Of rho, rhodot, the estimate, and what the damping has taken."""
        quaternion, rate, s, v, v_rate = self.motion(t, x)
        theta, work, force = x[3 : self.axes].copy(), self.work, np.zeros(self.axes)
        vectors_into(self.robot.model, quaternion, theta, work)
        take_rho(quaternion, *self.frame(t), rate, s, v, v_rate, work)
        motions_into(self.robot.model, work)
        forces = work.acceleration @ self.estimate(x)
        force_on_vectors_into(self.robot.model, forces, work, force)
        force_in_rho(work, force)
        force += self.gains["k_d"] * s
        omega, alpha = self.frame(t)
        omega_base = np.linalg.solve(attitude_jacobian_base(quaternion), rate[:3])
        omega_base += rotation_of(quaternion).inv().apply(omega)
        moving = theta, omega_base, rate[3:].copy(), omega, alpha
        rho_space_into(self.plant.model, quaternion, *moving, self.out)
        acceleration = np.linalg.solve(self.out.inertia, force - self.out.bias)
        product = self.form.metric @ work.sliding.T @ work.acceleration @ self.form.metric
        change = 0.5 * (product + product.T).ravel()
        return np.concatenate([rate, acceleration, change, [s @ (self.gains["k_d"] * s)]])

    def function(self, t: float, x: Array) -> float:
        """``s^T H s / 2 + |pi - pi*|^2 / 2``."""
        quaternion, rate, s, *_ = self.motion(t, x)
        true = second_moments(self.plant)
        inertia = jacobians(self.robot, quaternion, x[3 : self.axes], rate).inertia(true)
        return float(0.5 * s @ inertia @ s + 0.5 * self.form.distance(self.estimate(x), true))


def test_lyapunov_function_falls_by_the_damping_alone() -> None:
    """V never rises, falls by ``s^T K_D s`` and nothing else, and the errors die out.

    The desired frame turns and accelerates, and the desired motion moves relative to it.
    """
    ideal = IdealPlant(0.5)
    rho_d, rate_d, _ = desired(0.0, ideal.axes)
    nominal = second_moments(ideal.robot)
    start = np.concatenate([rho_d - 0.02, 0.8 * rate_d, nominal.ravel(), [0.0]])
    times = np.linspace(0.0, 15.0, 76)
    flown = solve_ivp(
        ideal.rates, (0.0, times[-1]), start, "DOP853", times, rtol=1e-8, atol=1e-10
    ).y.T
    values = np.array([ideal.function(t, x) for t, x in zip(times, flown, strict=True)])
    assert (np.diff(values) < 1e-8 * values[0]).all()
    np.testing.assert_allclose(values[0] - values, flown[:, -1], rtol=0, atol=1e-6 * values[0])
    assert values[-1] < 0.9 * values[0]
    desired_rho = np.array([desired(t, ideal.axes)[0] for t in times])
    errors = np.abs(desired_rho - flown[:, : ideal.axes]).max(axis=1)
    assert errors[-15:].max() < 0.1 * errors[:15].max()
