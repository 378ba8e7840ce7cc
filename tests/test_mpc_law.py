"""The model predictive law of examples/mpc_law.py beside Riccati's recursion and another solver."""

from __future__ import annotations

import copy
import pickle
from typing import Any

import cvxpy
import numpy as np
import pytest
from paths import ROOT

from space_robot_model.elementary.matrices import Array

pytest.importorskip("daqp")

from space_robot import Scenario
from space_robot_control.laws import ControlLaw, Signals, find_law

AXES = 9
LAW: Any = find_law(f"{ROOT / 'examples/mpc_law.py'}:ModelPredictiveControl")
NO_LIMIT = 1e9


def law(limit: Array | float, weight: Array | float = 1.0, kind: Any = LAW) -> ControlLaw:
    gains = {"weight": np.full(AXES, weight), "torque_limit": np.full(AXES, limit)}
    made: ControlLaw = kind(gains, 5e-4)
    return made


def signals(seed: int) -> Signals:
    """Of a random attitude, with an inertia whose eigenvalues spread over a factor of 1000."""
    rng = np.random.default_rng(seed)
    made = Signals.view(Signals.block(AXES - 3))
    made.error[:], made.error_rate[:], made.acceleration_desired[:] = rng.normal(
        scale=[[1e-3], [1e-2], [0.1]], size=(3, AXES)
    )
    turn = np.linalg.qr(rng.normal(size=(AXES, AXES)))[0]
    made.nominal.inertia[:] = turn * 10.0 ** rng.uniform(0.0, 3.0, AXES) @ turn.T
    made.nominal.bias[:] = rng.normal(size=AXES)
    made.nominal.rotation[:] = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    made.nominal.to_force[:] = 2.0 * np.eye(3) + 0.3 * rng.normal(size=(3, 3))
    return made


def torque_of(x: Signals, force: Array) -> Array:
    """``J^T F``: force on the inertial axes of J0^T, turned into the base frame."""
    base = x.nominal.rotation.T @ np.linalg.inv(x.nominal.to_force) @ force[:3]
    return np.concatenate((base, force[3:]))


def stages(kind: Any) -> list[tuple[Array, Array, Array, float]]:
    """Of each step: A, B, the cost of the state after it, and of the acceleration in it."""
    w, last = kind.bandwidth, len(kind.steps) - 1
    follows = np.array([[2.0 * w**3, w**2], [w**2, 2.0 * w]])
    return [
        (
            np.array([[1.0, h], [0.0, 1.0]]),
            np.array([[h * h / 2.0], [h]]),
            follows if k == last else h * np.diag([w**4, 2.0 * w**2]),
            h,
        )
        for k, h in enumerate(kind.steps)
    ]


def riccati_gain(kind: Any) -> Array:
    """(2,) K of ``e'' = -K [e, edot]`` in the first step, backwards from the last."""
    value, gain = np.zeros((2, 2)), np.zeros((1, 2))
    for a, b, cost, r in reversed(stages(kind)):
        value = value + cost
        gain = np.linalg.solve(r + b.T @ value @ b, b.T @ value @ a)
        value = a.T @ value @ (a - b @ gain)
    return gain[0]


@pytest.mark.parametrize(
    "steps", [LAW.steps, np.full(5, 5e-3), np.full(20, 2e-3), np.array([0.01])]
)
@pytest.mark.parametrize("bandwidth", [5.0, 100.0])
def test_without_active_limits_it_is_a_linear_quadratic_regulator(
    steps: Array, bandwidth: float
) -> None:
    """The gains of a finite horizon, whatever inertia and weights are."""
    kind = type("Mpc", (LAW,), {"steps": steps, "bandwidth": bandwidth})
    k_p, k_d = riccati_gain(kind)
    for seed in range(5):
        x = signals(seed)
        u = x.acceleration_desired + k_p * x.error + k_d * x.error_rate
        force = law(NO_LIMIT, 10.0 ** np.arange(AXES), kind).force(x)
        np.testing.assert_allclose(force, x.nominal.inertia @ u + x.nominal.bias, rtol=1e-6)


@pytest.mark.parametrize("seed", range(8))
def test_within_limits_it_is_the_optimum(seed: int) -> None:
    """Clarabel solves the same problem with errors and torques as variables, less condensed."""
    rng, x = np.random.default_rng(seed), signals(seed)
    weight = 10.0 ** rng.uniform(-2.0, 2.0, AXES)
    free = torque_of(x, law(NO_LIMIT, weight).force(x))
    limit = np.abs(free) * rng.uniform(0.3, 1.5, AXES) + 0.1
    mpc = law(limit, weight)
    force = mpc.force(x)
    assert np.all(np.abs(torque_of(x, force)) <= limit * (1.0 + 1e-5))
    assert np.any(np.abs(free) > limit)

    w, count = LAW.bandwidth, len(LAW.steps)
    error, rate = cvxpy.Variable((count + 1, AXES)), cvxpy.Variable((count + 1, AXES))
    slowing = cvxpy.Variable((count, AXES))  # and errors W^2 e, W edot, of the same size
    rules, cost = [error[0] == w**2 * x.error, rate[0] == w * x.error_rate], 0.0
    for k, (a, b, q, r) in enumerate(stages(LAW)):
        drift = error[k] + w * a[0, 1] * rate[k]
        rules.append(error[k + 1] == drift + w**2 * b[0, 0] * slowing[k])
        rules.append(rate[k + 1] == rate[k] + w * b[1, 0] * slowing[k])
        wanted = x.nominal.inertia @ (x.acceleration_desired - slowing[k]) + x.nominal.bias
        base = x.nominal.rotation.T @ np.linalg.inv(x.nominal.to_force) @ wanted[:3]
        rules += [cvxpy.abs(base) <= limit[:3], cvxpy.abs(wanted[3:]) <= limit[3:]]
        root = np.linalg.cholesky(q / np.outer([w**2, w], [w**2, w]))
        for part in (
            root[0, 0] * error[k + 1] + root[1, 0] * rate[k + 1],
            root[1, 1] * rate[k + 1],
            np.sqrt(r) * slowing[k],
        ):
            cost = cost + cvxpy.sum_squares(cvxpy.multiply(np.sqrt(weight), part))
    cvxpy.Problem(cvxpy.Minimize(cost), rules).solve(
        solver=cvxpy.CLARABEL, tol_gap_abs=1e-12, tol_gap_rel=1e-12, tol_feas=1e-12
    )
    best = x.acceleration_desired - np.asarray(slowing.value)[0]
    np.testing.assert_allclose(mpc.memory.u, best, rtol=0.0, atol=1e-4 * np.abs(best).max())


def test_a_copy_and_a_restored_law_answer_the_same() -> None:
    """The solver is not copied: it only remembers which limits were active."""
    original = law(5.0)
    for seed in range(3):
        original.force(signals(seed))
    x = signals(3)
    copies = [copy.deepcopy(original), pickle.loads(pickle.dumps(original))]
    restored = law(1.0)
    restored.restore(original.save())
    expected = original.force(x).copy()
    for other in (*copies, restored):
        # another way to the same active set: the processor's BLAS decides over the ninth digit
        np.testing.assert_allclose(other.force(x), expected, rtol=1e-8, atol=1e-8)


def test_with_a_weak_base_it_errs_less_than_computed_torque() -> None:
    """Same gains and same limit: what is left of the torque goes where it costs least."""
    scenario = Scenario(case="1", duration=4.0, parameters={"plant": {"base_torque_limit": 0.7}})
    k_p, k_d = riccati_gain(LAW)
    ctc = scenario.replace(controller="ctc", gains={"k_p": k_p, "k_d": k_d}).fly().check()
    gains = {"weight": 1.0, "torque_limit": [0.7] * 3 + [1e3] * 6}
    mpc = scenario.replace(controller=LAW, gains=gains).fly().check()
    commanded = np.abs(mpc.log.commanded_torque[:-1, :3])
    assert 0.7 * (1.0 - 1e-9) < commanded.max() < 0.7 * (1.0 + 1e-5)
    for name in ("attitude.rms", "joints_1_3.rms", "joints_4_6.rms"):
        assert mpc.metrics[name] < 0.5 * ctc.metrics[name]
