"""The report of a flight: its keys, its blocks, and every line of its tables, of each flight."""

from __future__ import annotations

import copy
import itertools
import json
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import yaml
from numpy.typing import NDArray
from paths import CONFIG, DATA
from robots import PLATES, driven_paper
from strategies import random_log

from space_robot import Scenario
from space_robot.analysis import Analysis, analyze
from space_robot.analysis.deflection import Deflection, deflection
from space_robot.analysis.described import NotDescribedError, momentum_of, orbit_of, robot_of
from space_robot.analysis.metrics import of_log
from space_robot.analysis.report_lines import Line, lines
from space_robot.analysis.report_tables import DEFINITIONS, comparison_table, rms_table
from space_robot.console.tables import NONE
from space_robot_model.robot.gears import geared_joints
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.bag.reader import read_flight
from space_robot_msgs_py.samples import RobotNames, Timebase

Array = NDArray[np.float64]
Report = dict[str, Any]
LINES = DATA / "report_lines.txt"
DRIVEN_LINES, DRIVEN = DATA / "report_lines_driven.txt", {"disturbance torque", "deflection"}
NOT_BRIEF = {
    "RMS, mean of axes",
    "RMS, eq. (64)",
    "variation per s",
    "power > 100 Hz",
    "ripple",
    "asked of the base",
}
OF_OTHER_FLIGHTS = {
    "attitude drift",
    "momentum",
    "pushed by thrusters",
    "disturbance torque",
    "deflection",
    "own metric",
}
HEIGHT = 543e3


def numbers(report: Any, path: str = "") -> dict[str, Any]:
    """Return the leaves of a report by their paths."""
    if isinstance(report, (list, tuple)):
        report = dict(enumerate(report))
    if not isinstance(report, dict):
        return {path: report}
    parts = [numbers(value, f"{path}.{key}") for key, value in report.items()]
    return {name: value for part in parts for name, value in part.items()}


class Named(float):
    """A number that shows its path in the report, and how it is written."""

    path: str

    def __format__(self, spec: str) -> str:
        return f"{self.path}:{spec}"


def named(value: Any, path: str = "") -> Any:
    """The same report with a `Named` in the place of each number with a point, 1.5 in size."""
    if isinstance(value, dict):
        return {key: named(v, f"{path}.{key}".removeprefix(".")) for key, v in value.items()}
    if not isinstance(value, float):
        return value
    number = Named(1.5)
    number.path = path
    return number


def test_a_report_does_not_depend_on_the_blocks() -> None:
    own = {"case": "3", "sensors": "fine", "actuators": "small_wheels", "orbit": "iss"}
    log = Scenario(**own, swaps=["1.5:tde_smc"], duration=3.0).fly().check().log
    parts = Analysis()
    for start, stop in itertools.pairwise([0, 1, 2999, 3001, 5999, 6000]):
        parts.add(log.rows(start, stop))
    expected, found = numbers(analyze(log)), numbers(parts.report())
    assert list(found) == list(expected)
    for name, value in expected.items():
        if isinstance(value, float):
            np.testing.assert_allclose(found[name], value, rtol=1e-6, atol=1e-15, err_msg=name)
        else:
            assert found[name] == value, name


@pytest.fixture(scope="module")
def report() -> Report:
    log = Scenario(duration=1.0, faults=["noise_gyro@0:1e-9"]).fly().log
    log.latency_s = np.linspace(1e-4, 3e-4, log.ticks)
    log.flight["parameters"]["plant"] |= {"base_torque_limit": 1.0, "joint_torque_limit": 1.0}
    report = analyze(log)
    assert report["unavailable"] == {}
    counts = {"filled_ticks": 3, "unanswered_ticks": 4, "lost": {"a": 5, "b": 6}}
    report["saturation"]["ticks"], report["missed_deadlines"]["differing_ticks"] = 7, 8
    return {**report, **counts}


def table_of(found: list[Line]) -> list[str]:
    return [" | ".join((x.group, x.name, x.unit, *x.texts)).replace("\n", " / ") for x in found]


def test_every_line_is_its_figure(report: Report) -> None:
    shown = named(report)
    found = lines([shown])
    assert table_of(found) == LINES.read_text("utf-8").splitlines()
    assert {line.group for line in found} == DEFINITIONS.keys() - OF_OTHER_FLIGHTS
    left_out = {line.group for line in found} - {x.group for x in lines([shown], brief=True)}
    assert left_out == NOT_BRIEF


def test_what_is_special_in_a_line(report: Report) -> None:
    report = copy.deepcopy(report)
    report["pointing"]["boresight_rad"] = {"rms": np.radians(1 / 3600), "max": 1e-2, "end": 1.0}
    report["settling"]["settled_s"]["attitude"] = None
    report["saturation"] |= {"base_torque_limit_n_m": None, "joint_torque_limit_n_m": None}
    report["unfinished"], report["damage"] = "cut", ["a", "b"]
    found = {(x.group, x.name): x.texts for x in lines([report])}
    for label, text in {
        ("pointing", "RMS"): "4.85e-06 rad\n1 arcsec",
        ("pointing", "max"): "0.01 rad\n2.06e+03 arcsec",
        ("pointing", "end"): "1 rad\n57.3 deg",
        ("settled after", "attitude"): "never",
        ("saturation", "ticks at a limit"): "no limits",
        ("recording", "finished"): "no",
        ("recording", "damage found"): "2",
    }.items():
        assert found[label] == [text]


def test_a_figure_that_a_flight_does_not_have_is_a_dash(report: Report) -> None:
    log = random_log(6, 300, 0)
    log.flight = {}
    found = {(x.group, x.name): x.texts for x in lines([analyze(log), report])}
    for label in (
        ("saturation", "ticks at a limit"),
        ("latency", "p99"),
        ("estimate error", "base max"),
        ("pointing", "RMS"),
        ("ripple", "base_torque"),
    ):
        unknown, known = found[label]
        assert unknown == NONE
        assert known != NONE
    assert found["maximum", "base_torque"][0] != NONE


def test_the_attitude_is_shown_in_degrees_and_a_divergence_with_exponents(report: Report) -> None:
    """And gains of one's own in the title."""
    report = copy.deepcopy(report)
    report["attitude_error_deg"] = {"mean_axis": 1.146e-3, "eq64": 6.6e-4, "max": 2e-3}
    report["navigation_error"] = None
    for torque, shown in ((2.956e7, "2.956e+07"), (20.0, "20.0000")):
        report["rms"]["mean_axis"]["base_torque"] = torque
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
    found = of_log(Deflection(log.rows(0, 1)), log)
    largest, rms = np.abs(difference).max(axis=0), np.sqrt((difference**2).mean(axis=0))
    for name, values in (("largest", largest), ("rms", rms)):
        assert found[name] == pytest.approx(dict(zip("bd", values, strict=True)), rel=1e-12)


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


def test_every_line_on_orbit_and_gears_is_its_figure(driven: FlightLog) -> None:
    """And a dash where a flight is in no orbit and has no gears."""
    report = analyze(driven)
    json.dumps(report, allow_nan=False)
    plain = Scenario(duration=0.1).fly().report()
    found = table_of([x for x in lines([named(report), plain]) if x.group in DRIVEN])
    assert found == DRIVEN_LINES.read_text("utf-8").splitlines()
    assert not {x.group for x in lines([plain])} & DRIVEN
    notes = {group.name: group.note for group in comparison_table({"flight": report}).groups}
    assert all(notes[name] == DEFINITIONS[name] for name in DRIVEN)


def test_robot_and_orbit_are_those_that_flew(driven: FlightLog) -> None:
    robot, orbit = robot_of(driven), orbit_of(driven)
    assert geared_joints(robot) == [1, 2, 4]
    assert robot.geared_names == driven.geared_names == ("joint2", "joint3", "joint5")
    assert [plate.area for plate in robot.plates] == [plate["area"] for plate in PLATES]
    assert orbit.orbital_elements.height == HEIGHT
    assert orbit.magnetism.strength == 2.971e-5


def test_motors_that_the_robot_has_not_are_told(driven: FlightLog) -> None:
    """Their momentum would be left out, or that of another joint."""
    momentum_of(driven)
    velocities = driven.motor_velocities[:, :1]
    other = replace(driven, geared_names=("joint2",), motor_velocities=velocities)
    with pytest.raises(NotDescribedError, match="has gears in the joints joint2, joint3, joint5"):
        momentum_of(other)


def test_a_name_of_a_file_is_no_number(driven: FlightLog) -> None:
    """Numbers come before the file's name, whose file may be elsewhere."""
    parameters = {"robot": "paper", "orbit": "gone.yaml", "orbital_elements.height": HEIGHT}
    flight = {**driven.flight, "parameters": {"plant": parameters}}
    few = replace(driven, flight=flight, trusted=True)
    assert orbit_of(few).orbital_elements.height == HEIGHT
    flight = {**driven.flight, "parameters": {"plant": {"orbit": "/etc/mine.yaml"}}}
    said = "refers to a file as its orbit, '/etc/mine.yaml'"
    assert said in json.dumps(analyze(replace(driven, flight=flight)))
