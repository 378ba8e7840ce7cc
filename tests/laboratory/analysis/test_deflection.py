"""Deflection of gears, and the tables' lines on gears and on torques from outside."""

from __future__ import annotations

import copy
import itertools
import json
from typing import Any

import numpy as np
import pytest
from geared_robots import geared_paper_arm, with_gears
from numpy.typing import NDArray

from space_robot.analysis import analyze
from space_robot.analysis.deflection import Deflection, deflection
from space_robot.analysis.report_lines import Line, lines
from space_robot.analysis.report_tables import DEFINITIONS, comparison_table
from space_robot.console.tables import NONE
from space_robot.flight.plan import Flight, FlightPlan, resolve
from space_robot.flight.simulate import simulate
from space_robot_model.robot import Robot
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.samples import SOURCES, Timebase

Array = NDArray[np.float64]

JOINTS = ("a", "b", "c", "d")
GEARED = ("b", "d")
TICKS = 500


@pytest.fixture
def log() -> FlightLog:
    """Two of four joints have gears; links and motors are anywhere."""
    log = FlightLog.allocate(TICKS, JOINTS, Timebase(500_000), geared_names=GEARED)
    rng = np.random.default_rng(3)
    log.joint_positions[:] = rng.uniform(-3.0, 3.0, (TICKS, 4))
    log.motor_positions[:] = log.joint_positions[:, [1, 3]] + rng.normal(size=(TICKS, 2)) * [1, 9]
    return log


def result_of(log: FlightLog, *cuts: int) -> dict[str, dict[str, float]]:
    metric = Deflection(log.rows(0, 1))
    for start, stop in itertools.pairwise((0, *cuts, log.ticks)):
        metric.add(log.rows(start, stop), np.empty(0))
    return metric.result()


def test_it_is_motor_less_link_of_joints_with_gears(log: FlightLog) -> None:
    difference = log.motor_positions - log.joint_positions[:, [1, 3]]
    np.testing.assert_array_equal(deflection(log), difference)
    expected = {
        "largest": dict(zip(GEARED, np.abs(difference).max(axis=0), strict=True)),
        "rms": dict(zip(GEARED, np.sqrt((difference**2).mean(axis=0)), strict=True)),
    }
    found = result_of(log)
    assert list(found) == ["largest", "rms"]
    for name, values in expected.items():
        assert found[name] == pytest.approx(values, rel=1e-12)


@pytest.mark.parametrize("cuts", [(1,), (250,), (1, 2, 3, 250, 499)])
def test_blocks_make_the_whole(log: FlightLog, cuts: tuple[int, ...]) -> None:
    whole, parts = result_of(log), result_of(log, *cuts)
    assert parts["largest"] == whole["largest"]
    assert parts["rms"] == pytest.approx(whole["rms"], rel=1e-13)


@pytest.fixture(scope="module")
def flown(paper_robot: Robot) -> FlightLog:
    """In orbit, with the sines of case 3, and gears in two joints."""
    gears = geared_paper_arm(paper_robot).gears
    robot = with_gears(paper_robot, [gears[0], None, None, None, gears[4], None])
    plan = FlightPlan(controller="ctc", robot=robot, orbit="iss", case="3", duration=0.2)
    return simulate(Flight(resolve(plan)))


def test_the_report_has_it_by_joint_as_valid_json(flown: FlightLog) -> None:
    report = analyze(flown)
    difference = flown.motor_positions - flown.joint_positions[:, [0, 4]]
    assert report["deflection"] == {
        "largest": pytest.approx(
            dict(zip(("joint1", "joint5"), np.abs(difference).max(axis=0), strict=True))
        ),
        "rms": pytest.approx(
            dict(zip(("joint1", "joint5"), np.sqrt((difference**2).mean(axis=0)), strict=True))
        ),
    }
    assert json.loads(json.dumps(report, allow_nan=False))["deflection"] == report["deflection"]
    assert tuple(report["disturbance_by_source"]) == (*SOURCES, "sines")


def by_label(found: list[Line]) -> dict[tuple[str, str], Line]:
    labels = {(line.group, line.name): line for line in found}
    assert len(labels) == len(found)
    return labels


def numbered(value: Any, counter: itertools.count[int]) -> Any:
    """The same report with another number in every place."""
    if isinstance(value, dict):
        return {key: numbered(inner, counter) for key, inner in value.items()}
    return 1.0 + next(counter) / 1000.0 if isinstance(value, float) else value


def test_every_line_is_its_figure_of_each_flight(flown: FlightLog) -> None:
    """And a dash where a flight is in no orbit and has no gears."""
    counter, report = itertools.count(), analyze(flown)
    reports = [copy.deepcopy(report) for _ in range(2)]
    for each in reports:
        for key in ("disturbance_by_source", "deflection"):
            each[key] = numbered(each[key], counter)
    plain = {**copy.deepcopy(report), "disturbance_by_source": None, "deflection": None}
    found = by_label(lines([*reports, plain]))
    expected: dict[tuple[str, str], tuple[str, list[str]]] = {}
    for source in (*SOURCES, "sines"):
        for key, name, unit in (
            ("rms_n_m", "RMS", "N m"),
            ("max_n_m", "max", "N m"),
            ("impulse_n_m_s", "impulse", "N m s"),
        ):
            texts = [f"{each['disturbance_by_source'][source][key]:.4g}" for each in reports]
            expected["disturbance torque", f"{source} {name}"] = unit, [*texts, NONE]
    for joint in ("joint1", "joint5"):
        for key, name in (("rms", "RMS"), ("largest", "largest")):
            texts = [f"{each['deflection'][key][joint]:.4g}" for each in reports]
            expected["deflection", f"{joint} {name}"] = "rad or m", [*texts, NONE]
    groups = {group for group, _ in expected}
    assert groups <= DEFINITIONS.keys()
    assert {
        label: (line.unit, line.texts) for label, line in found.items() if label[0] in groups
    } == expected
    assert not {label[0] for label in by_label(lines([plain]))} & groups


def test_a_comparison_shows_both_groups_with_their_meaning(flown: FlightLog) -> None:
    table = comparison_table({"flight": analyze(flown)})
    groups = {group.name: group for group in table.groups}
    for name in ("disturbance torque", "deflection"):
        assert groups[name].note == DEFINITIONS[name]
    texts = {row[0] for group in table.groups for row in table.texts(group)}
    assert "gravity_gradient RMS (N m)" in texts
    assert "joint5 largest (rad or m)" in texts


def test_flights_without_gears_have_none() -> None:
    report = analyze(simulate(Flight(resolve(FlightPlan(duration=0.05)))))
    assert report["deflection"] is None
    assert report["disturbance_by_source"] is None
    assert report["missed_captures"] is None
    assert not {"deflection", "disturbance_by_source", "missed_captures"} & set(
        report["unavailable"]
    )
