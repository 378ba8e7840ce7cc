"""Linear parts of laws, loops, eigenvalues: margins against algebra, SciPy and flights."""

from __future__ import annotations

import copy
import functools

import numpy as np
import pytest
import scipy.linalg
from closed_loop import H_BAR
from hypothesis import given, settings
from hypothesis import strategies as st

from space_robot.cli.options import remarks_on
from space_robot.flight.plan import Flight, Scenario, resolve
from space_robot.flight.simulate import simulate
from space_robot.tuning.closed_loop import RigidLoop, linear_loop, rigid_motion
from space_robot.tuning.gain_check import (
    GainCheck,
    check_gains,
    eigenvalues,
    noise_gain,
    pair_corner,
    spectrum,
)
from space_robot.tuning.inertia import SAMPLING, Posture, inertia_along, postures_along, postures_at
from space_robot.tuning.linear_law import LinearLaw, linear_law, linear_laws
from space_robot.tuning.warning import margin_remarks
from space_robot_control.controller.settings import ControllerNodeSettings
from space_robot_control.laws import ControlLaw, LawGains, Signals, find_law, per_axis
from space_robot_model.elementary.matrices import Array
from space_robot_msgs_py.errors import DivergedError

PERIOD = 5e-4
SLOW = {"k_p": 1e-4, "k_d": 2e-2}
"""Poles at 0.01 rad/s: u does not move the limits of the estimate."""


@functools.cache
def flight(case: str = "1", gains: str = "default") -> Flight:
    return Flight(resolve(Scenario(case=case, gains=gains)))


def slow_law(name: str, **gains: Array | float) -> ControlLaw:
    values = {**SLOW, **gains}
    return find_law(name)({key: value * np.ones(9) for key, value in values.items()}, PERIOD)


@pytest.mark.parametrize("weight", [1.0, 0.2])
@pytest.mark.parametrize("name", ["constant", "nominal", "indi", "dob"])
def test_margins_are_those_of_the_algebra(name: str, weight: float) -> None:
    """Of a robot with an unknown payload, by the whole loop with and without the formula (*)."""
    robot, mission = flight("4-2").plant.robot, flight().mission_settings
    inertia = inertia_along(robot, mission, 6.0)
    postures = postures_along(flight().robot, mission, 6.0)
    assumed: Array = np.array([posture.inertia for posture in postures])
    h_bar = np.array(H_BAR)
    share = weight if weight < 1.0 else 0.9
    law = {
        "constant": slow_law("tde_tsmc", h_bar=h_bar, k_1=0.1),
        "nominal": slow_law("tde_tsmc", h_bar=0.0, k_1=0.1),
        "indi": slow_law("indi"),
        "dob": slow_law("dob", inertia=h_bar, bandwidth=share / (1.0 - share) / PERIOD),
    }[name]
    if name in ("constant", "dob"):
        assumed = h_bar
    own = share if name == "dob" else weight
    expected = spectrum(inertia, assumed, own)
    loop = RigidLoop(inertia, postures, linear_laws(law, postures), 1.0 if name == "dob" else own)
    assert loop.is_stable()
    assert loop.margin() == pytest.approx(expected.margin, rel=0.02)
    assert loop.largest_scale() == pytest.approx(expected.largest_scale, rel=0.02)
    check = check_gains(law, inertia, postures, corner(own if name != "dob" else 1.0))
    assert check.spectrum is not None
    assert check.margin == pytest.approx(eigenvalues(inertia, assumed).min())
    assert check.spectrum.weight == pytest.approx(own)


def corner(weight: float) -> float:
    return 0.0 if weight == 1.0 else float(-np.log(1.0 - weight) / (2.0 * np.pi * PERIOD))


@pytest.mark.parametrize("is_late", [False, True])
def test_a_loop_of_noise_is_the_recursion_of_the_law(is_late: bool) -> None:
    """PD of one rigid axis, all by hand: noise of e and r enters the force and moves the robot."""
    posture = postures_along(flight().robot, flight().mission_settings, 30.0)[0]
    law = find_law("pd")({"k_p": np.full(9, 40.0), "k_d": np.full(9, 6.0)}, PERIOD)
    inertia = np.diag(np.arange(1.0, 10.0))
    (linear,) = linear_laws(law, [posture])
    loop = linear_loop(rigid_motion(inertia, posture, PERIOD), linear, 1.0, is_late=is_late)
    rng, state, last = np.random.default_rng(0), np.zeros(36 if is_late else 18), np.zeros(9)
    p, r = np.zeros(9), np.zeros(9)
    for _ in range(100):
        noise = rng.normal(size=27)
        force = 40.0 * (noise[:9] - p) - 6.0 * (r + noise[9:18])
        np.testing.assert_allclose(loop.force @ state + loop.force_by_noise @ noise, force)
        state = loop.step @ state + loop.by_noise @ noise
        acceleration = (last if is_late else force) / np.diag(inertia)
        p, r = p + PERIOD * r + 0.5 * PERIOD**2 * acceleration, r + PERIOD * acceleration
        np.testing.assert_allclose(state[:18], np.concatenate([p, r]), atol=1e-12)
        last = force


def checked(law: str, gains: str) -> GainCheck:
    own = flight(gains=gains)
    inertia = inertia_along(own.plant.robot, own.mission_settings)
    postures = postures_along(own.robot, own.mission_settings, SAMPLING)
    return check_gains(own.laws[law], inertia, postures, pair_corner(own.controller_settings))


def fly(law: str, gains: str, **plant: float) -> float:
    """The largest error of any axis in case 1, with parameters of the plant."""
    parameters = {"plant": {name: [value] for name, value in plant.items()}}
    plan = Scenario(controller=law, gains=gains, parameters=parameters)
    log = simulate(Flight(resolve(plan)))
    assert log.telemetry is not None
    return float(np.max(np.abs(log.telemetry[:, 3])))


@pytest.mark.parametrize("law", ["adrc", "dob"])
def test_observers_fly_up_to_their_margin_and_no_further(law: str) -> None:
    """The margin is that of the worst posture, at the end of the mission; later ones grow fast."""
    margin = checked(law, "tuned").margin
    assert margin is not None
    assert 0.04 < margin < 0.1
    assert fly(law, "tuned", echo_scale=1.0 + 0.7 * margin) < 1e-3
    with pytest.raises(DivergedError):
        fly(law, "tuned", echo_scale=1.0 + 2.5 * margin)


@pytest.mark.parametrize(
    ("law", "gains", "echo_scale", "least", "largest"),
    [
        ("tde_smc", "default", 1.005, 0.0, 1e-3),
        ("tde_stc", "default", 1.005, 0.0, 1e-3),
        ("tde_stc", "default", 0.99, 1e-4, 1e-2),  # one too small costs accuracy, no more
        ("indi", "nominal", 1.2, 0.0, 0.02),
        ("tde_stc", "nominal", 1.2, 0.0, 0.02),
        ("tde_tsmc", "nominal", 1.2, 0.0, 0.02),
        ("tde_smc", "nominal", 1.2, 0.0, 0.2),  # its g is for an excess of 2.5 %
    ],
)
def test_torques_reported_wrong_within_the_margin_are_flown(
    law: str, gains: str, echo_scale: float, least: float, largest: float
) -> None:
    assert least <= fly(law, gains, echo_scale=echo_scale) < largest


@pytest.mark.parametrize("law", ["tde_smc", "tde_stc"])
def test_one_too_large_by_more_than_the_margin_diverges(law: str) -> None:
    """Of Table IV: 0.31 to 0.79 %."""
    with pytest.raises(DivergedError):
        fly(law, "default", echo_scale=1.01)


def some_inertia(rng: np.random.Generator, m: int) -> np.ndarray:
    """A positive definite matrix."""
    root = rng.normal(size=(m, m))
    return root @ root.T + 0.1 * np.eye(m)


@given(st.integers(0, 2**32 - 1), st.integers(1, 10))
@settings(max_examples=30, deadline=None)
def test_eigenvalues_are_scipys(seed: int, m: int) -> None:
    rng = np.random.default_rng(seed)
    inertia, h_bar = some_inertia(rng, m), rng.uniform(0.01, 100.0, m)
    expected = scipy.linalg.eigh(np.diag(h_bar), inertia, eigvals_only=True)
    np.testing.assert_allclose(eigenvalues(inertia[np.newaxis], h_bar)[0], expected, rtol=1e-8)
    found = spectrum(inertia[np.newaxis], h_bar)
    assert found.contracts == (found.radius < 1.0)
    margin = expected[0] if found.contracts else 2.0 - expected[-1]
    assert found.margin == pytest.approx(margin, rel=1e-6, abs=1e-9)
    w = np.eye(m) - np.linalg.solve(inertia, np.diag(h_bar))
    assert found.radius == pytest.approx(np.max(np.abs(np.linalg.eigvals(w))), rel=1e-7)
    assert found.norm == pytest.approx(np.linalg.norm(w, 2))


def remarks(plan: Scenario, corner: float = 0.0) -> list[str]:
    flight = Flight(resolve(plan))
    laws = [flight.law, *(law for _, law in flight.swaps)]
    return margin_remarks(
        laws,
        flight.plant.robot,
        flight.mission_settings,
        corner,
        flight.controls_base,
        nominal=flight.robot,
    )


TOO_LARGE = Scenario(
    parameters={"controller": {"tde_stc.h_bar": [50.0] * 3 + [5.0] * 3 + [1.0] * 3}}
)


def test_table_iv_is_remarked_upon_once_a_law() -> None:
    (line,) = remarks(Scenario(swaps=["1:tde_stc"]))
    assert line.startswith("warning: tde_stc: h_bar leaves 0.31% of margin in torque scale")
    assert line.endswith("see space-robot gains check")
    both = remarks(Scenario(swaps=["1:tde_smc", "2:ctc"]))
    assert [text.split(":")[1] for text in both] == [" tde_stc", " tde_smc"]


def test_nobody_is_warned_of_the_default_gains_unless_the_flight_tries_their_margin() -> None:
    """Who has chosen nothing is not greeted with a warning; who has tried something is."""
    h_bar = {"controller": {"tde_stc.h_bar": H_BAR}}
    for plan, count in (
        (Scenario(), 0),
        (Scenario(case="3", sensors="fine"), 0),
        (Scenario(gains="printed"), 1),
        (Scenario(parameters=h_bar), 1),
        (Scenario(gains={"h_bar": H_BAR}), 1),
        (Scenario(faults=["torque_scale@2:base=0.99"]), 1),
        (Scenario(actuators="wheels"), 1),
    ):
        assert len(remarks_on(Flight(resolve(plan)))) == count, plan
    (line,) = remarks_on(Flight(resolve(TOO_LARGE)))
    assert "too large" in line
    assert "diverge" in line
    assert "margin" in remarks(TOO_LARGE, corner=100.0)[0]


def test_thrusters_are_told_which_gains_are_for_them() -> None:
    for actuators, is_said in (("thrusters", True), ("wheels_and_thrusters", False)):
        (line,) = remarks_on(Flight(resolve(Scenario(actuators=actuators))))
        assert ("thrusters' pulses" in line) is is_said
    assert remarks_on(Flight(resolve(Scenario(actuators="thrusters", gains="robust")))) == []


@pytest.mark.parametrize(
    ("own", "given", "corner"),
    [
        ("direct", {}, 0.0),
        ("direct", {"acceleration_filter_hz": 50.0}, 50.0),
        ("filtered", {}, 150.0),  # rates 100, joints 150 Hz: what passes the faster one
        ("filtered", {"acceleration_filter_hz": 50.0}, 50.0),
        ("filtered", {"navigation_filter.rate_filter_hz": 0.0}, 0.0),
    ],
)
def test_what_filters_the_pair_counts(own: str, given: dict[str, float], corner: float) -> None:
    settings = ControllerNodeSettings.resolve({"navigation": own, **given})
    assert pair_corner(settings) == corner


@pytest.mark.parametrize(
    ("inertia", "word"), [(2.0, "it will diverge"), (100.0, "margin in torque scale"), (400.0, "")]
)
def test_an_observer_of_too_little_inertia_is_remarked_upon(inertia: float, word: str) -> None:
    """Of ADRC by its loop: its observer's pole is at ``min(lambda) omega_o / 3``."""
    shape = [5.3, 2.8, 2.2, 0.067, 0.23, 0.19, 0.0053, 0.0056, 0.0012]
    own = {"inertia": [inertia * value for value in shape], "omega_c": [0.2], "omega_o": [400.0]}
    plan = Scenario(
        controller="adrc", parameters={"controller": {f"adrc.{k}": v for k, v in own.items()}}
    )
    found = remarks(plan)
    assert len(found) == bool(word)
    assert all(word in line and line.startswith("warning: adrc: ") for line in found)


JOINTS = np.radians([0.0, 120.0, 220.0, 0.0, -10.0, 0.0])
UPRIGHT = np.array([1.0, 0.0, 0.0, 0.0])
ONES = np.ones(9)
DIAGONAL = np.array(H_BAR)


@functools.cache
def posture(controls_base: bool = True) -> Posture:
    robot = Flight(resolve(Scenario())).robot
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
    by_rate = linear_law(LAWS["dob"], posture()).force_by_rate()
    np.testing.assert_allclose(-np.diag(by_rate), DIAGONAL * (own / PERIOD + 30.0), rtol=1e-9)
    assert not linear_law(LAWS["adrc"], posture()).force_by_rate().any()


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
