"""The arguments of launch/fly.launch.py: those of `fly`, and the same flight from them."""

from __future__ import annotations

import re
from pathlib import Path

import click
import pytest

from space_robot.cli.launch_arguments import launch_arguments, launched_flight, refuse_unknown
from space_robot.cli.scenario_option import NODES
from space_robot.flight.graph.node_names import started_nodes
from space_robot.flight.graph.orchestrator import flight_parameters
from space_robot.flight.plan import FlightPlan
from space_robot_msgs_py.errors import InputError


def names(option: click.Option) -> set[str]:
    return {text.lstrip("-").replace("-", "_") for text in option.opts}


def test_the_flight_is_the_one_of_the_command(tmp_path: Path) -> None:
    flight, bag, _ = launched_flight(
        {
            "controller": "tde_tsmc",
            "case": "4-2",
            "command_latency_ticks": "2",
            "friction": "false",
            "realtime": "true",
            "namespace": "sat1",
            "swap": "1:ctc 2:tde_smc",
            "duration": "3",
            "fault": "",
            "bag": str(tmp_path / "bag"),
        }
    )
    plan = FlightPlan(
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
    parameters = flight_parameters(flight, bag)["plant"]
    assert (parameters["own_controller"], parameters["join_timeout"]) == (True, 5.0)
    assert parameters["reset_with"] == ["recorder_node"]
    assert {entry.partition(":")[0] for entry in parameters["wait_for"]} == {"recorder_node"}
    flight, bag, _ = launched_flight({**values, "without": "mission"})
    assert flight_parameters(flight, bag)["controller"]["join_timeout"] == 5.0


def test_a_parameter_file_goes_over_the_arguments_and_into_the_bag(tmp_path: Path) -> None:
    file = tmp_path / "mine.yaml"
    file.write_text(
        "plant_node: {ros__parameters: {hold_ticks: 40, friction: {viscous: 0.0}}}\n"
        "/**/controller_node: {ros__parameters: {controller: ctc, ctc: {k_d: [7.0]}}}\n"
    )
    flight = launched_flight({"params_file": str(file), "controller": "tde_smc"}).flight
    assert flight.plant_settings.hold_ticks == 40
    told = flight.description
    assert told["parameters"]["plant"]["friction.viscous"] == 0.0
    assert (told["controller"], told["gains_used"]["k_d"]) == ("ctc", [7.0] * 9)


@pytest.mark.parametrize(
    ("group", "namespace", "scenario", "flown"),
    [
        ("", "", "", "/"),
        ("", "sat1", "", "/sat1"),
        ("/fleet", "", "", "/fleet"),
        ("/fleet", "sat1", "", "/fleet/sat1"),
        ("/fleet", "/sat1", "", "/sat1"),
        ("/fleet", "/", "", "/"),
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
    )
    flight, _, of_ros = launched_flight({"params_file": str(file)})
    assert flight.scenario.options.parameters == {"plant": {"hold_ticks": 40}}
    everywhere = {"use_sim_time": True}
    depth = {"qos_overrides./clock.publisher.depth": 7}
    assert of_ros == {node: everywhere for node in NODES} | {"plant": {**everywhere, **depth}}


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
        (["case:=kase:=1", "--noninteractive"], ""),
        ([], ""),
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
    if not said:
        refuse_unknown([*command, *words], file, names)
        return
    with pytest.raises(InputError, match=re.escape(said)):
        refuse_unknown([*command, *words], file, names)


@pytest.mark.parametrize(
    "words", [["mine.launch.py"], ["fly.launch.py"], ["mine", "fly.launch.py"]]
)
def test_arguments_of_a_launch_file_that_includes_ours_are_its_own(words: list[str]) -> None:
    """Also of one that has the same name."""
    refuse_unknown(["ros2", "launch", *words, "kase:=1"], "/y/fly.launch.py", ["case"])
