"""CSV and Parquet: the numbers of the flight, whole files or none."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest
from pyarrow import csv, parquet

from space_robot.analysis import excerpt, tracking_error
from space_robot.analysis.columns import BATCH, batches, column_names
from space_robot.analysis.export import METADATA_KEY, dataframe, write_csv, write_parquet
from space_robot.console.files import whole_file
from space_robot.flight.plan import Flight, FlightPlan, resolve
from space_robot.flight.simulate import simulate
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.errors import InputError
from space_robot_msgs_py.samples import Timebase


@pytest.fixture(scope="module")
def log() -> FlightLog:
    log = simulate(Flight(resolve(FlightPlan(duration=0.1, case="2"))))
    log.latency_s = np.full(200, 1e-4)
    log.latency_s[3] = np.nan
    return log


def column(table: pa.Table, name: str) -> np.ndarray:
    return table[name].to_numpy()


def assert_same(table: pa.Table, log: FlightLog) -> None:
    assert table.num_rows == log.ticks
    np.testing.assert_allclose(column(table, "time_s"), column(table, "tick") * 5e-4, rtol=1e-12)
    assert log.commanded_torque is not None
    error = tracking_error(log)
    for name, expected in {
        "q_w": log.quaternion[:, 0],
        "omega_base_x_rad_s": log.omega_base[:, 0],
        "base_position_z_m": log.base_position[:, 2],
        "base_velocity_y_m_s": log.base_velocity[:, 1],
        "joint1_position_rad": log.joint_positions[:, 0],
        "joint6_velocity_rad_s": log.joint_velocities[:, 5],
        "applied_torque_base_y_n_m": log.applied_torque[:, 1],
        "applied_torque_joint6_n_m": log.applied_torque[:, 8],
        "commanded_torque_joint2_n_m": log.commanded_torque[:, 4],
        "reference_q_w": log.reference_base[:, 0],
        "reference_omega_base_z_rad_s": log.reference_base[:, 6],
        "reference_omega_base_rate_x_rad_s2": log.reference_base[:, 7],
        "reference_joint1_position_rad": log.reference_joints[:, 0, 0],
        "reference_joint3_velocity_rad_s": log.reference_joints[:, 1, 2],
        "reference_joint6_acceleration_rad_s2": log.reference_joints[:, 2, 5],
        "error_q_z": error[:, 2],
        "error_joint4_rad": error[:, 6],
    }.items():
        np.testing.assert_array_equal(column(table, name), expected, err_msg=name)
    latency = table["latency_s"]
    assert latency.null_count == int(np.isnan(log.latency_s).sum())  # type: ignore[arg-type]


def test_csv_has_every_bit(log: FlightLog, tmp_path: Path) -> None:
    write_csv(log, tmp_path / "flight.csv")
    assert_same(csv.read_csv(tmp_path / "flight.csv"), log)


def test_parquet_has_every_bit_and_what_was_flown(log: FlightLog, tmp_path: Path) -> None:
    write_parquet(log, tmp_path / "flight.parquet")
    table = parquet.read_table(tmp_path / "flight.parquet")
    assert_same(table, log)
    about = json.loads(table.schema.metadata[METADATA_KEY])
    assert about["flight"] == json.loads(json.dumps(log.flight))
    assert about["lost"] == log.lost


def test_without_pyarrow_there_is_csv_and_one_line_on_parquet(
    log: FlightLog, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("space_robot.analysis.export.find_spec", lambda name: None)
    with pytest.raises(InputError, match=r"pip install 'pyarrow>=\d"):
        write_parquet(log, tmp_path / "flight.parquet")
    write_csv(log, tmp_path / "flight.csv")
    assert [path.name for path in tmp_path.iterdir()] == ["flight.csv"]


def test_an_excerpt_keeps_its_time(log: FlightLog, tmp_path: Path) -> None:
    write_csv(excerpt(log, 0.05, None), tmp_path / "part.csv")
    table = csv.read_csv(tmp_path / "part.csv")
    assert (column(table, "tick")[0], column(table, "time_s")[0]) == (100, 0.05)
    assert table.num_rows == 100


def test_every_column_has_one_name_and_what_is_not_known_has_none() -> None:
    log = FlightLog.allocate(BATCH + 5, ("a", "b"), Timebase(500_000))
    names = column_names(log)
    assert len(set(names)) == len(names)
    assert not any(name.startswith(("commanded", "latency")) for name in names)
    sizes = [len(ticks) for ticks, _ in batches(log)]
    assert sizes == [BATCH, 5]


def test_nothing_is_overwritten(log: FlightLog, tmp_path: Path) -> None:
    path = tmp_path / "flight.csv"
    path.write_text("mine")
    with pytest.raises(InputError, match=r"flight\.csv: exists already"):
        write_csv(log, path)
    assert path.read_text() == "mine"
    assert list(tmp_path.iterdir()) == [path]


def test_a_file_begun_and_not_ended_leaves_nothing(tmp_path: Path) -> None:
    def fail() -> None:
        with whole_file(tmp_path / "x") as file:
            file.write(b"half")
            raise RuntimeError

    with pytest.raises(RuntimeError):
        fail()
    assert list(tmp_path.iterdir()) == []


def test_nor_is_one_that_came_meanwhile_overwritten(tmp_path: Path) -> None:
    def race() -> None:
        with whole_file(tmp_path / "x") as file:
            file.write(b"ours")
            (tmp_path / "x").write_text("theirs")

    with pytest.raises(InputError, match="exists already"):
        race()
    assert (tmp_path / "x").read_text() == "theirs"
    assert [path.name for path in tmp_path.iterdir()] == ["x"]


def test_a_folder_that_cannot_be_is_named(log: FlightLog, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="the folder cannot be created"):
        write_parquet(log, tmp_path / "file" / "flight.parquet")


def test_every_actuator_has_its_columns(tmp_path: Path) -> None:
    log = FlightLog.allocate(3, ("a",), Timebase(500_000), wheels=2, thrusters=1, torquers=3)
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
        np.testing.assert_array_equal(column(table, name), expected, err_msg=name)
    assert not any("wheel_velocity_3" in name for name in table.column_names)


def test_a_table_of_pandas_has_the_columns_of_the_files(log: FlightLog, tmp_path: Path) -> None:
    """Of a part of a flight, too, whose first tick is not 0."""
    for part in (log, log.rows(50, 80)):
        table = dataframe(part)
        assert_same(pa.Table.from_pandas(table), part)
        assert [*table.columns] == column_names(part)
        assert table["tick"].dtype == np.int64
        assert [*table["tick"]] == [*range(part.first_tick, part.first_tick + part.ticks)]
