"""``--set`` and ``--scenario``: what is given is flown as given, or refused in one line."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner, Result
from hypothesis import given
from hypothesis import strategies as st

from space_robot.cli import main as cli
from space_robot.flight.plan import Flight, FlightPlan, resolve
from space_robot_msgs_py.config.validation import validate
from space_robot_msgs_py.errors import InputError


@pytest.fixture
def planned(monkeypatch: pytest.MonkeyPatch) -> list[FlightPlan]:
    """The plans that commands make, which are then not flown."""
    plans: list[FlightPlan] = []

    def plan(**options: Any) -> Any:
        plans.append(validate(FlightPlan, options, "options"))
        raise InputError("not to be flown")

    monkeypatch.setattr("space_robot.cli.simulate.plan_flight", plan)
    return plans


def simulate(*arguments: str) -> Result:
    return CliRunner().invoke(cli.cli, ["simulate", *arguments])


def said_by(*arguments: str) -> str:
    """The one line with which a command refuses them."""
    result = simulate(*arguments)
    assert isinstance(result.exception, InputError), result.exception
    return str(result.exception)


def test_parameters_of_a_scenario_and_those_given(
    planned: list[FlightPlan], tmp_path: Path
) -> None:
    """Both count, and those given here come over the scenario's."""
    path = tmp_path / "scenario.yaml"
    path.write_text(
        "case: 2\nduration: 3\nswaps: ['1:ctc']\nfriction: false\n"
        "parameters: {plant: {friction: {coulomb: 0.5}, hold_ticks: 30}}\n"
    )
    said_by("--scenario", str(path), "--set", "plant.hold_ticks=40", "--case", "3")
    said_by("--scenario", str(path))
    first, second = planned
    assert (first.case, second.case) == ("3", "2")
    assert first.parameters == {"plant": {"friction.coulomb": 0.5, "hold_ticks": 40}}
    assert second.parameters == {"plant": {"friction.coulomb": 0.5, "hold_ticks": 30}}
    assert (second.duration, second.swaps, second.friction) == (3.0, ["1:ctc"], False)


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ("friction: [1]", "friction: true or false was expected, got [1]"),
        ("friction: 1", "friction: true or false was expected, got 1"),
        ("duration: '3'", "duration: a number was expected, got '3'"),
        ("duration: true", "duration: a number was expected, got True"),
        ("duration: .nan", "duration: Input should be a finite number, got nan"),
        ("command_latency_ticks: 1.5", "a whole number was expected, got 1.5"),
        ("command_latency_ticks: 1e9999", "a whole number was expected, got inf"),
        ("swaps: 5:ctc", "swaps: a list of texts was expected, got '5:ctc'"),
        ("swaps: [5]", "swaps: a list of texts was expected, got [5]"),
        ("bag: [b]", "bag: a text was expected, got ['b']"),
        ('bag: "a\\0b"', "bag: a text was expected"),
        ("robot: null", "robot: a text or a mapping of numbers was expected, got None"),
        ("parameters: 5", "parameters: a mapping of nodes to their parameters was expected"),
        ("parameters: {plant: 5}", "a mapping of nodes to their parameters was expected"),
        ("parameters: {plnt: {}}", "unknown node 'plnt'"),
        ("parameters: ['plant.case=[']", "parameters 'plant.case': line 2: not YAML"),
        ("5: 6", "unknown key 5"),
        ("[1]", "a mapping was expected, got list"),
        ("[1]: 2", "a key must be a text or a number"),
    ],
)
def test_a_wrong_scenario_is_refused(tmp_path: Path, content: str, said: str) -> None:
    path = tmp_path / "scenario.yaml"
    path.write_text(content)
    assert said in said_by("--scenario", str(path))


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("plant.case=[", "--set 'plant.case': line 2: not YAML"),
        ("plant.case=!!int x", "the value 'x' is not of type int"),
        ("plant.case=" + "[" * 20_000, "nested deeper"),
        ("plant.case", "NODE.PARAM=VALUE expected"),
        ("plnt.case=1", "unknown node 'plnt'"),
        ("plant.case={}", "case: Input should be a valid string, got {}"),
        ("plant.case=2020-13-45", "unknown case '2020-13-45'"),
        ("plant.friction=5", "friction: a mapping was expected, got 5"),
        ("plant.friction={5: 1}", "friction.5: unknown key"),
        ("plant.base_torque_limit=1e9999", "Input should be a finite number, got inf"),
        ("plant.initial_quaternion=[true,1,0,0]", "initial_quaternion.0: Input should be"),
        ("plant.initial_quaternion=[1e9,1e9,0,0]", "must have a norm of 0.001 to 1000"),
        ("plant.robot=" + "a" * 300 + ".yaml", "cannot be read (File name too long)"),
        ("plant.robot=/dev/zero.yaml", "no such file"),
        ('plant.robot="a\\0.yaml"', "cannot be read"),
        ("controller.tde_stc.k_1=['1']", "numbers were expected, got ['1']"),
        ("controller.tde_stc.k_1=[true]", "numbers were expected, got [True]"),
        ("controller.gains=" + "g" * 300, "unknown gain set 'ggg"),
    ],
)
def test_a_wrong_parameter_is_refused(text: str, said: str) -> None:
    line = said_by("--set", text)
    assert said in line
    assert len(line.splitlines()) == 1


def test_a_pipe_for_a_file_is_not_waited_for(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe.yaml"
    os.mkfifo(pipe)
    for option in ("--robot", "--mission", "--case", "--gains", "--scenario"):
        assert "not a file" in said_by(option, str(pipe)), option


def test_a_folder_of_gains_needs_no_slash(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "g").mkdir()
    (tmp_path / "g" / "tde_stc.yaml").write_text(
        "controller_node: {ros__parameters: {tde_stc: "
        "{h_bar: [50], lambda: [3], k_1: [0.02], k_2: [8.0e-5]}}}"
    )
    monkeypatch.chdir(tmp_path)
    bare, slash = (Flight(resolve(FlightPlan(gains=gains))) for gains in ("g", "g/"))
    assert bare.scenario.gains_used == slash.scenario.gains_used
    assert bare.description == slash.description


_NAMES = st.sampled_from(
    [
        "plant.case",
        "plant.friction",
        "plant.friction.coulomb",
        "plant.initial_quaternion",
        "plant.realtime",
        "plant.faults",
        "plant.robot",
        "controller.swaps",
        "controller.tde_stc",
        "controller.tde_stc.k_1",
        "controller.controller",
        "controller.gains",
        "mission.mission",
        "mission.waypoint_times",
        "recorder.split_size",
        "recorder.compression",
        "recorder",
        "x.y",
        "plant..",
        "plant.period",
        "plant.a=b",
        ".",
        "",
    ]
)
_TEXTS = st.sampled_from(
    [
        "1",
        "true",
        "[]",
        "{}",
        "[1, 2.5, 0, 0]",
        "{a: {b: 1}}",
        "!!int x",
        "&a [*a]",
        "2020-13-45",
        "[[1]]",
        "{[1]: 2}",
        ".inf",
        "-1",
        "1e400",
        "~",
        "'",
        "[",
        "\0",
        "é",
        "9" * 400,
        "..",
        "/",
        "/dev/null",
        "/dev/zero.yaml",
        "x:y",
        "os:path",
        "a" * 300,
        "[a]",
        "{coulomb: true}",
        "-0.0",
    ]
) | st.text(max_size=8)


@given(st.lists(st.tuples(_NAMES, _TEXTS), min_size=1, max_size=3))
def test_any_parameters_fly_or_are_refused_in_one_line(pairs: list[tuple[str, str]]) -> None:
    """Of the options' parser and of the plan; nothing is flown."""
    from space_robot.cli.scenario_option import _set

    tree: dict[str, dict[str, Any]] = {}
    try:
        for name, value in pairs:
            _set(tree, f"{name}={value}", "--set")
        Flight(resolve(validate(FlightPlan, {"parameters": tree}, "options")))
    except InputError as error:
        assert len(str(error).splitlines()) == 1  # noqa: PT017


@pytest.mark.parametrize(
    "text", ["/mine=/joint_states", ":=/joint_states", "/mine:=", "/mine", ":="]
)
def test_a_remapping_needs_both_names_and_the_sign(text: str) -> None:
    ended = CliRunner().invoke(cli.cli, ["analyze", "nowhere", "--remap", text])
    assert ended.exit_code == 2
    assert f"{text!r}: THEIRS:=OURS expected" in " ".join(ended.output.split())
