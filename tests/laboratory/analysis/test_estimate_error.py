"""N_hat from a log's motion and torque is the N_hat the controller formed."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from random_logs import random_log
from scipy.spatial.transform import Rotation

from space_robot.analysis import analyze, excerpt
from space_robot.analysis.described_estimator import estimator
from space_robot.analysis.estimate_error import DelayedEstimate, EstimateErrors
from space_robot.analysis.generalised_motion import neglected_force
from space_robot.flight.plan import Flight, FlightPlan, resolve
from space_robot.flight.simulate import simulate
from space_robot_msgs_py.bag.flight_log import FlightLog


def flown(**options: Any) -> FlightLog:
    return simulate(Flight(resolve(FlightPlan.model_validate({"duration": 0.3, **options}))))


def estimate_error(
    log: FlightLog, h_bar: np.ndarray, smoothing: float = 0.0, cuts: tuple[int, ...] = ()
) -> np.ndarray:
    """Of a whole log, or of parts that begin at some rows."""
    errors = EstimateErrors(lambda log: h_bar, smoothing, rest=log.first_tick == 0)
    parts = zip((0, *cuts), (*cuts, log.ticks), strict=True)
    return np.concatenate([errors.of(log.rows(start, stop)) for start, stop in parts])


def assert_same_estimate(log: FlightLog) -> None:
    assert log.telemetry is not None
    of_law, smoothing = estimator(log)
    h_bar = of_law(log)
    estimate = DelayedEstimate(smoothing, rest=log.first_tick == 0).of(neglected_force(log, h_bar))
    expected = log.telemetry[1:, 2]
    # the difference of two rates over half a millisecond amplifies their last bits
    np.testing.assert_allclose(estimate, expected, rtol=1e-9, atol=1e-9)
    assert np.ptp(expected, axis=0).min() > 1e-3


@pytest.mark.parametrize("law", ["tde_smc", "tde_tsmc", "tde_stc"])
def test_the_estimate_is_the_controllers(law: str) -> None:
    assert_same_estimate(flown(controller=law, case="4-2"))


def test_with_late_commands_it_is_too() -> None:
    assert_same_estimate(flown(case="2", command_latency_ticks=3))


def test_with_a_low_pass_it_is_too() -> None:
    log = flown(parameters={"controller": {"acceleration_filter_hz": 100.0}})
    log.flight["parameters"] = {"controller": {"acceleration_filter_hz": 100.0}}
    assert_same_estimate(log)


def test_a_turned_quaternion_changes_nothing() -> None:
    log = flown(case="2")
    h_bar = estimator(log)[0](log)
    expected = estimate_error(log, h_bar)
    log.quaternion[200:] *= -1.0
    log.quaternion[300:] *= -1.0
    turned = estimate_error(log, h_bar)
    np.testing.assert_allclose(np.abs(turned), np.abs(expected), atol=1e-8)


def test_the_error_is_what_changed_in_a_tick() -> None:
    log = flown(case="2")
    h_bar = estimator(log)[0](log)
    assert log.telemetry is not None
    neglected = neglected_force(log, h_bar)
    error = estimate_error(log, h_bar)
    np.testing.assert_allclose(error, neglected[1:] - log.telemetry[1:-1, 2], atol=1e-9)
    report = analyze(log)["estimate_error"]
    assert report["max"]["base"] == pytest.approx(np.max(np.abs(error[:, :3])))
    rms = np.sqrt(np.mean(error[:, 6:] ** 2, axis=0))
    assert report["rms"]["4_6"] == pytest.approx(np.mean(rms))


def test_an_excerpt_has_the_errors_of_its_ticks() -> None:
    log = flown(case="2")
    h_bar = estimator(log)[0](log)
    whole, part = estimate_error(log, h_bar), estimate_error(excerpt(log, 0.1, 0.2), h_bar)
    np.testing.assert_array_equal(part, whole[200 : 200 + len(part)])


CUTS = st.sets(st.integers(1, 49), max_size=6).map(lambda cuts: tuple(sorted(cuts)))


@given(st.sampled_from([1, 3, 6, 7]), st.integers(0, 99), CUTS, st.booleans(), st.booleans())
def test_parts_make_the_whole(
    n: int, seed: int, cuts: tuple[int, ...], filled: bool, smoothed: bool
) -> None:
    """To the last bit, but for the sign of the base's part: Q and -Q are the same attitude."""
    log, smoothing = random_log(n, 50, seed), 0.3 if smoothed else 0.0
    h_bar = np.array(log.flight["gains_used"]["h_bar"])
    if filled:
        log.filled = 5
        for k in np.random.default_rng(seed).integers(1, 50, 5):
            for name in ("quaternion", "omega_base", "joint_positions", "joint_velocities"):
                getattr(log, name)[k] = getattr(log, name)[k - 1]
    whole = estimate_error(log, h_bar, smoothing)
    np.testing.assert_array_equal(estimate_error(log, h_bar, smoothing, cuts), whole)


@pytest.mark.parametrize("n", [1, 3, 6, 7])
def test_it_is_that_of_a_plain_loop(n: int) -> None:
    """(33), (35), (36) with J0 of (1) and (22), tick by tick in plain NumPy."""
    log = random_log(n, 20, n)
    h_bar = np.array(log.flight["gains_used"]["h_bar"])
    period, before, neglected = log.timebase.period, None, []
    log.reference_base[:, 4:7] = np.random.default_rng(n).normal(size=(20, 3))
    last = None
    for k in range(20):
        desired, true = (
            Rotation.from_quat(q, scalar_first=True)
            for q in (log.reference_base[k, :4], log.quaternion[k])
        )
        turned = desired.inv() * true
        eps, eta = np.split(turned.as_quat(canonical=last is None), [3])
        if last is not None and np.dot([*eps, *eta], last) < 0.0:
            eps, eta = -eps, -eta
        last = np.array([*eps, *eta])
        x, y, z = eps
        skew = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
        jacobian = 0.5 * (eta * np.eye(3) + skew)
        omega = log.omega_base[k] - turned.inv().apply(log.reference_base[k, 4:7])
        rate = np.concatenate([jacobian @ omega, log.joint_velocities[k]])
        if before is not None:
            old_jacobian, old_rate = before
            force = log.applied_torque[k].copy()
            force[:3] = np.linalg.inv(old_jacobian).T @ force[:3]
            neglected.append(force - h_bar * (rate - old_rate) / period)
        before = jacobian, rate
    expected = np.diff(neglected, axis=0)
    np.testing.assert_allclose(estimate_error(log, h_bar), expected, rtol=1e-9, atol=1e-7)
    report = analyze(log)["estimate_error"]
    groups = {"base": [0, 1, 2], "1_3" if n > 1 else "1_1": list(range(3, 3 + min(n, 3)))}
    if n > 3:
        groups[f"4_{n}"] = list(range(6, n + 3))
    for name, axes in groups.items():
        rms = [float(np.sqrt(np.mean(expected[:, i] ** 2))) for i in axes]
        assert report["rms"][name] == pytest.approx(sum(rms) / len(rms), rel=1e-9)
        assert report["max"][name] == pytest.approx(np.abs(expected[:, axes]).max(), rel=1e-9)


@pytest.mark.filterwarnings("error")
def test_at_180_degrees_there_is_none() -> None:
    """J0 is singular there; it was NaN in JSON, and a warning on the terminal."""
    log = random_log(6, 20, 1)
    w, x, y, z = log.reference_base[7, :4]
    log.quaternion[7] = [-x, w, z, -y]  # turned by 180 degrees about the desired x axis
    report = analyze(log)
    assert report["estimate_error"] is None
    assert "180 degrees" in report["unavailable"]["estimate_error"]


def test_filled_ticks_are_passed_over() -> None:
    log = flown(case="2")
    h_bar = estimator(log)[0](log)
    expected = estimate_error(log, h_bar)
    for name in ("quaternion", "omega_base", "joint_positions", "joint_velocities"):
        getattr(log, name)[300:303] = getattr(log, name)[299]
    log.filled = 3
    error = estimate_error(log, h_bar)
    assert len(error) >= len(expected) - 6
    assert np.max(np.abs(error)) <= np.max(np.abs(expected))


def test_the_gains_of_the_bag_come_before_those_of_the_name() -> None:
    log = flown()
    log.laws = ()  # as of a bag from before they were recorded
    log.flight["gains_used"] = {"h_bar": [2.0] * 9}
    np.testing.assert_array_equal(estimator(log)[0](log), [2.0] * 9)


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"controller": "ctc"}, "ctc has no time-delay estimate with a constant h_bar"),
        ({"controller": None}, "does not say which law"),
        ({"swaps": ["0.1:ctc"]}, "swapped in flight"),
        ({"controller": "mine"}, "unknown controller 'mine'"),
    ],
)
def test_without_an_estimate_the_report_says_why(change: dict[str, Any], reason: str) -> None:
    log = flown(duration=0.01)
    log.laws = ()
    log.flight |= change
    for key in ("gains_used",):
        log.flight.pop(key, None)
    report = analyze(log)
    assert report["estimate_error"] is None
    assert reason in report["unavailable"]["estimate_error"]
