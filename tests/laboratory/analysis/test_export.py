"""Tables, files and parts of a flight: the numbers that were flown; and a user's own metric."""

from __future__ import annotations

import functools
import json
from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest
from click.testing import CliRunner, Result
from hypothesis import given
from hypothesis import strategies as st
from pyarrow import csv, parquet

from space_robot import Scenario, load_bag
from space_robot.analysis import analyze, excerpt, tracking_error
from space_robot.analysis.export import (
    BATCH,
    METADATA_KEY,
    batches,
    column_names,
    dataframe,
    write_csv,
    write_parquet,
)
from space_robot.analysis.own_metric import (
    SESSION,
    call,
    check_names,
    importable_text,
    metric_function,
    parse,
)
from space_robot.analysis.report import render
from space_robot.cli.main import cli
from space_robot.console.files import atomic_file
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.errors import InputError
from space_robot_msgs_py.samples import RobotNames, Timebase


@pytest.fixture(scope="module")
def log() -> FlightLog:
    log = Scenario(duration=0.3, case="2").fly().log
    log.latency_s = np.append(np.nan, np.full(599, 1e-4))
    return log


def assert_same(table: pa.Table, log: FlightLog) -> None:
    assert table.num_rows == log.ticks
    assert log.commanded_torque is not None
    assert log.latency_s is not None
    error, first = tracking_error(log), log.first_tick
    np.testing.assert_allclose(table["time_s"].to_numpy(), log.time, rtol=1e-12)
    for name, expected in {
        "tick": np.arange(first, first + log.ticks),
        "q_w": log.quaternion[:, 0],
        "omega_base_x_rad_s": log.omega_base[:, 0],
        "base_position_z_m": log.base_position[:, 2],
        "base_velocity_y_m_s": log.base_velocity[:, 1],
        "joint1_position_rad": log.joint_positions[:, 0],
        "joint6_velocity_rad_s": log.joint_velocities[:, 5],
        "applied_torque_joint6_n_m": log.applied_torque[:, 8],
        "commanded_torque_joint2_n_m": log.commanded_torque[:, 4],
        "reference_q_w": log.reference_base[:, 0],
        "reference_omega_base_rate_x_rad_s2": log.reference_base[:, 7],
        "reference_joint3_velocity_rad_s": log.reference_joints[:, 1, 2],
        "reference_joint6_acceleration_rad_s2": log.reference_joints[:, 2, 5],
        "error_q_z": error[:, 2],
        "error_joint4_rad": error[:, 6],
    }.items():
        np.testing.assert_array_equal(table[name].to_numpy(), expected, err_msg=name)
    assert table["latency_s"].null_count == int(np.isnan(log.latency_s).sum())


def test_files_and_tables_have_every_bit_and_what_was_flown(log: FlightLog, tmp_path: Path) -> None:
    """Of a part of a flight, too, whose first tick is not 0."""
    for part in (log, excerpt(log, 0.1, 0.2)):
        file = tmp_path / f"{part.first_tick}.csv"
        write_csv(part, file)
        write_parquet(part, file.with_suffix(".parquet"))
        table = parquet.read_table(file.with_suffix(".parquet"))
        about = json.loads(table.schema.metadata[METADATA_KEY])
        assert (about["flight"], about["lost"]) == (json.loads(json.dumps(log.flight)), log.lost)
        frame = dataframe(part)
        assert [*frame.columns] == column_names(part)
        assert frame["tick"].dtype == np.int64
        for each in (table, csv.read_csv(file), pa.Table.from_pandas(frame)):
            assert_same(each, part)


def test_without_pyarrow_there_is_csv_and_one_line_on_parquet(
    log: FlightLog, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("space_robot.analysis.export.find_spec", lambda name: None)
    with pytest.raises(InputError, match=r"pip install 'pyarrow>=\d"):
        write_parquet(log, tmp_path / "flight.parquet")
    write_csv(log, tmp_path / "flight.csv")
    assert [path.name for path in tmp_path.iterdir()] == ["flight.csv"]


def test_every_column_has_one_name_and_what_is_not_known_has_none() -> None:
    log = FlightLog.allocate(BATCH + 5, ("a", "b"), Timebase(500_000))
    names = column_names(log)
    assert len(set(names)) == len(names)
    assert not any(name.startswith(("commanded", "latency")) for name in names)
    assert [len(ticks) for ticks, _ in batches(log)] == [BATCH, 5]
    log.flight = {"base_actuators": {"base_actuation": "none"}}
    of_base = {f"error_q_{axis}" for axis in "xyz"} | {f"error_base_{axis}_deg" for axis in "xyz"}
    assert set(names) - set(column_names(log)) == of_base


def test_every_actuator_has_its_columns(tmp_path: Path) -> None:
    names = RobotNames(("a",), ("w1", "w2"), ("t1",), torquers=("m1", "m2", "m3"))
    log = FlightLog.allocate(3, names, Timebase(500_000))
    log.commanded_torque = np.zeros((3, 4))
    for k, values in enumerate(log.columns.values()):
        values[:] = np.arange(values.size).reshape(values.shape) + 100.0 * k
    write_csv(log, tmp_path / "flight.csv")
    table = csv.read_csv(tmp_path / "flight.csv")
    for name, expected in {
        "wheel_velocity_2_rad_s": log.wheel_velocities[:, 1],
        "wheel_torque_1_n_m": log.wheel_torques[:, 0],
        "thrust_1_n": log.thrusts[:, 0],
        "commanded_wheel_torque_2_n_m": log.actuator_commands[:, 1],
        "commanded_thrust_1_n": log.actuator_commands[:, 2],
        "commanded_dipole_1_a_m2": log.actuator_commands[:, 3],
        "commanded_dipole_3_a_m2": log.actuator_commands[:, 5],
    }.items():
        np.testing.assert_array_equal(table[name].to_numpy(), expected, err_msg=name)
    assert not any("wheel_velocity_3" in name for name in table.column_names)


def test_a_file_that_came_while_ours_was_written_stays(log: FlightLog, tmp_path: Path) -> None:
    path = tmp_path / "x"

    def write() -> None:
        with atomic_file(path) as file:
            file.write(b"ours")
            path.write_text("theirs")

    with pytest.raises(InputError, match="x: exists already"):
        write()
    assert path.read_text() == "theirs"
    assert list(tmp_path.iterdir()) == [path]
    with pytest.raises(InputError, match="the folder cannot be created"):
        write_parquet(log, path / "flight.parquet")


@given(st.sets(st.integers(0, 600), min_size=3, max_size=3))
def test_a_part_has_the_rows_of_its_time(log: FlightLog, edges: set[int]) -> None:
    low, middle, high = sorted(edges)
    part = excerpt(log, low * 5e-4, high * 5e-4)
    assert (part.first_tick, part.ticks) == (low, high - low)
    np.testing.assert_array_equal(part.quaternion, log.quaternion[low:high])
    again = excerpt(part, middle * 5e-4, None)
    np.testing.assert_array_equal(again.quaternion, log.quaternion[middle:high])


def test_the_report_is_of_the_excerpt_and_so_are_unanswered_ticks(log: FlightLog) -> None:
    assert excerpt(log, None, None) is log
    report = analyze(excerpt(log, 0.1, 0.2))
    assert (report["from_s"], report["to_s"], report["ticks"]) == (0.1, 0.2, 200)
    assert report["duration_s"] == 0.1
    assert report["metrics"] != analyze(log)["metrics"]
    other = log.rows(0, 200)
    assert log.commanded_torque is not None
    other.commanded_torque = log.commanded_torque[:200].copy()
    other.commanded_torque[[3, 150, 151]] = np.nan
    other.unanswered = 3
    assert excerpt(other, 0.05, None).unanswered == 2
    assert excerpt(other, None, 0.05).unanswered == 1


FILE = """
import numpy as np
def largest_error(log): return np.abs(log.joint_positions - log.reference_joints[:, 0]).max()
def ticks(log): return log.ticks
"""


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("flight") / "bag"
    Scenario(duration=0.05).fly(folder)
    return folder


@pytest.fixture
def bag(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, recorded: Path) -> Path:
    """In the folder of the file."""
    monkeypatch.chdir(tmp_path)
    Path("mine.py").write_text(FILE, "utf-8")
    return recorded


def run(*arguments: str) -> Result:
    return CliRunner().invoke(cli, ["analyze", *arguments])


def test_it_is_a_number_of_a_flight_and_analyze_shows_it(bag: Path) -> None:
    flight = Scenario(duration=0.05).fly()
    expected = float(np.abs(flight.log.joint_positions - flight.log.reference_joints[:, 0]).max())
    assert flight.metric("mine.py:largest_error") == expected
    assert flight.metric(lambda log: np.int64(log.ticks)) == 100.0
    assert flight.metric(lambda log: np.array(2.5)) == 2.5
    own = ["--metric", "mine.py:largest_error", "--metric", "rows=mine.py:ticks"]
    report = json.loads(run(str(bag), *own, "--json").stdout)
    assert report["metrics"]["rows"] == 100.0
    assert report["metrics"]["largest_error"] == expected
    one = run(str(bag), *own)
    Scenario(duration=0.1).fly("other")
    both = run(str(bag), "other", *own)
    page = render({"one": report}, {"one": load_bag(bag).flight}, [])
    assert all("largest_error" in text for text in (one.stdout, both.stdout, page))
    excerpt = run(str(bag), *own, "--to", "0.01", "--json")
    assert json.loads(excerpt.stdout)["metrics"]["rows"] == 20.0


def outside(log: FlightLog) -> float:
    return float(log.ticks)


def test_functions_that_no_other_process_can_import_are_of_the_session() -> None:
    here = f"{__name__}:outside"
    assert importable_text(outside) == here
    assert metric_function(here) is outside

    def inside(log: FlightLog) -> float:
        return 1.0

    for function in (inside, lambda log: 2.0, functools.partial(call, what="x")):
        text = importable_text(function)
        assert text.startswith(SESSION)
        assert importable_text(function) == text, "once"
        assert metric_function(text) is function
    with pytest.raises(InputError, match="of another Python session"):
        metric_function("session:overshoot#99")


def test_names_and_what_is_no_function() -> None:
    for wrong in (3, None, int, np.zeros(3)):
        with pytest.raises(InputError, match=r"a function or file\.py:FUNCTION was expected"):
            importable_text(wrong)
    assert parse("math:fsum").name == "fsum"
    check_names(["a", "b_2"])
    with pytest.raises(InputError, match=r"attitude\.rms' is no name of a metric"):
        check_names(["attitude.rms"])
    with pytest.raises(InputError, match="no log was kept"):
        Scenario(duration=0.05).fly(keep_log=False).metric(outside)
