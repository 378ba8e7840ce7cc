"""Laws of one's own: found by module or file on the user's word, never on a bag's; mistakes."""

from __future__ import annotations

import json
import shutil
import signal
import sys
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pytest
from bags import redescribed
from command import Run

from space_robot.analysis import analyze
from space_robot.campaign.flown.manifest import file_digests
from space_robot.flight.plan import Flight, Scenario, resolve
from space_robot.flight.replay.choice import ControllerChoice
from space_robot.flight.simulate import simulate
from space_robot.processes.interruption import Interrupted
from space_robot.scenario.node_settings import option_parameters
from space_robot_control.laws import ControlLaw, LawGains, find_law, importable_name
from space_robot_control.laws.base import LawError, force_of
from space_robot_control.laws.names import NotTrustedError, is_plain
from space_robot_msgs_py.bag.reader import read_flight
from space_robot_msgs_py.errors import InputError


class Law(ControlLaw):
    name: ClassVar[str] = "mine"
    gains_type: ClassVar[type[LawGains]] = LawGains
    what: Callable[[], Any]

    def force(self, signals: Any) -> Any:
        return self.what()


def raise_it(error: BaseException) -> Any:
    raise error


def outcome(what: Callable[[], Any]) -> str:
    law = Law({}, 0.001, 9)
    law.what = what
    with pytest.raises(LawError) as raised:
        force_of(law, None, 7)  # type: ignore[arg-type]
    text = str(raised.value)
    assert text.startswith("controller mine failed at tick 7: ")
    assert "\n" not in text
    return text


def again() -> Any:
    return again()


@pytest.mark.parametrize(
    ("what", "said"),
    [
        (lambda: 1 / 0, "ZeroDivisionError: division by zero (test_own_laws.py, line "),
        (lambda: sys.exit("no\nfuel"), "SystemExit: no fuel (test_own_laws.py, line "),
        (lambda: raise_it(MemoryError()), "MemoryError (test_own_laws.py, line "),
        (lambda: raise_it(GeneratorExit()), "GeneratorExit (test_own_laws.py, line "),
        (again, "RecursionError"),
        (lambda: "abc", "an array of float64, got 'abc'"),
        (lambda: None, "got None"),
        (lambda: np.zeros(4), "force() must return 9 numbers, an array of float64, got shape (4,)"),
        (lambda: np.zeros((9, 1)), "got shape (9, 1)"),
        (lambda: np.zeros(9, np.float32), "got shape (9,), float32"),
    ],
)
def test_a_mistake_is_one_line(what: Callable[[], Any], said: str) -> None:
    assert said in outcome(what)


def test_ctrl_c_is_the_users_and_no_mistake_of_the_law() -> None:
    law = Law({}, 0.001, 9)
    law.what = lambda: raise_it(KeyboardInterrupt())
    with pytest.raises(KeyboardInterrupt):  # by Python's own handler
        force_of(law, None, 7)  # type: ignore[arg-type]
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)  # as in workers and commands
    try:
        assert "KeyboardInterrupt" in outcome(law.what)
        law.what = lambda: raise_it(Interrupted(signal.SIGTERM))
        with pytest.raises(Interrupted):
            force_of(law, None, 7)  # type: ignore[arg-type]
    finally:
        signal.signal(signal.SIGINT, before)


def test_clear_errors_and_forces_pass_as_they_are() -> None:
    law, force = Law({}, 0.001, 9), np.arange(9.0)
    law.what = lambda: raise_it(InputError("clear"))
    with pytest.raises(InputError, match=r"^clear$"):
        force_of(law, None, 7)  # type: ignore[arg-type]
    law.what = lambda: force
    assert force_of(law, None, 7) is force  # type: ignore[arg-type]


# Found by module or file


CODE = """
from pathlib import Path
from space_robot_control.laws.tde_stc import TimeDelaySuperTwisting as Base
Path(__file__).with_name("was_run").touch()
class Mine(Base):
    name = "{name}"
"""


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The current folder: a law's file is in it, and one of the same name in ``other``."""
    for place in (tmp_path, tmp_path / "other"):
        place.mkdir(exist_ok=True)
        (place / "my_law.py").write_text(CODE.format(name=place.name.replace("-", "_")))
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", [path for path in sys.path if path])
    return tmp_path


@pytest.mark.parametrize("path", ["my_law.py", "./my_law.py", "{}/my_law.py", "../{}/my_law.py"])
def test_a_file_is_a_law_by_any_path_to_it(folder: Path, path: str) -> None:
    name = path.format(str(folder) if path.startswith("{}") else folder.name)
    law = find_law(f"{name}:Mine")
    assert (law.name, law) == (folder.name.replace("-", "_"), find_law("my_law.py:Mine"))


def test_files_of_one_name_in_two_folders_are_two_laws(folder: Path) -> None:
    one, two = find_law("my_law.py:Mine"), find_law("other/my_law.py:Mine")
    assert one is not two
    assert two.name == "other"
    assert importable_name(one) == "my_law.py:Mine", "another process imports it by its path"
    assert importable_name(two) == "other/my_law.py:Mine"
    for law in (one, two):
        assert find_law(importable_name(law)) is law, "what nodes and bags say finds it again"
        controller = option_parameters(Scenario(controller=law))["controller"]
        assert controller["controller"] == importable_name(law)


def test_a_file_that_fails_can_be_mended(folder: Path) -> None:
    (folder / "bad.py").write_text("raise RuntimeError('half\\nmade')")
    with pytest.raises(InputError, match=r"bad\.py:X.*RuntimeError: half made"):
        find_law("bad.py:X")
    (folder / "bad.py").write_text(CODE.format(name="mended").replace("Mine", "X"))
    assert find_law("bad.py:X").name == "mended"


def test_a_campaign_keeps_the_digest_of_a_laws_file(folder: Path) -> None:
    before = file_digests({"laws": ["ctc", "./my_law.py:Mine=gains/"]})
    (folder / "my_law.py").write_text("")
    assert list(before) == ["my_law.py"]
    assert file_digests({"laws": ["./my_law.py:Mine"]}) != before


# Named by a bag


MODULE = "law_of_a_stranger"
LAW = f"{MODULE}:Stranger"
STRANGER = CODE.format(name="stranger").replace("Mine", "Stranger")


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("trust") / "bag"
    simulate(Flight(resolve(Scenario(duration=0.05))), path)
    return path


@pytest.fixture
def ran(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[[], bool]:
    """Whether the code of the module that the bags name was run."""
    (tmp_path / f"{MODULE}.py").write_text(STRANGER)
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.chdir(tmp_path)
    monkeypatch.delitem(sys.modules, MODULE, raising=False)
    return (tmp_path / "was_run").exists


def described(flown: str = "tde_stc", **scenario: Any) -> dict[str, Any]:
    """A description whose scenario has other options; of a law by the name that it has itself."""
    description = json.loads(json.dumps(Flight(resolve(Scenario())).description))
    description["scenario"] |= scenario
    return {**description, "controller": flown}


IMPORTS = "--trust imports a module:Class"
READS = "read only with --trust"


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"controller": LAW}, IMPORTS),
        ({"controller": "this:X"}, IMPORTS),
        ({"swaps": [f"0.01:{LAW}"]}, IMPORTS),
        ({"gains": "./secret.yaml"}, READS),
        ({"actuators": "./secret.yaml"}, READS),
        ({"assumed_actuators": "./secret.yaml"}, READS),
        ({"parameters": {"controller": {"robot": "secret.yaml"}}}, READS),
        ({"parameters": {"controller": {"navigation_sensors": "secret.yaml"}}}, READS),
    ],
)
def test_a_replay_imports_no_module_and_reads_no_file_that_a_bag_names(
    options: dict[str, Any], said: str, tmp_path: Path, ran: Callable[[], bool]
) -> None:
    (tmp_path / "secret.yaml").write_text("password: 1234")
    flight = described(**options)
    with pytest.raises(NotTrustedError, match=said):
        ControllerChoice(flight)
    assert not ran()
    assert "this" not in sys.modules


@pytest.mark.parametrize(
    "options",
    [
        {"gains": {LAW: {"k": [1.0]}}},
        {"parameters": {"controller": {LAW: {"k": [1.0]}, "controller": LAW}}},
    ],
)
def test_gains_of_a_law_that_is_not_flown_import_nothing(
    options: dict[str, Any], ran: Callable[[], bool]
) -> None:
    flight = described(**options)
    with suppress(InputError):
        assert ControllerChoice(flight).law_name == "tde_stc"
    assert not ran()


def test_with_trust_it_does_and_the_users_own_word_needs_none(ran: Callable[[], bool]) -> None:
    flight = described("stranger", controller=LAW)
    gains = flight["scenario"]["gains"]
    gains["stranger"] = gains["tde_stc"]
    assert ControllerChoice(flight, trust=True).law_name == "stranger"
    assert ran()
    assert ControllerChoice(flight, LAW).law_name == "stranger"
    by_set = ControllerChoice(flight, chosen={"controller": "tde_stc"})
    assert by_set.law_name == by_set.settings.controller == "tde_stc"


@pytest.mark.parametrize(("key", "figure"), [("robot", "end_effector"), ("case", "saturation")])
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


@pytest.mark.parametrize(
    "mission", [{"segments": ["{file: secret.csv}"]}, {"events": ["capture@1:secret.yaml"]}]
)
def test_analyze_reads_no_file_of_a_mission(bag: Path, mission: dict[str, Any]) -> None:
    log = read_flight(bag)
    log.flight["scenario"]["mission"] |= mission
    assert "read only with --trust" in analyze(log)["unavailable"]["end_effector"]


def test_gains_of_a_swap_must_be_in_the_bag() -> None:
    flight = described(swaps=["0.1:ctc"])
    gains = flight["scenario"]["gains"].pop("ctc")
    with pytest.raises(InputError, match="unknown controller 'ctc' of swaps"):
        ControllerChoice(flight)
    flight["scenario"]["gains"]["ctc"] = gains
    assert ControllerChoice(flight).swaps == ["0.1:ctc"]


def test_on_the_command_line_it_is_one_line_and_an_option(
    bag: Path, tmp_path: Path, ran: Callable[[], bool], space_robot: Run
) -> None:
    copy = shutil.copytree(bag, tmp_path / "bag")
    redescribed(copy, json.dumps(described("stranger", controller=LAW)))
    code, _, err = space_robot("replay", copy)
    assert code == 2
    assert "--trust" in err.splitlines()[-1]
    assert space_robot("analyze", copy, "--json").code == 0
    assert not ran()


@pytest.mark.parametrize("name", ["/x.yaml", "a/b", "x.yml", "..", "\x00", "a" * 300])
def test_what_is_no_name_is_a_path(name: str) -> None:
    assert not is_plain(name)
