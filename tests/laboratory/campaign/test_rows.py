"""One task to its row: whatever happens, there is a row, with the numbers of the whole log."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from space_robot import FlownFlight, Scenario
from space_robot.analysis import tracking_error
from space_robot.analysis.attitude_drift import attitude_drift
from space_robot.analysis.pointing import BasePointing, PointingBudget, base_pointing_error
from space_robot.campaign.row import fly
from space_robot.campaign.row.columns import Columns
from space_robot.campaign.row.fly import RowFlyer
from space_robot.campaign.row.measure import Measure, check_requirements
from space_robot.campaign.row.row import Row, Task
from space_robot.campaign.study import Requirement, Study
from space_robot_msgs_py.errors import InputError


@pytest.fixture(scope="module")
def flown() -> FlownFlight:
    return Scenario(case="3", sensors="fine", duration=1.2).fly()


@pytest.fixture(scope="module")
def measured(flown: FlownFlight) -> Measure:
    """In blocks of 700 ticks."""
    measure = Measure(flown.flight, {})
    for start in range(0, 2400, 700):
        measure.add(flown.log.rows(start, min(start + 700, 2400)))
    return measure


def test_its_numbers_are_those_of_the_report(flown: FlownFlight, measured: Measure) -> None:
    found, report, base = measured.metrics(), flown.metrics, flown.metrics["base_pointing"]
    expected = {f"{name}_rms": value for name, value in report["rms"]["mean_axis"].items()}
    for prefix, bands in (("ripple", report["ripple"]), ("fast_ripple", report["ripple"]["fast"])):
        expected |= {f"{prefix}_{name}": value for name, value in bands["rms"].items()}
    expected |= {"attitude_deg_rms": report["attitude_error_deg"]["mean_axis"]}
    expected |= {"attitude_deg_max": base["rotation_arcsec"]["max"] / 3600.0}
    expected |= {"half_cone_arcsec_outside_band": 1.0 - base["half_cone_arcsec"]["within_band"]}
    for name in ("half_cone_arcsec", "about_arcsec"):
        kinds = ("rms", "max", "jitter_rms", "jitter_max")
        expected |= {f"{name}_{kind}": base[name][kind] for kind in kinds}
    assert {name: found[name] for name in expected} == pytest.approx(expected, rel=1e-9)
    assert list(found) == list(Columns.of_log(flown.log).metrics)
    assert measured.bands()["half_cone_arcsec"].max() == np.float32(base["half_cone_arcsec"]["max"])


def test_maxima_are_norms_of_the_base_and_largest_values_of_joints(
    flown: FlownFlight, measured: Measure
) -> None:
    log, error = flown.log, tracking_error(flown.log)
    found = measured.metrics()
    assert found["attitude_max"] == pytest.approx(np.linalg.norm(error[:, :3], axis=1).max())
    norms = np.linalg.norm(log.applied_torque[:, :3], axis=1)
    assert found["base_torque_max"] == pytest.approx(norms.max())
    assert found["joints_4_6_max"] == np.abs(error[:, 6:]).max()


def test_the_band_and_window_of_a_study_are_those_of_its_metrics(flown: FlownFlight) -> None:
    angles = base_pointing_error(flown.log, np.array([1.0, 0.0, 0.0])).angles[:, 0]
    demand = {"metric": "half_cone_arcsec_outside_band", "from_s": 0.2, "below": 1.0, "in": 0.9}
    band = float(np.median(angles)) / 3600.0
    budget = PointingBudget(band_deg=band, window_s=0.1, axis=[2.0, 0.0, 0.0])
    measure = Measure(flown.flight, {"p": Requirement.model_validate(demand)}, (), budget)
    measure.add(flown.log)
    late = flown.log.time >= 0.2 - 1e-9
    outside = float(np.mean(angles[late] > 3600.0 * band))
    assert measure.require()["p"] == pytest.approx(outside, abs=1e-12)
    jitter = BasePointing(flown.log, budget)
    jitter.add(flown.log, np.empty(0))
    expected = jitter.result()["half_cone_arcsec"]["jitter_max"]
    assert measure.metrics()["half_cone_arcsec_jitter_max"] == pytest.approx(expected, rel=1e-9)


def test_the_drift_of_a_free_base_is_that_of_the_report() -> None:
    """Without attitude control there is no attitude error."""
    flown = Scenario(actuators="none", controller="ctc", duration=0.3).fly()
    demand = {"metric": "attitude_drift_max", "to_s": 0.2, "below": 1.0, "in": 0.9}
    measure = Measure(flown.flight, {"band": Requirement.model_validate(demand)})
    measure.add(flown.log)
    angle = np.radians(np.linalg.norm(attitude_drift(flown.log), axis=1))
    metrics = measure.metrics()
    largest = np.radians(flown.report()["attitude_drift"]["max_deg"])
    assert metrics["attitude_drift_max"] == pytest.approx(largest, rel=1e-12)
    assert metrics["attitude_drift_rms"] == pytest.approx(np.sqrt(np.mean(angle**2)), rel=1e-9)
    assert measure.require()["band"] == pytest.approx(angle[:401].max(), rel=1e-12)
    assert "attitude_max" not in metrics
    assert list(metrics) == [
        name for name in Columns.of_log(flown.log).metrics if "ripple" not in name
    ]
    expected = angle.reshape(100, 6).max(axis=1)
    np.testing.assert_allclose(measure.bands()["attitude_drift"], expected, rtol=1e-6)


@pytest.mark.parametrize(
    ("demand", "said"),
    [
        ({"metric": "attitude_mx"}, "in my.yaml: require.p.metric: did you mean attitude_max"),
        ({"metric": "attitude_max", "from_s": 1.2}, "from_s: must be before the end .*1.2 s"),
        (
            {"metric": "joints_1_3_rms", "from_s": 0.3001, "to_s": 0.3004},
            r"my.yaml: require.p.to_s: no tick between 0.3001 and 0.3004 s",
        ),
        (
            {"metric": "ripple_base_torque", "from_s": 0.5},
            "my.yaml: require.p.metric: ripple_base_torque needs 1 s of flight, got 0.7 s",
        ),
        (
            {"metric": "half_cone_arcsec_jitter_rms", "to_s": 0.5},
            r"half_cone_arcsec_jitter_rms needs 1 s of flight \(pointing.window_s\), got 0.5005 s",
        ),
    ],
)
def test_what_no_flight_has_cannot_be_required(
    flown: FlownFlight, demand: dict[str, object], said: str
) -> None:
    require = {"p": Requirement.model_validate({**demand, "below": 1.0, "in": 0.9})}
    with pytest.raises(InputError, match=said):
        check_requirements(flown.flight, require, "my.yaml")


def test_a_mission_of_segments_has_the_error_of_its_tool() -> None:
    mission = {
        "start": {"joints_deg": [0, 90, 200, 20, 30, 10]},
        "segments": [{"tool": {"xyz": [0.05, 0.0, -0.05]}, "duration": 1.2}],
    }
    flown = Scenario(controller="ctc", mission=mission).fly()
    measure = Measure(flown.flight, {})
    measure.add(flown.log)
    found, tool = measure.metrics(), flown.metrics["tool"]
    assert list(found) == list(Columns.of_flight(flown.flight).metrics)
    assert found["tool_rms"] == pytest.approx(tool["rms_m"], rel=1e-12)
    assert found["tool_max"] == tool["largest_m"] > 0.0
    assert np.degrees(found["tool_rotation_rms"]) == pytest.approx(tool["rms_deg"], rel=1e-12)
    assert measure.bands()["tool"].max() == np.float32(tool["largest_m"])
    assert "tool" not in Columns.of_log(flown.log).names


TASK = Task(1, "tde_stc")


def flyer(**scenario: Any) -> RowFlyer:
    content = {
        "scenario": {"duration": 0.1, **scenario},
        "laws": ["tde_stc", "tde_smc"],
        "vary": {"scenario.case": {"choice": ["1", "3"]}},
        "require": {"p": {"metric": "attitude_max", "below": 1.0, "in": 0.9}},
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
    monkeypatch.setattr(fly, "fly_blocks", fail)
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
