"""A user's own disturbance: its columns, and when they act, against NumPy's interpolation."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from space_robot_msgs_py.errors import InputError
from space_robot_sim.environment.disturbance import DisturbanceSettings
from space_robot_sim.environment.disturbance_table import DisturbanceTable, table_text
from space_robot_sim.environment.load_schedule import LoadSchedule
from space_robot_sim.environment.prescribed_loads import PrescribedLoads, add_loads, begin_loads

Array = NDArray[np.float64]
PERIOD = 0.0005
JOINTS = ("shoulder", "elbow")


def schedule(columns: dict[str, Any], scale: float = 1.0) -> LoadSchedule:
    table = DisturbanceTable.of(columns, "here")
    return LoadSchedule.of(DisturbanceSettings(table=table.text, table_scale=scale), JOINTS, PERIOD)


def test_text_and_file_have_the_same_numbers(tmp_path: Path) -> None:
    columns = {"time": [0.0, 0.1, 1 / 3], "base_force_x": [1e-300, -0.1, 7.0]}
    rows = zip(*columns.values(), strict=True)
    lines = [",".join(columns), *(",".join(map(repr, row)) for row in rows)]
    (tmp_path / "wind.csv").write_text("\n".join(lines))
    table = DisturbanceTable.of(columns, "here")
    assert table_text("wind.csv", tmp_path) == table.text == table_text(table.text)
    assert DisturbanceTable.parse(table.text) == table
    assert table.label == "base_force_x from 0 to 0.333333 s"
    parquet = pytest.importorskip("pyarrow.parquet")
    import pyarrow

    parquet.write_table(pyarrow.table(columns), tmp_path / "wind.parquet")
    assert table_text("wind.parquet", tmp_path) == table.text


@pytest.mark.parametrize(
    ("columns", "said"),
    [
        ({"t": [0, 1], "elbow": [1, 1]}, "here: column 'time' is missing; there are t, elbow"),
        ({"time": [0, 1]}, "'time' alone: columns are base_force_x"),
        ({"time": [0, 0], "elbow": [1, 1]}, "time must rise, got 0 s after 0 s"),
        ({"time": [-1, 0], "elbow": [1, 1]}, "time must begin at 0 s or later, got -1 s"),
        ({"time": [0], "elbow": [1]}, "at least 2 rows are needed, got 1"),
        ({"time": [0, 1], "elbow": [1]}, "elbow: 2 values were expected, as many as times, got 1"),
        (
            {"time": [0, 1], "elbow": [1, float("nan")]},
            "elbow: row 2: a number of at most 1e+12 was",
        ),
        ({"time": [0, 1], "elbow": [1, None]}, "elbow: row 2: a number of at most 1e+12 was"),
        ({"time": [0, 1], "elbow": [1, 1e308]}, "at most 1e+12 was expected, got 1e+308"),
        ({"time": [0, 1], "elbow": 3.0}, "elbow: a list of numbers was expected, got 3.0"),
        (
            {"time": list(range(25_001)), "elbow": [0.0] * 25_001},
            "25001 rows of 2 columns are 50002 values, at most 50000 are allowed",
        ),
    ],
)
def test_what_is_wrong_is_named(columns: dict[str, Any], said: str) -> None:
    with pytest.raises(InputError) as refused:
        DisturbanceTable.of(columns, "here")
    assert said in str(refused.value)
    assert "\n" not in str(refused.value)


def test_an_unknown_column_is_named_with_those_there_are() -> None:
    with pytest.raises(InputError, match="unknown column 'elbw': choose one of base_force_x"):
        schedule({"time": [0, 1], "elbw": [1, 1]})


def test_a_table_between_two_ticks_is_refused() -> None:
    with pytest.raises(InputError, match=r"no tick of 0.0005 s is within 0.0001 to 0.0002 s"):
        schedule({"time": [0.0001, 0.0002], "elbow": [1, 1]})


@pytest.mark.parametrize("name", ["wind", "wind.txt", "no_such.csv"])
def test_no_file_no_table(name: str) -> None:
    with pytest.raises(InputError, match=f"{name}"):
        table_text(name)


rows = st.lists(st.integers(0, 400), min_size=2, max_size=90, unique=True).map(sorted)


@given(rows, st.integers(0, 2**32 - 1))
@settings(max_examples=40, deadline=None)
def test_rows_on_ticks_fly_exactly(ticks: list[int], seed: int) -> None:
    """Linear between rows, zero before and after; the impulse is the table's integral."""
    rng = np.random.default_rng(seed)
    values = rng.normal(size=(len(ticks), 2))
    time = np.array(ticks) * PERIOD
    columns = {"time": time.tolist(), "base_torque_y": values[:, 0], "elbow": values[:, 1]}
    own = schedule({k: np.asarray(v).tolist() for k, v in columns.items()}, scale=3.0)
    begin, end = own.over(np.arange(450))
    inside = np.arange(ticks[0], ticks[-1])
    for place, of_rows in ((4, values[:, 0]), (7, values[:, 1])):
        expected = 3.0 * np.interp(inside, ticks, of_rows)
        np.testing.assert_allclose(begin[inside, place], expected, rtol=0.0, atol=1e-12)
        outside = np.delete(np.arange(450), inside)
        assert not begin[outside, place].any()
        assert not end[outside, place].any()
        impulse = 0.5 * PERIOD * np.sum(begin[:, place] + end[:, place])
        assert impulse == pytest.approx(3.0 * np.trapezoid(of_rows, time), abs=1e-12)
    assert not np.delete(begin, (4, 7), axis=1).any()


@given(
    st.lists(st.floats(0.0, 0.25, width=32), min_size=2, max_size=200, unique=True).map(sorted),
    st.integers(0, 2**32 - 1),
)
@settings(max_examples=40, deadline=None)
def test_the_record_has_what_the_schedule_says(times: list[float], seed: int) -> None:
    """Tick by tick, begun anywhere, through all parts that the record holds at a time."""
    rng = np.random.default_rng(seed)
    columns = {"time": times, "base_force_z": rng.normal(size=len(times)).tolist()}
    try:
        own = schedule(columns)
    except InputError:  # all between two ticks
        return
    ticks = np.arange(int(rng.integers(0, 300)), 520)
    begin, end = own.over(ticks)
    record, given = PrescribedLoads.allocate(len(JOINTS)), rng.normal(size=6)
    due = own.apply(int(ticks[0]), record)
    for tick, first, last in zip(ticks.tolist(), begin, end, strict=True):
        if tick >= due:
            assert tick == due
            due = own.apply(tick, record)
        begin_loads(record, tick, PERIOD, given)
        for time, expected in ((tick * PERIOD, first), ((tick + 1) * PERIOD, last)):
            wrench, disturbance = np.full(6, np.nan), np.ones(5)
            add_loads(record, time, wrench, disturbance)
            np.testing.assert_allclose(wrench, given + expected[:6], rtol=0.0, atol=1e-9)
            np.testing.assert_allclose(disturbance[3:], 1.0 - expected[6:], rtol=0.0, atol=1e-9)
            assert (disturbance[:3] == 1.0).all()


def test_a_text_that_is_nested_too_deeply_is_refused() -> None:
    with pytest.raises(InputError, match=r"not a table as JSON \(nested too deeply\)"):
        DisturbanceTable.parse('{"a":' * 20_000)
