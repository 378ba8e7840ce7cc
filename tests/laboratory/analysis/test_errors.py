"""Settling and waypoints against plain loops; the error of N_hat, which is the law's from motion
and torque; errors are of the truth, the navigation error of what the law assumed."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from oracles import rotation_of
from strategies import random_log

from space_robot import Scenario
from space_robot.analysis import analyze, excerpt, tracking_error
from space_robot.analysis.actuation import settling
from space_robot.analysis.analysed_log import AnalysedLog
from space_robot.analysis.errors import junction_ticks, neglected_force, waypoint_ticks
from space_robot.analysis.estimate_error import (
    PairFilter,
    estimate_errors,
    law_smoothing,
    recorded_h_bar,
)
from space_robot.analysis.report_tables import comparison_table, rms_table
from space_robot.flight.flown_log import empty_log
from space_robot.flight.plan import Flight, resolve
from space_robot_model.elementary.matrices import Array
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.errors import InputError
from space_robot_msgs_py.samples import Timebase

PERIOD = 0.0005
SPEEDS = st.sampled_from([0.0, 0.0, 1e-12, 5e-10, 1e-6, 2e-5, 9e-5, 0.5, 1.0, 3.0])


def log_with(speed: np.ndarray, first_tick: int = 0) -> FlightLog:
    """One joint with these desired speeds (N,)."""
    log = FlightLog.allocate(len(speed), ("j",), Timebase(500_000))
    log.first_tick = first_tick
    log.reference_joints[:], log.reference_joints[:, 1, 0] = 0.0, speed
    return log


def planned_log(duration: float) -> FlightLog:
    """The paper's mission, whose waypoints are at 0, 15 and 30 s."""
    return empty_log(Flight(resolve(Scenario(duration=duration))))


def settled(log: FlightLog) -> dict[str, float]:
    return settling.evaluate(AnalysedLog(log), range(log.ticks))


@given(
    arrays(np.float64, (300, 4), elements=st.floats(-2.0, 2.0)),
    st.integers(0, 100),
    st.integers(0, 300),
    st.sets(st.integers(0, 299), max_size=40),
    st.integers(0, 50),
)
def test_after_it_the_error_stays_in_the_band_and_before_it_does_not(
    error: np.ndarray, start: int, calm_from: int, loud: set[int], first_tick: int
) -> None:
    """Of the base's and the joint's column alike; the largest in size of the axes counts."""
    error[calm_from:] *= 0.4
    error[sorted(loud), 2] = -1.5
    error *= 1e-5  # the band, as documented
    speed = np.ones(300)
    speed[start] = 0.0
    log = log_with(speed, first_tick)
    log.joint_positions[:] = -error[:, 3:]
    log.reference_base[:, :4] = [1.0, 0.0, 0.0, 0.0]
    log.quaternion[:] = np.hstack([np.ones((300, 1)), -error[:, :3]])
    found, error = settled(log), tracking_error(log)
    assert found["settling.after"] == pytest.approx((first_tick + start) * PERIOD)
    for name, axes in (("attitude", slice(0, 3)), ("joints_1_1", slice(3, 4))):
        size = np.max(np.abs(error[:, axes]), axis=1)
        rows = [k for k in range(start, 300) if np.all(size[k:] <= 1e-5)]
        expected = (rows[0] - start) * PERIOD if rows else np.inf
        assert found[f"{name}.settling"] == pytest.approx(expected)


@pytest.mark.parametrize(
    ("log", "expected"),
    [
        (planned_log(30.0), 30_000),
        (planned_log(31.0), 60_000),
        (planned_log(14.0), 0),
        *((log_with(np.array([0.0, 0.0] + [1.0] * n)), k) for n, k in ((199, 1), (198, 0))),
        (log_with(np.array([0.0, 0.0] + [1.0] * 197)), None),
        (log_with(np.ones(300)), None),
    ],
)
def test_the_last_waypoint_has_flight_after_it(log: FlightLog, expected: int | None) -> None:
    if expected is None:
        with pytest.raises(InputError, match="does not come to rest"):
            settled(log)
    else:
        assert settled(log)["settling.after"] == pytest.approx(expected * PERIOD)


@given(st.lists(SPEEDS, min_size=1, max_size=60))
def test_waypoints_are_those_of_a_plain_loop(speed: list[float]) -> None:
    """Slow stretches beside the highest speed so far, and in each the rest, or the slowest row."""
    log = log_with(np.negative(speed))
    expected: set[int] = set()
    highest, stretch = 0.0, []
    for k, v in enumerate([*speed, np.inf]):
        highest = max(highest, v)
        if v <= 1e-4 * highest and k < len(speed):
            stretch.append((v, k, v <= 1e-9 * highest))
        elif stretch:
            resting = [row for _, row, rests in stretch if rests]
            expected |= {resting[0], resting[-1]} if resting else {min(stretch)[1]}
            stretch = []
    assert waypoint_ticks(log).tolist() == (sorted(expected) if max(speed) else [0])


RESTS = [*[0.0] * 5, *[0.2] * 10, *[0.0] * 7, *[0.1] * 10]
UNKNOWN = [*[0.0] * 3, *[1.0] * 12, np.nan, *[1.0] * 4]


@pytest.mark.parametrize(
    ("log", "ticks", "junctions"),
    [
        (planned_log(30.0), [0, 30_000, 59_999], [30_000]),
        (planned_log(1.0), [0], []),  # cut short
        (log_with(1e-3 * np.sin(np.pi * np.linspace(0, 2, 201)) ** 4), [0, 100, 200], [100]),
        (log_with(np.array(RESTS)), [0, 4, 15, 21], [4, 15, 21]),
        (log_with(np.zeros(20)), [0], []),
        (log_with(np.array(UNKNOWN)), [0, 2], [2]),
        (excerpt(planned_log(30.0), 5.0, 6.0), [], []),
    ],
)
def test_waypoints_and_junctions(log: FlightLog, ticks: list[int], junctions: list[int]) -> None:
    assert waypoint_ticks(log) == pytest.approx(ticks, abs=1)
    assert junction_ticks(log) == pytest.approx(junctions, abs=1)


FAULTS = [
    "noise_attitude@0:1e-5",
    "noise_joint_position@0:2e-5",
    "noise_gyro@0:1e-6",
    "torque_scale@0:base=0.999",
]
STATE = ("quaternion", "omega_base", "joint_positions", "joint_velocities")


def flown(**options: Any) -> FlightLog:
    return Scenario(**{"duration": 0.3, "case": "2", **options}).fly().log


@pytest.fixture(scope="module")
def noisy() -> FlightLog:
    return flown(case="1", faults=FAULTS, duration=1.5)


def estimate_error(log: FlightLog, h_bar: Array) -> Array:
    errors = estimate_errors(log, lambda log: h_bar, 0.0, rest=log.first_tick == 0)(0, log.ticks)
    assert np.isnan(errors[[0, -1]]).all()
    return errors[~np.isnan(errors).any(axis=1)]


@pytest.mark.parametrize(
    "options",
    [
        {"controller": "tde_smc", "case": "4-2"},
        {"controller": "tde_tsmc", "case": "4-2", "command_latency_ticks": 3},
        {"parameters": {"controller": {"acceleration_filter_hz": 100.0}}},
    ],
)
def test_the_estimate_is_the_controllers(options: dict[str, Any]) -> None:
    log = flown(**options)
    assert log.telemetry is not None
    neglected = neglected_force(log, recorded_h_bar(log))
    estimate = PairFilter(law_smoothing(log)).of(0, neglected)
    expected = log.telemetry[1:, 2]
    np.testing.assert_allclose(estimate, expected, rtol=1e-9, atol=1e-9)
    assert np.ptp(expected, axis=0).min() > 1e-3


def test_the_error_is_what_changed_in_a_tick() -> None:
    """Also in an excerpt, on the other side of the quaternion, and beside ticks filled in."""
    log = flown()
    h_bar = recorded_h_bar(log)
    assert log.telemetry is not None
    error = estimate_error(log, h_bar)
    metrics = analyze(log)["metrics"]
    largest = np.linalg.norm(error[:, :3], axis=1).max()
    assert metrics["estimate_error_base.max"] == pytest.approx(largest)
    rms = np.sqrt(np.mean(error[:, 6:] ** 2, axis=0))
    assert metrics["estimate_error_4_6.rms"] == pytest.approx(np.mean(rms))
    part = estimate_error(excerpt(log, 0.1, 0.2), h_bar)
    np.testing.assert_array_equal(part, error[200 : 200 + len(part)])
    log.quaternion[200:300] *= -1.0
    turned = estimate_error(log, h_bar)
    np.testing.assert_allclose(np.abs(turned), np.abs(error), atol=1e-8)
    for name in STATE:
        getattr(log, name)[300:303] = getattr(log, name)[299]
    log.filled = 3
    filled = estimate_error(log, h_bar)
    assert len(filled) >= len(error) - 6
    assert np.max(np.abs(filled)) <= np.max(np.abs(error))


@pytest.mark.parametrize("n", [1, 7])
def test_it_is_that_of_a_plain_loop(n: int) -> None:
    """(33), (35), (36) with J0 of (1) and (22), tick by tick in plain NumPy."""
    log = random_log(n, 20, n)
    h_bar = np.array(log.laws[0].gains["h_bar"])
    period, before, neglected = log.timebase.period, None, []
    log.reference_base[:, 4:7] = np.random.default_rng(n).normal(size=(20, 3))
    last = None
    for k in range(20):
        turned = rotation_of(log.reference_base[k, :4]).inv() * rotation_of(log.quaternion[k])
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


@pytest.mark.filterwarnings("error")
def test_at_180_degrees_there_is_none() -> None:
    """J0 is singular there."""
    log = random_log(6, 20, 1)
    w, x, y, z = log.reference_base[7, :4]
    log.quaternion[7] = [-x, w, z, -y]  # turned by 180 degrees about the desired x axis
    report = analyze(log)
    assert "estimate_error_base.rms" not in report["metrics"]
    assert "180 degrees" in report["unavailable"]["estimate_error"]


def test_without_an_estimate_the_report_says_why() -> None:
    log = flown(duration=0.01)
    log.laws = ()  # as of a bag of another recorder
    assert "were not recorded" in analyze(log)["unavailable"]["estimate_error"]
    other = analyze(flown(controller="ctc", duration=0.01))["unavailable"]["estimate_error"]
    assert other == "ctc has no time-delay estimate with a constant h_bar"


def rms_of(values: Array) -> float:
    return float(np.mean(np.sqrt(np.mean(values**2, axis=0))))


def test_the_navigation_error_is_measured_less_true_at_the_telemetry(noisy: FlightLog) -> None:
    found, told = analyze(noisy)["metrics"], noisy.measured
    assert told is not None
    joints = (told.joint_positions - noisy.joint_positions)[::20]
    for name, error in (
        ("attitude", (told.quaternion - noisy.quaternion)[::20, 1:]),
        ("joints_1_3", joints[:, :3]),
        ("joints_4_6", joints[:, 3:]),
    ):
        sizes = np.linalg.norm(error, axis=1) if name == "attitude" else np.abs(error)
        assert found[f"navigation_{name}.rms"] == pytest.approx(rms_of(error), rel=1e-9)
        assert found[f"navigation_{name}.max"] == pytest.approx(float(sizes.max()), rel=1e-9)
    assert found["navigation_joints_1_3.rms"] == pytest.approx(2e-5, rel=0.2)
    for kind in ("rms", "max"):  # angles of small errors
        angle = np.degrees(2.0 * found[f"navigation_attitude.{kind}"])
        assert found[f"navigation_attitude_angle.{kind}"] == pytest.approx(angle, rel=1e-6)


def test_errors_and_torques_are_the_true_ones(noisy: FlightLog) -> None:
    """Those measured show the noise; limits and commands are of the reported torque."""
    report, told = analyze(noisy), analyze(noisy.as_measured())
    error = noisy.reference_joints[:, 0] - noisy.joint_positions
    np.testing.assert_array_equal(tracking_error(noisy)[:, 3:], error)
    true, reported = (r["metrics"] for r in (report, told))
    assert true["joints_1_3.rms"] == pytest.approx(rms_of(error[:, :3]), rel=1e-12)
    assert reported["joints_1_3.rms"] > 20.0 * true["joints_1_3.rms"]
    assert true["base_torque.rms"] == pytest.approx(0.999 * reported["base_torque.rms"], rel=1e-12)
    assert (report["truth_recorded"], told["truth_recorded"]) == (True, False)
    h_bar = np.array(noisy.laws[0].gains["h_bar"])
    force = neglected_force(replace(noisy, measured=None), h_bar)
    assert noisy.telemetry is not None
    estimated = force[1:] - noisy.telemetry[1:-1, 2]
    np.testing.assert_allclose(estimate_error(noisy, h_bar), estimated, atol=1e-7)
    assert true["commands.differing"] == 0
    assert true["commands.compared"] > 2900
    table = rms_table(analyze(noisy, in_brief=True))
    assert "errors and torques are the true ones" in table.title
    (row,) = (row for row in table.groups[0].rows if row[0] == "joints_1_3")
    assert row[3] == f"{true['navigation_joints_1_3.rms']:.3e}"
    both = comparison_table({"one": report, "other": analyze(random_log(6, 300, 0))})
    assert ["errors are of", "the truth", "the truth"] in both.groups[0].rows


def test_without_telemetry_or_of_a_filter_there_is_none(noisy: FlightLog) -> None:
    report = analyze(noisy.rows(1, 15))
    assert "navigation_attitude.rms" not in report["metrics"]
    assert report["unavailable"]["navigation"] == "no telemetry was recorded"
    flight = {**noisy.flight, "navigation": "filtered"}
    report = analyze(replace(noisy, scenario=None, flight=flight))
    assert report["navigation"] == "filtered"
    assert "not recorded" in report["unavailable"]["estimate_error"]
