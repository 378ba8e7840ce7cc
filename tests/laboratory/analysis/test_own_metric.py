"""A user's own metric: by name and as a function, its value, and what is said of a wrong one."""

from __future__ import annotations

import functools
import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner, Result

from space_robot import Scenario, load_bag
from space_robot.analysis.own_metric import SESSION, call, check_names, function_of, parse, text_of
from space_robot.analysis.page import render
from space_robot.cli.main import cli
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.errors import InputError

FILE = """
import numpy as np
def largest_error(log): return np.abs(log.joint_positions - log.reference_joints[:, 0]).max()
def ticks(log): return log.ticks
def raises(log): return 1 / (log.ticks - log.ticks)
def nan(log): return float("nan")
def array(log): return np.zeros(3)
def text(log): return "3"
def leaves(log): raise SystemExit("away")
NUMBER = 3
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


def analyze(*arguments: str) -> Result:
    return CliRunner().invoke(cli, ["analyze", *arguments])


def test_it_is_a_number_of_a_flight_and_analyze_shows_it(bag: Path) -> None:
    flight = Scenario(duration=0.05).fly()
    expected = float(np.abs(flight.log.joint_positions - flight.log.reference_joints[:, 0]).max())
    assert flight.metric("mine.py:largest_error") == expected
    assert flight.metric(lambda log: np.int64(log.ticks)) == 100.0
    assert flight.metric(lambda log: np.array(2.5)) == 2.5
    own = ["--metric", "mine.py:largest_error", "--metric", "rows=mine.py:ticks"]
    report = json.loads(analyze(str(bag), *own, "--json").stdout)
    assert report["own_metrics"]["rows"] == 100.0
    assert report["own_metrics"]["largest_error"] == expected
    one = analyze(str(bag), *own)
    Scenario(duration=0.1).fly("other")
    both = analyze(str(bag), "other", *own)
    assert "own metric" in both.stdout
    assert "rows" in both.stdout
    page = render({"one": report}, {"one": load_bag(bag).flight}, [])
    assert all("largest_error" in text for text in (one.stdout, both.stdout, page))
    excerpt = analyze(str(bag), *own, "--to", "0.01", "--json")
    assert json.loads(excerpt.stdout)["own_metrics"]["rows"] == 20.0
    assert "own_metrics" not in json.loads(analyze(str(bag), "--json").stdout)


@pytest.mark.parametrize(
    ("metric", "why"),
    [
        ("mine.py:raises", "failed: ZeroDivisionError: division by zero (mine.py, line 5)"),
        ("mine.py:leaves", "metric leaves failed: SystemExit: away (mine.py, line 9)"),
        ("mine.py:nan", "metric nan: the function must return a finite number, got nan"),
        ("mine.py:array", "metric array: the function must return one number, got an array of"),
        ("mine.py:text", "metric text: the function must return one number, got '3'"),
        ("mine.py:tick", "metric 'mine.py:tick': unknown function 'tick' of mine.py"),
        ("mine.py:NUMBER", "metric 'mine.py:NUMBER' is no function"),
        ("mine.py", "metric 'mine.py': name the function as well, mine.py:FUNCTION"),
        ("none.py:x", "none.py: no such file (did you mean mine.py?) (paths are from the current"),
        ("mine:ticks", "the current folder is not searched for modules: name the file, mine.py:"),
        ("no_such:x", "modules are searched for on PYTHONPATH; a file is named by its path"),
        ("ticks", "metric 'ticks': a metric is named as file.py:FUNCTION or module:FUNCTION"),
        ("a b=mine.py:ticks", "'a b' is no name of a metric"),
        ("mine.py:ticks & ticks=mine.py:nan", "ticks is the name of two: name one as OTHER="),
    ],
)
def test_a_wrong_one_is_one_line(metric: str, why: str, bag: Path) -> None:
    words = [word for name in metric.split(" & ") for word in ("--metric", name)]
    result = analyze(str(bag), *words)
    assert isinstance(result.exception, InputError), result.output
    assert result.exception.exit_code == 2
    assert why in str(result.exception)
    assert "\n" not in str(result.exception)


def outside(log: FlightLog) -> float:
    return float(log.ticks)


def test_functions_that_no_other_process_can_import_are_of_the_session() -> None:
    here = f"{__name__}:outside"
    assert text_of(outside) == here
    assert function_of(here) is outside

    def inside(log: FlightLog) -> float:
        return 1.0

    for function in (inside, lambda log: 2.0, functools.partial(call, what="x")):
        text = text_of(function)
        assert text.startswith(SESSION)
        assert text_of(function) == text, "once"
        assert function_of(text) is function
    with pytest.raises(InputError, match="of another Python session"):
        function_of("session:overshoot#99")


def test_names_and_what_is_no_function() -> None:
    for wrong in (3, None, int, np.zeros(3)):
        with pytest.raises(InputError, match=r"a function or file\.py:FUNCTION was expected"):
            text_of(wrong)
    assert parse("math:fsum").name == "fsum"
    check_names(["a", "b_2"])
    with pytest.raises(InputError, match="attitude_rms is the name of a metric that every flight"):
        check_names(["attitude_rms"], ["attitude_rms"])
    with pytest.raises(InputError, match="no log was kept"):
        Scenario(duration=0.05).fly(keep_log=False).metric(outside)
