"""Errors are of the truth; the navigation error is of what the law assumed."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from random_logs import random_log

from space_robot.analysis import analyze, tracking_error
from space_robot.analysis.estimate_error import EstimateErrors
from space_robot.analysis.report_tables import comparison_table, rms_table
from space_robot.flight.plan import Flight, FlightPlan, resolve
from space_robot.flight.simulate import simulate
from space_robot_msgs_py.bag.flight_log import FlightLog

Array = NDArray[np.float64]

FLOWN = simulate(
    Flight(
        resolve(
            FlightPlan(
                faults=[
                    "noise_attitude@0:1e-5",
                    "noise_joint_position@0:2e-5",
                    "noise_gyro@0:1e-6",
                    "torque_scale@0:base=0.999",
                ],
                duration=1.5,
            )
        )
    )
)
EVERY = 20
"""Ticks from one telemetry to the next."""


def rms(values: Array) -> float:
    return float(np.mean(np.sqrt(np.mean(values**2, axis=0))))


def test_in_direct_navigation_it_is_measured_less_true() -> None:
    """At the ticks of the telemetry, on each group of axes."""
    found, told = analyze(FLOWN)["navigation_error"], FLOWN.measured
    assert told is not None
    attitude = (told.quaternion - FLOWN.quaternion)[::EVERY, 1:]
    joints = (told.joint_positions - FLOWN.joint_positions)[::EVERY]
    assert found["ticks"] == len(joints) == FLOWN.ticks // EVERY
    for name, error in (
        ("attitude", attitude),
        ("joints_1_3", joints[:, :3]),
        ("joints_4_6", joints[:, 3:]),
    ):
        assert found["rms"][name] == pytest.approx(rms(error), rel=1e-9)
        assert found["max"][name] == pytest.approx(float(np.abs(error).max()), rel=1e-9)
    assert found["rms"]["joints_1_3"] == pytest.approx(2e-5, rel=0.2)


def test_errors_and_torques_are_the_true_ones() -> None:
    """Those measured show the noise, a hundred times the error."""
    report, told = analyze(FLOWN), analyze(FLOWN.as_measured())
    error = FLOWN.reference_joints[:, 0] - FLOWN.joint_positions
    assert report["rms"]["mean_axis"]["joints_1_3"] == pytest.approx(rms(error[:, :3]), rel=1e-12)
    assert told["rms"]["mean_axis"]["joints_1_3"] > 20.0 * rms(error[:, :3])
    true, reported = (r["rms"]["mean_axis"]["base_torque"] for r in (report, told))
    assert true == pytest.approx(0.999 * reported, rel=1e-12)
    assert (report["truth_recorded"], told["truth_recorded"]) == (True, False)
    np.testing.assert_array_equal(tracking_error(FLOWN)[:, 3:], error)


def test_limits_and_commands_are_of_the_reported_torque() -> None:
    """The drives' error is no command that came too late."""
    report = analyze(FLOWN)
    assert report["missed_deadlines"]["differing_ticks"] == 0
    assert report["missed_deadlines"]["compared_ticks"] > 2900


def test_the_estimate_is_the_laws_own_and_its_error_of_the_true_force() -> None:
    """N by the formulas of true motion and torque given, N_hat as in the telemetry."""
    h_bar = np.array(FLOWN.flight["gains_used"]["h_bar"])
    assert FLOWN.telemetry is not None
    errors = EstimateErrors(lambda log: h_bar).of(FLOWN)
    eta, eps = FLOWN.quaternion[:, :1], FLOWN.quaternion[:, 1:]
    omega = FLOWN.omega_base
    rate = np.hstack([0.5 * (eta * omega + np.cross(eps, omega)), FLOWN.joint_velocities])
    torque = FLOWN.applied_torque[2:]
    jacobian_inverse = np.array(
        [
            2.0
            * (
                w * np.eye(3)
                + np.array([[0, z, -y], [-z, 0, x], [y, -x, 0]])
                + np.outer([x, y, z], [x, y, z]) / w
            )
            for w, x, y, z in FLOWN.quaternion[1:-1]
        ]
    )
    force = torque.copy()
    force[:, :3] = np.einsum("kji,kj->ki", jacobian_inverse, torque[:, :3])
    true = force - h_bar * np.diff(rate, axis=0)[1:] / 0.0005
    np.testing.assert_allclose(errors, true - FLOWN.telemetry[1:-1, 2], atol=1e-7)


def test_tables_say_of_what_they_are() -> None:
    report = analyze(FLOWN)
    table = rms_table(report)
    assert "errors and torques are the true ones" in table.title
    (row,) = (row for row in table.groups[0].rows if row[0] == "joints_1_3")
    assert row[3] == f"{report['navigation_error']['rms']['joints_1_3']:.3e}"
    ideal = analyze(random_log(6, 300, 0))
    assert "true" not in rms_table(ideal).title
    both = comparison_table({"one": report, "other": ideal})
    assert ["errors are of", "the truth", "the truth"] in both.groups[0].rows
    alone = comparison_table({"one": ideal})
    assert not any(row[0] == "errors are of" for row in alone.groups[0].rows)


def test_without_telemetry_there_is_none() -> None:
    log = FLOWN.rows(1, 15)
    report = analyze(log)
    assert report["navigation_error"] is None
    assert report["unavailable"]["navigation_error"] == "no telemetry was recorded"


def test_of_a_filter_there_is_no_estimate_to_judge() -> None:
    log: FlightLog = FLOWN.rows(0, FLOWN.ticks)
    parameters = log.flight["parameters"]
    controller = {**parameters["controller"], "navigation": "filtered"}
    log.flight = {**log.flight, "parameters": {**parameters, "controller": controller}}
    report = analyze(log)
    assert report["navigation"] == "filtered"
    assert "not recorded" in report["unavailable"]["estimate_error"]
