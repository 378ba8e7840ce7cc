"""The report of a flight: its keys, its blocks, and every line of its tables, of each flight."""

from __future__ import annotations

import copy
import json
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import yaml
from paths import CONFIG
from robots import PLATES, driven_paper
from strategies import random_log

from space_robot import Scenario
from space_robot.analysis import analyze, describe, measure
from space_robot.analysis.actuation import deflection
from space_robot.analysis.described import NotDescribedError, flown_robot, plant_settings
from space_robot.analysis.momentum import whole_momentum
from space_robot.analysis.report_tables import comparison_table, metrics_table, rms_table
from space_robot.console.tables import NONE, Table
from space_robot_model.robot.gears import geared_joints
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.bag.reader import read_flight
from space_robot_msgs_py.samples import RobotNames, Timebase

Report = dict[str, Any]
HEIGHT = 543e3


def test_a_report_does_not_depend_on_the_blocks(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of a flight longer than one; nor on whether it is described by its scenario or in a bag."""
    own = {"case": "3", "sensors": "fine", "actuators": "small_wheels", "orbit": "iss"}
    log = Scenario(**own, swaps=["1.5:tde_smc"], duration=3.0).fly().check().log
    expected = analyze(log)
    monkeypatch.setattr("space_robot_msgs_py.bag.flight_log.BLOCK_TICKS", 1700)
    for part in (log, replace(log, scenario=None)):
        found = analyze(part)
        assert list(found["metrics"]) == list(expected["metrics"])
        for name, value in expected["metrics"].items():
            close = pytest.approx(value, rel=1e-9, abs=1e-12)
            assert found["metrics"][name] == close, name
        for key in found.keys() - {"metrics", "sizing"}:
            assert found[key] == expected[key], key


@pytest.fixture(scope="module")
def report() -> Report:
    log = Scenario(duration=1.0, faults=["noise_gyro@0:1e-9"]).fly().log
    log.latency_s = np.linspace(1e-4, 3e-4, log.ticks)
    log.scenario = None
    limits = {"base_torque_limit": 1.0, "joint_torque_limit": 1.0}
    log.flight["scenario"]["parameters"]["plant"] |= limits
    report = analyze(log)
    assert report["unavailable"] == {}
    counts = {"filled_ticks": 3, "unanswered_ticks": 4, "lost": {"a": 5, "b": 6}}
    return {**report, **counts}


def rows_of(table: Table) -> dict[str, list[str]]:
    return {str(row[0]): [*map(str, row[1:])] for group in table.groups for row in group.rows}


def test_tables_show_every_metric_with_its_unit_and_meaning(report: Report) -> None:
    """Those of the table of RMS are not said again."""
    brief, whole = metrics_table(report), comparison_table({"one": report})
    rows = rows_of(whole)
    assert rows["joints_1_3.rms (rad)"] == [f"{report['metrics']['joints_1_3.rms']:.4g}"]
    assert rows["base_torque.variation (N m/s)"]
    assert rows["base_x torque (N m)"]
    assert rows["messages lost"] == ["11"]
    said = {name.partition(" ")[0] for name in rows}
    hidden = report["metrics"].keys() - said
    assert hidden == {name for name in report["metrics"] if not describe(name).is_shown}
    for name in ("attitude.rms", "navigation_attitude.max", "joint1.ripple_axis"):
        assert name in hidden
    shown = rows_of(brief)
    assert shown.keys() < rows.keys()
    for name in ("joints_1_3.max (rad)", "base_drift.end (m)", "half_cone.end (arcsec)"):
        assert name in shown
    for statistic in ("rms", "rms_eq64", "variation", "chatter", "ripple"):
        assert not [name for name in shown if name.startswith(f"base_torque.{statistic} ")]
    notes = {group.name: group.note for group in whole.groups}
    assert "ripple: RMS above 2 Hz" in notes["torques"]


def test_what_is_special_in_a_row(report: Report) -> None:
    report = copy.deepcopy(report)
    report["metrics"] |= {"attitude.settling": np.inf, "half_cone.max": 7200.0, "own": 3.0}
    report["unfinished"], report["damage"] = "cut", ["a", "b"]
    log = random_log(6, 300, 0)
    log.flight, log.laws = {}, ()
    rows = rows_of(comparison_table({"one": report, "other": analyze(log)}))
    assert rows["attitude.settling (s)"][0] == "never"
    assert rows["half_cone.max (arcsec)"][0] == "2 deg"
    assert rows["own"] == ["3", NONE]
    assert (rows["finished"][0], rows["damage found"][0]) == ("no", "2")
    for name in ("latency.p99_ms (ms)", "estimate_error_base.max (N m)", "boresight.rms (arcsec)"):
        known, unknown = rows[name]
        assert unknown == NONE
        assert known != NONE


def test_the_attitude_is_shown_in_degrees_and_a_divergence_with_exponents(report: Report) -> None:
    """And gains of one's own in the title."""
    report = copy.deepcopy(report)
    metrics = report["metrics"]
    metrics |= {"attitude_angle.rms": 1.146e-3, "attitude_angle.rms_eq64": 6.6e-4}
    for name in [name for name in metrics if name.startswith("navigation")]:
        del metrics[name]
    for torque, shown in ((2.956e7, "2.956e+07"), (20.0, "20.0000")):
        metrics["base_torque.rms"] = torque
        rows = {row[0]: row for row in rms_table(report).groups[0].rows}
        assert rows["attitude"][:4] == ["attitude", "deg", "1.146e-03", "6.600e-04"]
        assert rows["base_torque"][2] == shown
    assert "own" not in rms_table(report).title
    report |= {"controller": "ctc", "own_gains": ["ctc.k_p", "ctc.k_d"], "swaps": [], "laws": []}
    assert "gains default, own ctc.k_p, ctc.k_d:" in rms_table(report).title


def test_the_deflection_is_motor_less_link_of_joints_with_gears() -> None:
    log = FlightLog.allocate(500, RobotNames(tuple("abcd"), geared=("b", "d")), Timebase(500_000))
    rng = np.random.default_rng(3)
    log.joint_positions[:] = rng.uniform(-3.0, 3.0, (500, 4))
    log.motor_positions[:] = log.joint_positions[:, [1, 3]] + rng.normal(size=(500, 2)) * [1, 9]
    difference = log.motor_positions - log.joint_positions[:, [1, 3]]
    np.testing.assert_array_equal(deflection(log), difference)
    largest, rms = np.abs(difference).max(axis=0), np.sqrt((difference**2).mean(axis=0))
    expected = {"deflection_b.max": largest[0], "deflection_d.rms": rms[1]}
    assert measure(log, list(expected)) == pytest.approx(expected, rel=1e-12)


@pytest.fixture(scope="module")
def driven(tmp_path_factory: pytest.TempPathFactory) -> FlightLog:
    """A flight in orbit, with gears and the sines of case 3, whose files are gone."""
    folder = tmp_path_factory.mktemp("driven")
    robot, orbit = folder / "paper.yaml", folder / "mine.yaml"
    robot.write_text(yaml.safe_dump(driven_paper()))
    content = yaml.safe_load((CONFIG / "orbits" / "iss.yaml").read_text())
    content["plant_node"]["ros__parameters"]["orbital_elements"]["height"] = HEIGHT
    orbit.write_text(yaml.safe_dump(content))
    scenario = Scenario(robot=str(robot), orbit=str(orbit), case="3", duration=0.1)
    scenario.fly(folder / "bag")
    robot.unlink()
    orbit.unlink()
    return read_flight(folder / "bag")


def test_on_orbit_and_with_gears_there_are_more_rows(driven: FlightLog) -> None:
    """And a dash where a flight is in no orbit and has no gears."""
    report = analyze(driven)
    json.dumps({**report, "metrics": {}}, allow_nan=False)
    plain = Scenario(duration=0.1).fly().report()
    rows = rows_of(comparison_table({"driven": report, "plain": plain}))
    for name in (
        "disturbance_gravity_gradient.rms (N m)",
        "disturbance_sines.max (N m)",
        "impulse_drag.max (N m s)",
        "deflection_joint2.max (rad or m)",
    ):
        known, unknown = rows[name]
        assert float(known) >= 0.0
        assert unknown == NONE


def test_robot_and_orbit_are_those_that_flew(driven: FlightLog) -> None:
    robot, orbit = flown_robot(driven), plant_settings(driven)
    assert geared_joints(robot) == [1, 2, 4]
    assert robot.geared_names == driven.geared_names == ("joint2", "joint3", "joint5")
    assert [plate.area for plate in robot.plates] == [plate["area"] for plate in PLATES]
    assert orbit.orbital_elements.height == HEIGHT
    assert orbit.magnetism.strength == 2.971e-5


def test_motors_that_the_robot_has_not_are_told(driven: FlightLog) -> None:
    """Their momentum would be left out, or that of another joint."""
    whole_momentum(driven)
    velocities = driven.motor_velocities[:, :1]
    other = replace(driven, geared_names=("joint2",), motor_velocities=velocities)
    with pytest.raises(NotDescribedError, match="has gears in the joints joint2, joint3, joint5"):
        whole_momentum(other)


def test_a_file_that_a_bag_names_is_not_read(driven: FlightLog) -> None:
    scenario = {**driven.flight["scenario"], "orbit": "/etc/mine.yaml"}
    flight = {**driven.flight, "scenario": scenario}
    said = "refers to a file as its orbit, '/etc/mine.yaml'"
    assert said in json.dumps(analyze(replace(driven, flight=flight)))
