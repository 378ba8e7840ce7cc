"""Options of flights: the same in all places, launch/fly.launch.py too; flown as given."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import click
import pytest
import yaml
from click.testing import CliRunner, Result
from hypothesis import given
from hypothesis import strategies as st
from paths import CONFIG

from space_robot.cli import main as cli
from space_robot.cli.flights import fly, simulate
from space_robot.cli.launch_arguments import launch_arguments, launched_flight, refuse_unknown
from space_robot.cli.option_types import FiniteRange
from space_robot.flight.graph.node_names import started_nodes
from space_robot.flight.graph.orchestrator import flight_parameters
from space_robot.flight.plan import Flight, Scenario, resolve
from space_robot.scenario.objects import NODES, set_parameter
from space_robot.scenario.options import OPTIONS
from space_robot_msgs_py.config.validation import validate
from space_robot_msgs_py.errors import InputError


@pytest.fixture
def planned(monkeypatch: pytest.MonkeyPatch) -> list[Scenario]:
    """The plans that commands make, which are then not flown."""
    plans: list[Scenario] = []

    def plan(**options: Any) -> Any:
        plans.append(validate(Scenario, options, "options"))
        raise InputError("not to be flown")

    monkeypatch.setattr("space_robot.cli.flights.plan_flight", plan)
    return plans


def simulated(*arguments: str) -> Result:
    return CliRunner().invoke(cli.cli, ["simulate", *arguments])


def said_by(*arguments: str) -> str:
    """The one line with which a command refuses them."""
    result = simulated(*arguments)
    assert isinstance(result.exception, InputError), result.exception
    return str(result.exception)


def test_what_is_given_comes_over_the_scenario(planned: list[Scenario], tmp_path: Path) -> None:
    """Options and parameters; the others of both count."""
    path = tmp_path / "scenario.yaml"
    path.write_text(
        "case: 2\nduration: 3\nswaps: ['1:ctc']\nfriction: false\nsensors: fine\n"
        "parameters: {plant: {friction: {coulomb: 0.5}, hold_ticks: 30}}\n"
    )
    given = ["--set", "plant.hold_ticks=40", "--case", "3", "--duration", "1", "--friction"]
    said_by("--scenario", str(path), *given, "--swap", "2:tde_smc")
    said_by("--scenario", str(path))
    first, second = planned
    assert (first.case, second.case) == ("3", "2")
    assert first.parameters == {"plant": {"friction.coulomb": 0.5, "hold_ticks": 40}}
    assert second.parameters == {"plant": {"friction.coulomb": 0.5, "hold_ticks": 30}}
    assert (first.duration, first.swaps, first.friction) == (1.0, ["2:tde_smc"], True)
    assert (second.duration, second.swaps, second.friction) == (3.0, ["1:ctc"], False)
    assert first.sensors == second.sensors == "fine"


def test_a_folder_of_gains_needs_no_slash(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "g").mkdir()
    (tmp_path / "g" / "tde_stc.yaml").write_text(
        "controller_node: {ros__parameters: {tde_stc: "
        "{h_bar: [50], lambda: [3], k_1: [0.02], k_2: [8.0e-5]}}}"
    )
    monkeypatch.chdir(tmp_path)
    bare, slash = (Flight(resolve(Scenario(gains=gains))) for gains in ("g", "g/"))
    assert bare.scenario.gains_used == slash.scenario.gains_used
    assert bare.description == slash.description


def test_a_plant_robot_of_the_same_numbers_is_no_other_robot(tmp_path: Path) -> None:
    content = yaml.safe_load((CONFIG / "robots/paper.yaml").read_text("utf-8"))
    for number, mass in enumerate((content["robot"]["base"]["mass"], 700.0)):
        content["robot"]["base"]["mass"] = mass
        file = tmp_path / f"{number}.yaml"
        file.write_text(yaml.safe_dump(content))
        flight = Flight(resolve(Scenario(plant_robot=str(file))))
        assert ("controller_robot_file" in flight.description) == (number > 0)
        assert ("plant_robot" in flight.scenario.tree) == (number > 0)


_NAMES = st.sampled_from(
    ["plant.friction", "plant.friction.coulomb", "plant.faults", "plant.robot"]
) | st.sampled_from(
    ["controller.swaps", "controller.tde_stc", "controller.tde_stc.k_1", "controller.gains", "x.y"]
)
_TEXTS = st.text(max_size=8) | st.sampled_from(
    [
        "1",
        "true",
        "[]",
        "[1, 2.5, 0, 0]",
        "{a: {b: 1}}",
        "~",
        ".inf",
        "/dev/null",
        "{coulomb: true}",
    ]
)


@given(st.lists(st.tuples(_NAMES, _TEXTS), min_size=1, max_size=3))
def test_any_parameters_fly_or_are_refused_in_one_line(pairs: list[tuple[str, str]]) -> None:
    """Of the options' parser and of the plan; nothing is flown."""
    tree: dict[str, dict[str, Any]] = {}
    try:
        for name, value in pairs:
            set_parameter(tree, f"{name}={value}", "--set")
        Flight(resolve(validate(Scenario, {"parameters": tree}, "options")))
    except InputError as error:
        assert len(str(error).splitlines()) == 1  # noqa: PT017


@pytest.mark.parametrize(
    ("text", "said"),
    [
        *((text, "is not a finite number.") for text in ("nan", "-inf", "1e999")),
        *((text, "is not in the range") for text in ("0", "0.51")),
        ("x", "is not a valid float"),
    ],
)
def test_a_number_out_of_its_range_is_refused(text: str, said: str) -> None:
    """A bound is in the range unless it is open."""
    own = FiniteRange() if "finite" in said else FiniteRange(0.0, 0.5, min_open=True)
    with pytest.raises(click.BadParameter, match=said):
        own.convert(text, None, None)
    assert FiniteRange(0.0, 0.5).convert("0", None, None) == 0.0
    assert FiniteRange(0.0, 0.5, min_open=True).convert("0.5", None, None) == 0.5


@pytest.mark.parametrize("name", OPTIONS)
def test_an_option_is_the_same_everywhere(name: str) -> None:
    option, default = OPTIONS[name], OPTIONS[name].default
    field = Scenario.model_fields[name]
    assert (field.description, field.default) == (option.help_text, default)
    of_fly, of_simulate = (
        {p.name: p for p in command.params if isinstance(p, click.Option)}
        for command in (fly, simulate)
    )
    assert (name in of_fly, name in of_simulate) == (True, not option.needs_graph)
    launched = {
        argument.name
        for argument in launch_arguments()
        if argument.description.startswith(option.help_text.partition(" [default")[0])
    }
    flags = {max(of_fly[name].opts, key=len).lstrip("-").replace("-", "_")}
    assert launched == (flags if option.is_launched else set())


def test_the_flight_is_the_one_of_the_command(tmp_path: Path) -> None:
    given = {"controller": "tde_tsmc", "case": "4-2", "command_latency_ticks": "2"}
    given |= {"friction": "false", "realtime": "true", "namespace": "sat1", "duration": "3"}
    given |= {"swap": "1:ctc 2:tde_smc", "fault": "", "bag": str(tmp_path / "bag")}
    flight, bag, _ = launched_flight(given)
    plan = Scenario(
        controller="tde_tsmc",
        case="4-2",
        command_latency_ticks=2,
        friction=False,
        realtime=True,
        namespace="/sat1",
        swaps=["1:ctc", "2:tde_smc"],
        duration=3.0,
    )
    assert flight.scenario.options == plan
    assert bag == tmp_path / "bag"


def test_nodes_of_ones_own_take_the_places_of_those_that_are_not_started(tmp_path: Path) -> None:
    values = {"without": "controller mission", "join_timeout": "5", "bag": str(tmp_path / "bag")}
    flight, bag, _ = launched_flight(values)
    assert started_nodes(flight.scenario.options.without) == ("recorder_node", "plant_node")
    parameters = flight_parameters(flight, bag, tmp_path)["plant"]
    assert (parameters["own_controller"], parameters["join_timeout"]) == (True, 5.0)
    assert parameters["reset_with"] == ["recorder_node"]
    assert {entry.partition(":")[0] for entry in parameters["wait_for"]} == {"recorder_node"}
    flight, bag, _ = launched_flight({**values, "without": "mission"})
    assert flight_parameters(flight, bag, tmp_path)["controller"]["join_timeout"] == 5.0


def test_a_parameter_file_goes_over_the_arguments_and_into_the_bag(tmp_path: Path) -> None:
    file = tmp_path / "mine.yaml"
    file.write_text(
        "plant_node: {ros__parameters: {hold_ticks: 40, friction: {viscous: 0.0}}}\n"
        "/**/controller_node: {ros__parameters: {controller: ctc, ctc: {k_d: [7.0]}}}\n"
    )
    flight = launched_flight({"params_file": str(file), "controller": "tde_smc"}).flight
    assert flight.plant_settings.hold_ticks == 40
    told = flight.description["scenario"]
    assert told["case"]["friction"]["viscous"] == 0.0
    assert (told["controller"], told["gains"]["ctc"]["k_d"]) == ("ctc", [7.0] * 9)


@pytest.mark.parametrize(
    ("group", "namespace", "scenario", "flown"),
    [
        ("", "", "", "/"),
        ("/fleet", "", "", "/fleet"),
        ("/fleet", "sat1", "", "/fleet/sat1"),
        ("/fleet", "/sat1", "", "/sat1"),
        ("/fleet", "", "sat2", "/fleet/sat2"),
        ("/fleet", "sat1", "sat2", "/fleet/sat1"),
    ],
)
def test_a_relative_namespace_is_in_that_of_the_group(
    group: str, namespace: str, scenario: str, flown: str, tmp_path: Path
) -> None:
    """As a node's in a launch file with PushRosNamespace."""
    values = {"namespace": namespace}
    if scenario:
        (tmp_path / "mine.yaml").write_text(f"namespace: {scenario}\n")
        values["scenario"] = str(tmp_path / "mine.yaml")
    assert launched_flight(values, group).flight.scenario.options.namespace == flown


def test_parameters_of_every_ros_node_go_to_the_nodes_unchanged(tmp_path: Path) -> None:
    """Of them `use_sim_time` stands in most files; they are no settings of a flight."""
    file = tmp_path / "mine.yaml"
    file.write_text(
        "/**: {ros__parameters: {use_sim_time: true}}\n"
        "plant_node:\n"
        "  ros__parameters:\n"
        "    hold_ticks: 40\n"
        "    qos_overrides: {/clock: {publisher: {depth: 7}}}\n"
        "/sat1/plant_node: {ros__parameters: {hold_ticks: 50}}\n"
    )
    in_space = launched_flight({"params_file": str(file)}, "/sat1").flight
    assert in_space.plant_settings.hold_ticks == 50
    flight, _, ros_parameters = launched_flight({"params_file": str(file)})
    assert flight.scenario.options.parameters == {"plant": {"hold_ticks": 40}}
    everywhere = {"use_sim_time": True}
    depth = {"qos_overrides./clock.publisher.depth": 7}
    assert ros_parameters == {node: everywhere for node in NODES} | {
        "plant": {**everywhere, **depth}
    }


@pytest.mark.parametrize(
    ("values", "said"),
    [
        ({"controller": "pid"}, "unknown controller 'pid'"),
        ({"navigation": "sideways"}, "'sideways' is not one of"),
        ({"duration": "long"}, "'long' is not a valid float"),
        ({"duration": "-1"}, "duration"),
        ({"fault": "kill_controller@1"}, "needs `space-robot fly`"),
        ({"params_file": "/no/file.yaml"}, "/no/file.yaml"),
    ],
)
def test_what_cannot_be_is_refused_in_a_line(values: dict[str, str], said: str) -> None:
    with pytest.raises(InputError, match=re.escape(said)) as refused:
        launched_flight(values)
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["kase:=1"], "fly.launch.py: unknown argument 'kase': did you mean case?"),
        (["case:=1", "zzz:="], "unknown argument 'zzz': --show-args"),
    ],
)
@pytest.mark.parametrize(
    "command",
    [["ros2", "launch", "space_robot", "fly.launch.py"], ["-c", "launch/../launch/fly.launch.py"]],
)
def test_an_argument_that_launch_would_let_pass_is_refused(
    command: list[str], words: list[str], said: str
) -> None:
    names = [argument.name for argument in launch_arguments()]
    file = str(Path("launch/fly.launch.py").absolute())
    refuse_unknown([*command, "case:=kase:=1", "--noninteractive"], file, names)
    with pytest.raises(InputError, match=re.escape(said)):
        refuse_unknown([*command, *words], file, names)


@pytest.mark.parametrize(
    "words", [["mine.launch.py"], ["fly.launch.py"], ["mine", "fly.launch.py"]]
)
def test_arguments_of_a_launch_file_that_includes_ours_are_its_own(words: list[str]) -> None:
    """Also of one that has the same name."""
    refuse_unknown(["ros2", "launch", *words, "kase:=1"], "/y/fly.launch.py", ["case"])
