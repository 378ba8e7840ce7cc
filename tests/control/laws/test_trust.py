"""Bags of others name modules and files: none is opened unless the user says so."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from bags import redescribed
from command import Run

from space_robot.analysis import analyze
from space_robot.flight.plan import Flight, FlightPlan, resolve
from space_robot.flight.replay.choice import ControllerChoice
from space_robot.flight.simulate import simulate
from space_robot_control.controller.gains import split_gains
from space_robot_control.laws import find_law
from space_robot_control.laws.trust import NotTrustedError, is_plain
from space_robot_msgs_py.bag.reader import read_flight
from space_robot_msgs_py.config.trees import flatten
from space_robot_msgs_py.errors import InputError

MODULE = "law_of_a_stranger"
LAW = f"{MODULE}:Stranger"
CODE = """
from pathlib import Path
from space_robot_control.laws.tde_stc import TimeDelaySuperTwisting
Path(__file__).with_name("was_run").touch()
class Stranger(TimeDelaySuperTwisting):
    name = "stranger"
"""


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("trust") / "bag"
    simulate(Flight(resolve(FlightPlan(duration=0.05))), path)
    return path


@pytest.fixture
def ran(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[[], bool]:
    """Whether the code of the module that the bags name was run."""
    (tmp_path / f"{MODULE}.py").write_text(CODE)
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.chdir(tmp_path)
    monkeypatch.delitem(sys.modules, MODULE, raising=False)
    return (tmp_path / "was_run").exists


def described(**changes: Any) -> dict[str, Any]:
    """A description as of an older bag, whose parameters hold no gains."""
    description = json.loads(json.dumps(Flight(resolve(FlightPlan())).description))
    recorded, _ = split_gains(description["parameters"]["controller"])
    parameters = dict(flatten(recorded)) | changes.pop("controller_node", {})
    description["parameters"]["controller"] = parameters
    return {**description, **changes}


@pytest.mark.parametrize(
    "changes",
    [
        {"controller_node": {"controller": LAW}, "controller": "stranger"},
        {"controller_node": {"swaps": [f"0.01:{LAW}"]}},
        {"parameters": {}, "controller": LAW},
        {"parameters": {"controller": {}}, "controller": LAW},
        {"controller_node": {"controller": "this:X"}},
    ],
)
def test_a_replay_imports_no_module_that_a_bag_names(
    changes: dict[str, Any], tmp_path: Path, ran: Callable[[], bool], bag: Path
) -> None:
    flight = described(**changes)
    flight.pop("gains_used")
    with pytest.raises(NotTrustedError, match="--trust imports a module:Class"):
        ControllerChoice(flight, tmp_path)
    assert not ran()
    assert "this" not in sys.modules


def test_with_trust_it_does_and_the_users_own_word_needs_none(
    tmp_path: Path, ran: Callable[[], bool]
) -> None:
    flight = described(controller_node={"controller": LAW}, controller="stranger")
    trusted, given = (tmp_path / name for name in ("trusted", "given"))
    trusted.mkdir()
    given.mkdir()
    assert ControllerChoice(flight, trusted, trust=True).law_name == "stranger"
    assert ran()
    assert ControllerChoice(flight, given, LAW).law_name == "stranger"
    by_set = ControllerChoice(flight, given, chosen={"controller": "tde_stc"})
    assert by_set.law_name == by_set.parameters["controller"] == "tde_stc"


def test_analyze_imports_none_and_says_so(
    tmp_path: Path, ran: Callable[[], bool], bag: Path
) -> None:
    log = read_flight(bag)
    log.laws = ()  # else their numbers are taken
    log.flight = described(controller=LAW)
    log.flight.pop("gains_used")
    report = analyze(log)
    assert "--trust imports a module:Class" in report["unavailable"]["estimate_error"]
    assert report["rms"]["mean_axis"]["attitude"] >= 0.0
    assert not ran()
    log.trusted = True
    assert "no file for controller 'stranger'" in analyze(log)["unavailable"]["estimate_error"]
    assert ran()


@pytest.mark.parametrize(
    ("key", "figure"), [("robot", "pointing"), ("gains", "estimate_error"), ("case", "saturation")]
)
def test_analyze_reads_no_file_that_a_bag_names(
    bag: Path, tmp_path: Path, key: str, figure: str
) -> None:
    """It would be known from the words about what is in it."""
    secret = tmp_path / "secret.yaml"
    secret.write_text("password: 1234")
    names = {"robot": "paper", "case": "1", "mission": "paper", "gains": "default"}
    log = read_flight(bag)
    log.laws = ()
    log.flight = {"controller": "tde_stc", **names, key: str(secret)}
    why = analyze(log)["unavailable"][figure]
    assert "read only with --trust" in why
    assert "password" not in why
    log.trusted = True
    assert "--trust" not in analyze(log)["unavailable"][figure]


def test_a_replay_reads_no_file_that_a_bag_names(tmp_path: Path) -> None:
    secret = tmp_path / "secret.yaml"
    secret.write_text("password: 1234")
    flight = described(controller_node={"gains": str(secret)})
    assert ControllerChoice(flight, tmp_path).is_as_flown  # the numbers are in the bag
    for key in ("gains_used", "robot_file"):
        lacking = described(controller_node={"gains": str(secret), "robot": str(secret)})
        del lacking[key]
        folder = tmp_path / key
        folder.mkdir()
        with pytest.raises(NotTrustedError, match="read only with --trust"):
            ControllerChoice(lacking, folder)
    lacking = described(controller_node={"actuators": str(secret)})
    (tmp_path / "actuators_named").mkdir()
    with pytest.raises(
        NotTrustedError, match=r"a file as its actuators, .*: read only with --trust"
    ):
        ControllerChoice(lacking, tmp_path / "actuators_named")
    swapped = described(controller_node={"gains": str(secret), "swaps": ["0.1:ctc"]})
    (tmp_path / "swapped").mkdir()
    with pytest.raises(NotTrustedError, match=r"a file as its gains, .*: read only with --trust"):
        ControllerChoice(swapped, tmp_path / "swapped")
    swapped["parameters"]["controller"] |= {"ctc.k_p": [1e4], "ctc.k_d": [2e2]}
    assert ControllerChoice(swapped, tmp_path / "swapped").swaps == ["0.1:ctc"]


def test_on_the_command_line_it_is_one_line_and_an_option(
    bag: Path, tmp_path: Path, ran: Callable[[], bool], space_robot: Run
) -> None:
    import shutil

    copy = shutil.copytree(bag, tmp_path / "bag")
    redescribed(copy, json.dumps(described(controller_node={"controller": LAW})))
    code, _, err = space_robot("replay", copy)
    assert code == 2
    assert "--trust" in err.splitlines()[-1]
    assert space_robot("analyze", copy, "--json").code == 0
    assert not ran()


@pytest.mark.parametrize("name", ["/x.yaml", "a/b", "x.yml", "..", "\x00", "a" * 300])
def test_what_is_no_name_is_a_path(name: str) -> None:
    assert not is_plain(name)


@pytest.mark.parametrize("name", [":", "x:", ":x", ".x:y", "..:y", "\x00:y", "a b:c", "json:X"])
def test_whatever_cannot_be_imported_is_one_line(name: str) -> None:
    with pytest.raises(InputError):
        find_law(name)


def test_a_module_that_breaks_is_one_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "broken_law.py").write_text("1 / 0")
    (tmp_path / "misspelt_law.py").write_text("class X(")
    monkeypatch.syspath_prepend(str(tmp_path))
    with pytest.raises(InputError, match="ZeroDivisionError: division by zero"):
        find_law("broken_law:X")
    with pytest.raises(InputError, match="SyntaxError"):
        find_law("misspelt_law:X")
