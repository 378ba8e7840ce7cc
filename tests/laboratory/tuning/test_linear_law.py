"""Linear parts of laws against their equations, written out, and against the laws themselves."""

from __future__ import annotations

import copy
import functools

import numpy as np
import pytest
from closed_loop import H_BAR
from numpy.typing import NDArray

from space_robot.flight.plan import Flight, FlightPlan, resolve
from space_robot.tuning.gain_check import noise_gain
from space_robot.tuning.linear_law import LinearLaw, force_by_rate, linear_law
from space_robot.tuning.postures import Posture, postures_at
from space_robot_control.laws import ControlLaw, LawGains, Signals, find_law, per_axis

Array = NDArray[np.float64]
PERIOD = 5e-4
JOINTS = np.radians([0.0, 120.0, 220.0, 0.0, -10.0, 0.0])
UPRIGHT = np.array([1.0, 0.0, 0.0, 0.0])
ONES = np.ones(9)
DIAGONAL = np.array(H_BAR)


@functools.cache
def posture(controls_base: bool = True) -> Posture:
    robot = Flight(resolve(FlightPlan())).robot
    (only,) = postures_at(robot, [JOINTS], controls_base)
    return only


def law(name: str, **gains: Array | float) -> ControlLaw:
    return find_law(name)({k.rstrip("_"): v * ONES for k, v in gains.items()}, PERIOD)


LAWS = {
    "ctc": law("ctc", k_p=300.0, k_d=30.0),
    "ctc_smc": law("ctc_smc", lambda_=7.0, g=2.0, delta=1e-4),
    "tde_smc": law("tde_smc", h_bar=DIAGONAL, lambda_=7.0, g=2.0),
    "tde_tsmc": law("tde_tsmc", h_bar=DIAGONAL, k_p=300.0, k_d=30.0, k_1=2.0),
    "tde_stc": law("tde_stc", h_bar=DIAGONAL, lambda_=7.0, k_1=0.3, k_2=0.1),
    "nominal": law("tde_tsmc", h_bar=0.0, k_p=300.0, k_d=30.0, k_1=2.0),
    "indi": law("indi", k_p=300.0, k_d=30.0),
    "dob": law("dob", inertia=DIAGONAL, bandwidth=80.0, k_p=300.0, k_d=30.0),
    "adrc": law("adrc", inertia=DIAGONAL, omega_c=9.0, omega_o=70.0),
    "pd": law("pd", k_p=300.0 * DIAGONAL, k_d=30.0 * DIAGONAL),
    "pd_feedforward": law("pd_feedforward", k_p=300.0 * DIAGONAL, k_d=30.0 * DIAGONAL),
}


@pytest.mark.parametrize("name", LAWS)
def test_it_is_what_the_law_does_near_rest(name: str) -> None:
    """Of twenty ticks with random signals, for the laws without their switching terms."""
    own = copy.deepcopy(LAWS[name])
    for gain, values in own.gain_values.items():
        if gain in ("k_1", "k_2") or (gain == "g" and "delta" not in own.gain_values):
            values[:] = 0.0
    linear, rng = linear_law(own, posture()), np.random.default_rng(3)
    block = Signals.block(6)
    signals = Signals.view(block)
    block[0]["nominal"]["inertia"][:] = posture().inertia
    signals.quaternion[:] = signals.attitude_error[:] = UPRIGHT
    signals.joint_positions[:] = JOINTS
    own.reset()
    own.force(signals)
    state = np.zeros(len(linear.step))
    for _ in range(20):
        inputs = {key: 1e-7 * rng.normal(size=9) for key in linear.force_by}
        for key, values in inputs.items():
            getattr(signals, key)[:] = values
        force = own.force(signals).copy()
        if name == "nominal":
            force += posture().inertia @ own.memory.u
        expected = linear.force_by_state @ state
        expected += sum(linear.force_by[key] @ values for key, values in inputs.items())
        scale = np.abs(expected).max()
        np.testing.assert_allclose(force, expected, atol=1e-7 * scale)
        state = linear.step @ state
        state += sum(linear.state_by[key] @ values for key, values in inputs.items())


@pytest.mark.parametrize("weight", [1.0, 0.05])
def test_noise_gain_is_that_of_the_gains(weight: float) -> None:
    """``H (w / period + lambda)``; a torque is half its force, and rhodot half of omega."""
    share = np.array([0.25] * 3 + [1.0] * 6)
    expected = share * DIAGONAL * (weight / PERIOD + 7.0)
    np.testing.assert_allclose(noise_gain(LAWS["tde_stc"], [posture()], weight), expected)
    # `dob` has a weight of its own; `adrc` sees positions alone
    own = 80.0 * PERIOD / (1.0 + 80.0 * PERIOD)
    by_rate = force_by_rate(LAWS["dob"], posture())
    np.testing.assert_allclose(-np.diag(by_rate), DIAGONAL * (own / PERIOD + 30.0), rtol=1e-9)
    assert not force_by_rate(LAWS["adrc"], posture()).any()


class Gains(LawGains):
    k: Array = per_axis("K")


class Steps(ControlLaw):
    """A law with a jump at rest under a name that nobody knows, and a state that is no number."""

    name = "steps"
    gains_type = Gains

    def force(self, signals: Signals) -> Array:
        self.memory.u[:] = np.sign(signals.error_rate)
        rate = 2.0 * signals.omega_base[0] + signals.joint_velocities[0]
        force: Array = self.gains.k * signals.error + 5.0 * self.memory.u + rate
        return force


def test_a_jump_at_rest_is_not_in_it_and_rates_move_with_rhodot() -> None:
    linear: LinearLaw = linear_law(Steps({"k": 3.0 * ONES}, PERIOD), posture())
    np.testing.assert_allclose(linear.force_by["error"], 3.0 * np.eye(9), rtol=1e-5)
    assert np.abs(linear.force_by["error_rate"]).max() < 1e-3
    row = np.array([4.0, 0.0, 0.0, 1.0, *[0.0] * 5])  # omega is twice rhodot
    np.testing.assert_allclose(linear.force_by["rho_rate"], np.tile(row, (9, 1)), rtol=1e-4)


@pytest.mark.parametrize("name", ["tde_tsmc", "nominal", "indi", "dob", "adrc"])
def test_the_assumed_inertia_is_scaled_as_a_whole(name: str) -> None:
    once, twice = (linear_law(LAWS[name], posture(), scale) for scale in (1.0, 2.0))
    for key in ("error", "error_rate", "rho_rate"):
        expected = 2.0 * once.force_by[key]
        np.testing.assert_allclose(twice.force_by[key], expected, rtol=1e-9, atol=1e-9)
    if once.estimate is not None:
        assert twice.estimate is not None
        np.testing.assert_array_equal(twice.estimate, 2.0 * once.estimate)
