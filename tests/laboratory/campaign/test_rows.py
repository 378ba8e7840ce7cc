"""One task to its row: whatever happens, there is a row, with the numbers of the whole log."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from space_robot import FlownFlight, Scenario
from space_robot.analysis import measure as measured_of
from space_robot.analysis import tracking_error
from space_robot.analysis.analysed_log import PointingBudget
from space_robot.analysis.errors import attitude_drift
from space_robot.campaign.row import fly
from space_robot.campaign.row.fly import RowFlyer
from space_robot.campaign.row.measure import (
    Measured,
    measure_row,
    planned,
    row_columns,
    row_metrics,
)
from space_robot.campaign.row.row import Row, Task
from space_robot.campaign.study import Requirement, Study


def numbers_of(flown: FlownFlight, **options: Any) -> Measured:
    require = {k: Requirement.model_validate(v) for k, v in options.pop("require", {}).items()}
    return measure_row(flown.log, flown.log.ticks, require, **options)


@pytest.fixture(scope="module")
def flown() -> FlownFlight:
    return Scenario(case="3", sensors="fine", duration=1.2).fly()


@pytest.fixture(scope="module")
def measured(flown: FlownFlight) -> Measured:
    return numbers_of(flown)


def test_its_numbers_are_those_of_the_report(flown: FlownFlight, measured: Measured) -> None:
    """In the order that is known before the flight."""
    found = measured.metrics
    assert found == {name: flown.metrics[name] for name in found}
    assert list(found) == row_metrics(planned(flown.flight))
    for name in ("attitude_angle.rms", "base_torque.ripple_fast", "half_cone.jitter_max"):
        assert name in found
    largest = np.float32(found["half_cone.max"])
    assert measured.bands["half_cone"].max() == largest
    assert list(measured.bands) == row_columns(planned(flown.flight))


def test_maxima_are_norms_of_the_base_and_largest_values_of_joints(
    flown: FlownFlight, measured: Measured
) -> None:
    log, error = flown.log, tracking_error(flown.log)
    found = measured.metrics
    assert found["attitude.max"] == pytest.approx(np.linalg.norm(error[:, :3], axis=1).max())
    norms = np.linalg.norm(log.applied_torque[:, :3], axis=1)
    assert found["base_torque.max"] == pytest.approx(norms.max())
    assert found["joints_4_6.max"] == np.abs(error[:, 6:]).max()


def test_the_band_and_window_of_a_study_are_those_of_its_metrics(flown: FlownFlight) -> None:
    demand = {"metric": "half_cone.outside_band", "from_s": 0.2, "below": 1.0, "in": 0.9}
    budget = PointingBudget(band_deg=1e-4, window_s=0.1, axis=[2.0, 0.0, 0.0])
    found = numbers_of(flown, require={"p": demand}, budget=budget)
    late = measured_of(flown.log.rows(400, 2400), [demand["metric"]], budget=budget)
    assert found.require == {"p": late[demand["metric"]]}
    assert 0.0 < found.require["p"] < 1.0
    assert (
        found.metrics["half_cone.jitter_max"] != numbers_of(flown).metrics["half_cone.jitter_max"]
    )


def test_any_metric_can_be_required_and_is_in_the_row_then() -> None:
    """Of wheels, too; a number that a flight does not have meets nothing."""
    flown = Scenario(actuators="small_wheels", controller="ctc", duration=0.3).fly()
    require = {
        "wheels": {"metric": "wheel_1.momentum_limit_ticks", "below": 1.0, "in": 0.9},
        "drift": {"metric": "momentum_drift.max", "to_s": 0.2, "below": 1.0, "in": 0.9},
    }
    found = numbers_of(flown, require=require)
    assert found.require == {
        "wheels": flown.metrics["wheel_1.momentum_limit_ticks"],
        "drift": measured_of(flown.log.rows(0, 401))["momentum_drift.max"],
    }
    assert found.metrics["wheel_1.momentum_limit_ticks"] == found.require["wheels"]
    assert found.metrics["wheels.saturation"] == 0.0


def test_the_drift_of_a_free_base_is_that_of_the_report() -> None:
    """Without attitude control there is no attitude error."""
    flown = Scenario(actuators="none", controller="ctc", duration=0.3).fly()
    demand = {"metric": "attitude_drift.max", "to_s": 0.2, "below": 1.0, "in": 0.9}
    found = numbers_of(flown, require={"band": demand})
    angle = np.linalg.norm(attitude_drift(flown.log), axis=1)
    metrics = found.metrics
    assert metrics["attitude_drift.max"] == flown.metrics["attitude_drift.max"]
    assert metrics["attitude_drift.rms"] == pytest.approx(np.sqrt(np.mean(angle**2)), rel=1e-9)
    assert found.require["band"] == pytest.approx(angle[:401].max(), rel=1e-12)
    assert "attitude.max" not in metrics
    expected = angle.reshape(100, 6).max(axis=1)
    np.testing.assert_allclose(found.bands["attitude_drift"], expected, rtol=1e-6)


def test_a_mission_of_segments_has_the_error_of_its_tool() -> None:
    mission = {
        "start": {"joints_deg": [0, 90, 200, 20, 30, 10]},
        "segments": [{"tool": {"xyz": [0.05, 0.0, -0.05]}, "duration": 1.2}],
    }
    flown = Scenario(controller="ctc", mission=mission).fly()
    found = numbers_of(flown)
    assert list(found.metrics) == row_metrics(planned(flown.flight))
    for name in ("tool.rms", "tool.max", "tool_rotation.rms"):
        assert found.metrics[name] == flown.metrics[name] > 0.0
    assert found.bands["tool"].max() == np.float32(found.metrics["tool.max"])
    plain = Scenario(duration=0.1).fly()
    assert "tool" not in row_columns(planned(plain.flight))


def test_limits_of_torques_and_joints_that_stand_have_columns_as_far_as_the_log_has_them() -> None:
    """One joint is to move; the names are known before the flight."""
    mission = {
        "start": {"joints_deg": [0, 90, 200, 20, 30, 10]},
        "segments": [{"joints_deg": [5, 90, 200, 20, 30, 10], "duration": 1.2}],
    }
    limits = {"plant": {"joint_torque_limit": 1.0}}
    flown = Scenario(controller="ctc", mission=mission, parameters=limits).fly()
    metrics = numbers_of(flown).metrics
    assert [name for name in metrics if name.endswith(".standing")] == ["joint1.standing"]
    assert metrics["torque_limits.share"] == flown.metrics["torque_limits.share"] > 0.0
    known = row_metrics(planned(flown.flight))
    assert [name for name in known if name in metrics] == list(metrics)
    assert [name for name in known if name.endswith(".standing")] == ["joint1.standing"]


def test_limits_of_torques_are_the_same_in_lanes() -> None:
    limited = flyer(parameters={"plant": {"joint_torque_limit": 1.0}}, sensors="fine")
    tasks = [Task(run, "tde_stc") for run in range(3)]
    rows = limited.fly_batch(tasks)
    assert {row.task: row.digest for row in rows} == {t: limited(t).digest for t in tasks}
    assert all("torque_limits.share" in row.metrics for row in rows)


TASK = Task(1, "tde_stc")


def flyer(**scenario: Any) -> RowFlyer:
    content = {
        "scenario": {"duration": 0.1, **scenario},
        "laws": ["tde_stc", "tde_smc"],
        "vary": {"scenario.case": {"choice": ["1", "3"]}},
        "require": {"p": {"metric": "attitude.max", "below": 1.0, "in": 0.9}},
    }
    return RowFlyer.of(Study.model_validate(content), 3, 5)


def test_a_flight_that_ends_early_has_its_reason_and_no_numbers() -> None:
    row = flyer(faults=["torque_scale@0:all=0.5"], duration=20.0)(TASK)
    assert row.outcome in ("diverged", "unanswered")
    assert "tick" in row.reason
    assert row.ended_at_s is not None
    assert not row.metrics
    assert not row.require
    assert row.digest


def test_a_mistake_in_the_code_is_a_row(monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_: object) -> None:
        raise ZeroDivisionError("division\nby zero")

    flying = flyer()
    monkeypatch.setattr(fly, "fly_group", fail)
    row = flying(TASK)
    assert (row.outcome, row.reason) == ("failed", "ZeroDivisionError: division by zero")
    assert row.vary


def test_a_digest_covers_every_number() -> None:
    band = np.arange(3, dtype=np.float32)
    row = Row(TASK, "complete", "", 1.0, {"a": 1.0, "b": "x"}, {"m": 2.0}, {"r": 3.0}, {"s": band})
    changes: dict[str, list[Any]] = {
        "outcome": ["diverged"],
        "reason": ["why"],
        "ended_at_s": [1.5],
        "vary": [{"a": 1.0}, {"a": 1.0, "b": "y"}],
        "metrics": [{"m": np.nextafter(2.0, 3.0)}],
        "require": [{"r": -3.0}],
        "bands": [{"s": np.nextafter(band, np.float32(9))}],
    }
    others = [replace(row, **{key: v}) for key, values in changes.items() for v in values]
    digests = {other.digested().digest for other in others}
    digests |= {row.digested().digest, row.digested(b"state").digest}
    assert len(digests) == len(others) + 2
    assert replace(row, task=Task(7, "ctc")).digested().digest in digests
