"""A flight in which nothing turned the base: drift in the place of errors, and said so."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from oracles import rotation_of
from random_logs import random_log
from scipy.spatial.transform import Rotation

from space_robot.analysis import analyze
from space_robot.analysis.attitude_drift import AttitudeDrift, attitude_drift, controls_base
from space_robot.analysis.columns import column_names
from space_robot.analysis.figures.figure_set import FigureSet
from space_robot.analysis.metrics import of_log
from space_robot.analysis.report_lines import lines
from space_robot.analysis.report_tables import comparison_table, rms_table
from space_robot.analysis.words import notes, remarks
from space_robot_msgs_py.bag.flight_log import FlightLog

OF_JOINTS = {"joints_1_3", "joints_4_6"}
TORQUES = {"torque_1_3", "torque_4_6"}


def free_log(seed: int = 0, ticks: int = 3000) -> FlightLog:
    """A random flight of which the bag says that nothing turned the base."""
    log = random_log(6, ticks, seed)
    log.flight["base_actuators"] = {"base_actuation": "none"}
    log.applied_torque[:, :3] = 0.0
    assert log.commanded_torque is not None
    log.commanded_torque[:, :3] = 0.0
    return log


@given(st.integers(0, 2**32 - 1))
def test_drift_is_the_rotation_from_the_start_on_the_bases_axes(seed: int) -> None:
    rng = np.random.default_rng(seed)
    log = random_log(2, 6, seed)
    rotations = Rotation.from_quat(rng.normal(size=(6, 4)))
    log.quaternion[:] = np.roll(rotations.as_quat(), 1, axis=1) * rng.choice([-1, 1], size=(6, 1))
    expected = (rotations[0].inv() * rotations).as_rotvec(degrees=True)
    np.testing.assert_allclose(attitude_drift(log), expected, atol=1e-10)
    found = of_log(AttitudeDrift(log), log)
    angle = np.linalg.norm(expected, axis=1)
    assert found == pytest.approx({"max_deg": angle.max(), "end_deg": angle[-1]}, abs=1e-10)


def test_small_drift_is_exact() -> None:
    log = random_log(2, 2, 0)
    log.quaternion[:] = [1.0, 0.0, 0.0, 0.0]
    assert (attitude_drift(log) == 0.0).all()
    log.quaternion[1] = [1.0, 0.0, 0.5e-12, 0.0]
    np.testing.assert_allclose(attitude_drift(log)[1], [0, np.degrees(1e-12), 0], rtol=1e-12)


def test_drift_counts_from_the_first_block() -> None:
    log = free_log(ticks=50)
    whole, parts = of_log(AttitudeDrift(log), log), AttitudeDrift(log)
    for start in range(0, 50, 10):
        parts.add(log.rows(start, start + 10), np.empty(0))
    assert parts.result() == whole


def test_a_free_base_has_drift_and_no_error_and_no_torque() -> None:
    log = free_log()
    assert not controls_base(log)
    report = analyze(log)
    angle = rotation_of(log.quaternion[0]).inv() * Rotation.from_quat(
        np.roll(log.quaternion, -1, axis=1)
    )
    assert report["attitude_drift"]["max_deg"] == pytest.approx(np.degrees(angle.magnitude().max()))
    assert report["rms"]["mean_axis"].keys() == report["rms"]["eq64"].keys() == OF_JOINTS | TORQUES
    assert report["maxima"].keys() == OF_JOINTS | TORQUES
    for measure in report["chatter"].values():
        assert measure.keys() == TORQUES
    for metric, keys in (("attitude", "attitude drifts"), ("base_torque", "no actuators")):
        assert keys in report["unavailable"][metric]
    assert any(
        f"{report['attitude_drift']['end_deg']:.4g} deg at the end" in text
        for text in remarks(report)
    )
    assert any(text.startswith("no attitude: nothing turns the base") for text in notes(report))


def test_errors_of_the_joints_are_those_of_any_flight() -> None:
    free, held = free_log(), free_log()
    del held.flight["base_actuators"]
    assert controls_base(held)
    of_free, of_held = analyze(free), analyze(held)
    assert of_held["attitude_drift"] is None
    assert of_held["rms"]["mean_axis"].items() > of_free["rms"]["mean_axis"].items()
    assert of_held["chatter"]["power_above_100_hz"].items() > (
        of_free["chatter"]["power_above_100_hz"].items()
    )
    drift = [line for line in lines([of_free, of_held]) if line.group == "attitude drift"]
    assert [line.name for line in drift] == ["max", "end"]
    assert all(line.texts[1] == "-" and line.unit == "deg" for line in drift)
    comparison_table({"free": of_free, "held": of_held})
    assert any("drift" in note for note in rms_table(of_free).notes)


def test_half_a_turn_does_not_take_the_estimates_error_away() -> None:
    """J0 is singular there, which is nothing to the joints."""
    log = free_log()
    log.quaternion[100] = [0.0, 1.0, 0.0, 0.0]
    report = analyze(log)
    assert report["estimate_error"]["rms"].keys() == {"1_3", "4_6"}
    assert np.isfinite(list(report["estimate_error"]["max"].values())).all()


def test_figures_and_columns_leave_the_base_out(tmp_path: Path) -> None:
    log = free_log(ticks=400)
    figures = FigureSet()
    figures.add("free", log)
    stems = {figure.svg.stem for figure in figures.save(tmp_path)}
    assert "control_results" in stems
    assert not {"junctions", "chatter"} & stems
    assert "attitude drift" in (tmp_path / "control_results.svg").read_text()
    figures.add("held", random_log(6, 400, 0))
    assert {"junctions", "chatter"} <= {figure.svg.stem for figure in figures.save(tmp_path)}
    names = column_names(log)
    assert "error_q_x" not in names
    assert "error_j0_rad" in names
