"""N_hat from a log's motion and torque is the N_hat the controller formed."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from space_robot_control.analysis import analyse, excerpt
from space_robot_control.analysis.described import estimator
from space_robot_control.analysis.estimate_error import (
    delayed_estimate,
    estimate_error,
    neglected_force,
)
from space_robot_control.flight.plan import Flight, FlightPlan
from space_robot_control.flight.simulate import simulate
from space_robot_msgs_py.flight_log import FlightLog


def flown(**options: Any) -> FlightLog:
    return simulate(Flight(FlightPlan.model_validate({"duration": 0.3, **options})))


def assert_same_estimate(log: FlightLog) -> None:
    assert log.telemetry is not None
    h_bar, smoothing = estimator(log)
    estimate = delayed_estimate(neglected_force(log, h_bar), smoothing, rest=log.first_tick == 0)
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
    h_bar, _ = estimator(log)
    expected = estimate_error(log, h_bar)
    log.quaternion[200:] *= -1.0
    log.quaternion[300:] *= -1.0
    turned = estimate_error(log, h_bar)
    np.testing.assert_allclose(np.abs(turned), np.abs(expected), atol=1e-8)


def test_the_error_is_what_changed_in_a_tick() -> None:
    log = flown(case="2")
    h_bar, _ = estimator(log)
    assert log.telemetry is not None
    neglected = neglected_force(log, h_bar)
    error = estimate_error(log, h_bar)
    np.testing.assert_allclose(error, neglected[1:] - log.telemetry[1:-1, 2], atol=1e-9)
    report = analyse(log)["estimate_error"]
    assert report["max"]["base"] == pytest.approx(np.max(np.abs(error[:, :3])))
    rms = np.sqrt(np.mean(error[:, 6:] ** 2, axis=0))
    assert report["rms"]["4_6"] == pytest.approx(np.mean(rms))


def test_an_excerpt_has_the_errors_of_its_ticks() -> None:
    log = flown(case="2")
    h_bar, _ = estimator(log)
    whole, part = estimate_error(log, h_bar), estimate_error(excerpt(log, 0.1, 0.2), h_bar)
    np.testing.assert_array_equal(part, whole[200 : 200 + len(part)])


def test_filled_ticks_are_passed_over() -> None:
    log = flown(case="2")
    h_bar, _ = estimator(log)
    expected = estimate_error(log, h_bar)
    for name in ("quaternion", "omega_base", "joint_positions", "joint_velocities"):
        getattr(log, name)[300:303] = getattr(log, name)[299]
    log.filled = 3
    error = estimate_error(log, h_bar)
    assert len(error) >= len(expected) - 6
    assert np.max(np.abs(error)) <= np.max(np.abs(expected))


def test_the_gains_of_the_bag_come_before_those_of_the_name() -> None:
    log = flown()
    log.flight["gains_used"] = {"h_bar": [2.0] * 9}
    np.testing.assert_array_equal(estimator(log)[0], [2.0] * 9)


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"controller": "ctc"}, "ctc has no time-delay estimate"),
        ({"controller": None}, "does not say which law"),
        ({"swaps": ["0.1:ctc"]}, "swapped in flight"),
        ({"controller": "mine"}, "unknown controller 'mine'"),
    ],
)
def test_without_an_estimate_the_report_says_why(change: dict[str, Any], reason: str) -> None:
    log = flown(duration=0.01)
    log.flight |= change
    for key in ("gains_used",):
        log.flight.pop(key, None)
    report = analyse(log)
    assert report["estimate_error"] is None
    assert reason in report["unavailable"]["estimate_error"]
