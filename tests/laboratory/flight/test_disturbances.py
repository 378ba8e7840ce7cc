"""A disturbance of the user's own: one from file, numbers and function."""

from __future__ import annotations

import csv
import json
import math
import pickle
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from command import Run

import space_robot as sr
from space_robot.scenario.comparison import recorded_scenario
from space_robot_msgs_py.errors import InputError

DURATION = 0.3


def wind(t: float) -> dict[str, float]:
    return {
        "base_force_y": 3.0 * math.sin(20.0 * t),
        "base_torque_z": 0.4 * math.cos(9.0 * t),
        "joint2": 0.3 * t,
    }


def columns() -> dict[str, Any]:
    return sr.sampled(wind, DURATION)


def write(path: Path, table: dict[str, Sequence[float]]) -> str:
    with path.open("w", newline="") as file:
        csv.writer(file).writerows([[*table], *zip(*table.values(), strict=True)])
    return str(path)


def test_file_function_and_numbers_are_one_disturbance(tmp_path: Path) -> None:
    """Also as a mapping and in a bag, without the file that it was read from."""
    file = Path(write(tmp_path / "wind.csv", columns()))
    given = [file, wind, lambda t: wind(t), {k: np.array(v) for k, v in columns().items()}]
    expected = sr.Scenario(disturbance=columns(), duration=DURATION)
    for disturbance in given:
        scenario = sr.Scenario(disturbance=disturbance, duration=DURATION)
        assert scenario.resolved() == expected.resolved()
    log = sr.Scenario(disturbance=file, duration=DURATION).fly(bag=tmp_path / "bag").log
    file.unlink()
    again = sr.Scenario(**yaml.safe_load(yaml.safe_dump(expected.resolved()))).fly().log
    for name, column in log.columns.items():
        np.testing.assert_array_equal(again.columns[name], column, name)
    assert recorded_scenario(tmp_path / "bag")["disturbance"] == columns()
    said = "base_force_y, base_torque_z, joint2 from 0 to 0.3 s"
    assert sr.load_bag(tmp_path / "bag").flight["disturbance"] == said
    undisturbed = sr.Scenario(duration=DURATION)
    assert "disturbance" not in undisturbed.resolved()
    assert np.abs(undisturbed.fly().log.applied_torque - log.applied_torque).max() > 0.1


def test_the_command_says_under_what_it_flew(tmp_path: Path, space_robot: Run) -> None:
    file = write(tmp_path / "wind.csv", columns())
    said = "base_force_y, base_torque_z, joint2 from 0 to 0.3 s"
    options = ("--disturbance", file, "--duration", "0.1")
    assert said in space_robot("simulate", *options).out
    assert json.loads(space_robot("simulate", *options, "--json").out)["disturbance"] == said
    ran = space_robot("simulate", "--disturbance", "no_such.csv")
    assert (ran.code, ran.err.strip().count("\n")) == (2, 0)
    assert "no_such.csv: no such file" in ran.err


def test_a_case_may_name_a_table_beside_it(tmp_path: Path) -> None:
    write(tmp_path / "wind.csv", columns())
    case = {"/**/plant_node": {"ros__parameters": {"disturbance": {"table": "wind.csv"}}}}
    (tmp_path / "windy.yaml").write_text(yaml.safe_dump(case))
    scenario = sr.Scenario(case=tmp_path / "windy.yaml", duration=DURATION)
    assert scenario.resolved()["disturbance"] == columns()
    other = {"time": [0.0, 1.0], "joint1": [1.0, 1.0]}
    assert scenario.replace(disturbance=other).resolved()["disturbance"] == other


def test_campaigns_vary_its_scale(tmp_path: Path) -> None:
    """The rows of a function are those of its numbers."""
    tables = []
    for number, disturbance in enumerate((wind, columns())):
        study = {
            "laws": ["ctc"],
            "scenario": {"disturbance": disturbance, "duration": 0.1},
            "vary": {"plant.disturbance.table_scale": {"uniform": [0.5, 2.0]}},
            "runs": 3,
        }
        flown = sr.Campaign.of(study).run(out=tmp_path / str(number), workers=0)
        assert list(flown.table["outcome"]) == ["complete"] * 3
        tables.append(flown.table)
    assert tables[0].equals(tables[1])
    assert len(set(tables[0].iloc[:, -1])) == 3


@pytest.mark.parametrize(
    ("disturbance", "said"),
    [
        (3.0, "disturbance: a CSV or Parquet file, columns .* or a function was expected, got 3.0"),
        ("wind", "disturbance 'wind': a .csv or .parquet file was expected"),
        ({"time": [0, 1], "joint9": [1, 1]}, "disturbance: unknown column 'joint9': choose one of"),
        (lambda t: None, "the function returned None at 0 s; a mapping of numbers by column"),
        (lambda t: [t], "the function returned 1 numbers at 0 s; a mapping or 6 were expected"),
        (lambda t: {"joint1": math.nan}, "the function returned nan for joint1 at 0 s"),
    ],
)
def test_what_is_wrong_is_said_in_a_line(disturbance: Any, said: str) -> None:
    with pytest.raises(InputError, match=said) as refused:
        sr.Scenario(disturbance=disturbance, duration=0.1).check()
    assert "\n" not in str(refused.value)


def test_a_wrong_column_is_named_with_its_file_or_the_option(tmp_path: Path) -> None:
    file, good = tmp_path / "wind.csv", {"time": [0, 1], "joint1": [1, 1]}
    file.write_text("time,joint9\n0,1\n1,1\n")
    text = '{"time":[0,1],"joint9":[1,1]}'
    for where, words in (
        (file, {"disturbance": str(file)}),
        (file, {"disturbance": good, **plant({"disturbance.table": str(file)})}),
        (file, {"disturbance": good, **plant({"disturbance": {"table": str(file)}})}),
        ("disturbance", {"disturbance": text}),
        ("disturbance", plant({"disturbance.table": text})),
        ("disturbance", {"disturbance": "wind.csv", **plant({"disturbance.table": text})}),
    ):
        with pytest.raises(InputError, match=f"^{where}: unknown column 'joint9': choose one of "):
            sr.Scenario(duration=0.1, **words).check()


def plant(parameters: dict[str, Any]) -> dict[str, Any]:
    return {"parameters": {"plant": parameters}}


def test_a_function_is_sampled() -> None:
    columns = sr.sampled(lambda t: np.arange(6.0) * t, 0.02, period=0.01)
    assert columns["time"] == [0.0, 0.01, 0.02]
    assert columns["base_torque_z"] == [0.0, 0.05, 0.1]
    scenario = sr.Scenario(disturbance=lambda t: {"joint1": t}, duration=0.1)
    flight = pickle.loads(pickle.dumps(scenario.check().scenario))
    assert flight.tree == scenario.resolved()
    for words in ({"duration": 0.0}, {"duration": 1.0, "period": -1.0}):
        with pytest.raises(InputError, match="a number above 0 was expected"):
            sr.sampled(wind, **words)
