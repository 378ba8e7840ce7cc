"""Settings by any way, resolved: parameters, options, refusals, robots and actuators assumed."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from command import Run
from flights import planned
from paths import CONFIG
from robots import driven_paper

from space_robot.analysis import analyze
from space_robot.flight.flight_messages import default_bag
from space_robot.flight.plan import Flight
from space_robot.flight.simulate import simulate
from space_robot.scenario.node_settings import NODES, NOT_TO_BE_SET, SCHEMAS, FlightSettings
from space_robot.scenario.scenario import Scenario
from space_robot_msgs_py.bag.message_accounting import topics_with_allowed_gaps
from space_robot_msgs_py.config.installation import GRAPH_FILE, config_directory
from space_robot_msgs_py.config.settings import leaves
from space_robot_msgs_py.errors import InputError

Parameters = dict[str, dict[str, Any]]


def flight_of(parameters: Parameters, **options: Any) -> Flight:
    return planned(duration=0.05, parameters=parameters, **options)


def test_a_parameter_is_the_same_as_its_option() -> None:
    """Settings, labels and objects; the plan alone keeps how it was said."""
    pairs: list[tuple[Parameters, dict[str, Any]]] = [
        ({"controller": {"controller": "ctc"}}, {"controller": "ctc"}),
        ({"controller": {"gains": "tuned"}}, {"gains": "tuned"}),
        ({"controller": {"navigation": "filtered"}}, {"navigation": "filtered"}),
        ({"controller": {"swaps": ["0.01:ctc"]}}, {"swaps": ["0.01:ctc"]}),
        ({"plant": {"case": 3}}, {"case": "3"}),
        ({"plant": {"realtime": True}}, {"realtime": True}),
        (
            {"plant": {"faults": ["nan_state@0-1"], "fault_seed": 7}},
            {"faults": ["nan_state@0-1"], "seed": 7},
        ),
        ({"plant": {"friction": {"coulomb": 0.0, "viscous": 0}}}, {"friction": False}),
        ({"plant": {"command_latency_ticks": 2}}, {"command_latency_ticks": 2}),
        ({"recorder": {"compression": "zstd"}}, {"compression": "zstd"}),
    ]
    for parameters, options in pairs:
        one, other = flight_of(parameters), flight_of({}, **options)
        assert one.description == other.description, options
        assert one.plant_settings == other.plant_settings
        assert one.controller_settings == other.controller_settings
        assert one.scenario.recorder == other.scenario.recorder
        assert topics_with_allowed_gaps(one.description) == topics_with_allowed_gaps(
            other.description
        )
        assert (
            default_bag(one).name.partition("_2")[0] == (default_bag(other).name.partition("_2")[0])
        )


def test_gains_are_parameters_as_at_the_node() -> None:
    flight = flight_of({"controller": {"tde_stc.k_1": [0.5], "tde_smc": {"g": [1]}}})
    assert flight.scenario.gains_used["k_1"] == [0.5] * 9
    assert flight.scenario.parameters["controller"]["tde_stc.k_1"] == [0.5] * 9
    assert flight.scenario.parameters["controller"]["tde_smc.g"] == [1.0] * 9
    assert (flight.controller.law.gain_values["k_1"] == 0.5).all()


@pytest.mark.parametrize(
    ("parameters", "said"),
    [
        ({"plant": {"ticks": 5}}, "plant.ticks cannot be set: use --duration"),
        ({"recorder": {"bag": "b"}}, "recorder.bag cannot be set: use --bag"),
        ({"recorder": {"flight": "{}"}}, "recorder.flight cannot be set"),
        ({"recorder": {"robot": "seven_joint"}}, "recorder.robot cannot be set: use --robot"),
        ({"plant": {"wait_for": ["x"]}}, "plant.wait_for cannot be set"),
        ({"mission": {"autostart": False}}, "mission.autostart cannot be set"),
        ({"plant": {"hold_tick": 5}}, "hold_tick: unknown key, got 5: did you mean hold_ticks?"),
        ({"controller": {"tde_stc.k_9": [1.0]}}, "unknown gain of tde_stc 'k_9'"),
        ({"controller": {"pid.k_1": [1.0]}}, "unknown law 'pid' in controller parameters"),
        ({"plnt": {"hold_ticks": 5}}, "unknown node 'plnt'"),
        ({"controller": {"period": 0.001}}, "controller.period cannot be set: use --period"),
        (
            {"plant": {"robot": "seven_joint", "mission": "seven_joint"}},
            "the robots of plant and controller must have the same joints",
        ),
        (
            {"mission": {"robot": "seven_joint"}},
            "the robots of plant and mission must have the same joints",
        ),
        ({"controller": {"swaps": ["1:pid"]}}, "unknown controller 'pid' of swaps"),
        ({"plant": {"friction": 1.0, "friction.viscous": 1.0}}, "given as a value, and as a group"),
        ({"plant": {"realtime": True}}, "realtime: that needs the graph of nodes: use `fly`"),
        ({"controller": {"fifo_priority": 5}}, "fifo_priority: that needs the graph"),
    ],
)
def test_what_cannot_be_set_is_refused(parameters: Parameters, said: str) -> None:
    with pytest.raises(InputError) as caught:
        simulate(flight_of(parameters))
    assert said in str(caught.value)


def test_every_parameter_that_is_refused_is_one() -> None:
    known = {f"{schema.node}.{name}" for schema in SCHEMAS for name, _ in leaves(schema)}
    known |= {f"{node}.autostart" for node in NODES}
    assert set(NOT_TO_BE_SET) <= known


def test_one_period_for_all_is_flown(tmp_path: Path) -> None:
    flight = planned(duration=0.05, period=0.001, substeps=4)
    assert (flight.period, flight.ticks, flight.plant.memory.substeps) == (0.001, 50, 4)
    assert flight.description["period"] == 0.001
    assert all(flight.scenario.parameters[node]["period"] == 0.001 for node in NODES)
    case = tmp_path / "slow.yaml"
    case.write_text("plant_node: {ros__parameters: {period: 0.001}}\n")
    with pytest.raises(InputError, match=r"got plant 0\.001, controller"):
        planned(case=str(case))
    assert planned(case=str(case), period=0.0005, duration=1.0).ticks == 2000
    assert planned(duration=1e6).ticks == 2 * 10**9
    with pytest.raises(InputError, match="duration must be at most 100000 s"):
        planned(duration=1e6, period=1e-5)


def test_plant_and_controller_may_have_robots_of_their_own(tmp_path: Path) -> None:
    """A heavy plant under a nominal controller, and a law with a model whose robot is heavier."""
    content = yaml.safe_load((CONFIG / "robots/paper.yaml").read_text())
    content["robot"]["links"][-1]["mass"] *= 4.0
    content["robot"]["name"] = "heavy"
    path = tmp_path / "heavy.yaml"
    path.write_text(yaml.safe_dump(content))
    flight = flight_of({"plant": {"robot": str(path), "mission": "paper"}})
    assert analyze(simulate(flight))["robot"] == "heavy"
    plan: dict[str, Any] = {"controller": "ctc", "gains": "tuned"}
    tuned = str(CONFIG / "gains/paper/tuned")
    wrong = flight_of({"controller": {"robot": str(path), "gains": tuned}}, **plan)
    torque = simulate(wrong).applied_torque
    assert not np.array_equal(torque, simulate(flight_of({}, **plan)).applied_torque)
    assert wrong.plant.robot.name == "paper"
    assert wrong.description["controller_robot"] == "heavy"


def test_a_resolved_scenario_needs_no_file_of_the_package(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    options = {"sensors": "fine", "actuators": "wheels", "case": "2", "duration": 0.01}
    numbers = planned(**options).scenario.tree
    (tmp_path / GRAPH_FILE).write_bytes((config_directory() / GRAPH_FILE).read_bytes())
    monkeypatch.setattr("space_robot_msgs_py.config.files.config_directory", lambda: tmp_path)
    monkeypatch.setattr("space_robot_msgs_py.config.settings.config_directory", lambda: tmp_path)
    with pytest.raises(InputError, match="unknown robot"):
        FlightSettings.resolve(Scenario(case="2"))
    assert planned(**numbers).scenario.tree == numbers


def test_what_is_printed_is_what_a_bag_records_and_others_differ_by_key(
    tmp_path: Path, space_robot: Run
) -> None:
    file, bag, other = tmp_path / "mine.yaml", tmp_path / "bag", tmp_path / "other.yaml"
    words = ("--case", "3", "--sensors", "fine", "--duration", "0.05")
    assert space_robot("scenario", *words, "--output", file).code == 0
    assert space_robot("simulate", *words, "--bag", bag).code == 0
    assert "the same numbers" in space_robot("diff", bag, file).out
    content = yaml.safe_load(file.read_text())
    content["case"]["payload"]["mass"] = 12.5
    content["seed"] = 1
    other.write_text(yaml.safe_dump(content))
    compared = space_robot("diff", file, other, "--json")
    assert compared.code == 1
    assert json.loads(compared.out) == [
        {"key": "case.payload.mass", "first": 10.0, "second": 12.5},
        {"key": "seed", "first": 0, "second": 1},
    ]


def test_the_plant_has_one_robot_and_the_laws_another(tmp_path: Path) -> None:
    truth = tmp_path / "truth.yaml"
    truth.write_text(yaml.safe_dump(driven_paper()), "utf-8")
    flight = planned(plant_robot=str(truth), duration=0.05)
    assert flight.plant.robot.geared_names == ("joint2", "joint3", "joint5")
    assert flight.scenario.robots.controller.geared_names == ()
    tree = flight.scenario.tree
    assert not any("drive" in link for link in tree["robot"]["robot"]["links"])
    assert tree["plant_robot"]["robot"]["links"] == driven_paper()["robot"]["links"]
    assert flight.description["robot_file"] == tree["plant_robot"]
    assert flight.description["controller_robot_file"] == tree["robot"]
    assert tree["mission"] == flight_of({}).scenario.tree["mission"], "that of the robot assumed"


@pytest.mark.parametrize("as_numbers", [True, False], ids=["numbers", "file"])
def test_assumed_actuators_are_numbers_or_a_file(tmp_path: Path, as_numbers: bool) -> None:
    """The plant's are others; what is assumed as it is is not told."""
    content = yaml.safe_load((CONFIG / "actuators/wheels.yaml").read_text("utf-8"))
    numbers = content["plant_node"]["ros__parameters"]
    numbers["wheels"]["rotor_inertia"] = [1.1 * x for x in numbers["wheels"]["rotor_inertia"]]
    numbers = {key: numbers[key] for key in ("base_actuation", "wheels")}
    path = tmp_path / "heavier.yaml"
    path.write_text(yaml.safe_dump({"plant_node": {"ros__parameters": numbers}}))
    assumed = numbers if as_numbers else str(path)
    flight = planned(actuators="wheels", assumed_actuators=assumed, duration=0.05)
    own, other = flight.scenario.plant.wheels, flight.scenario.assumed_actuators.wheels
    expected = [1.1 * value for value in own.rotor_inertia]
    assert other.rotor_inertia == pytest.approx(expected, rel=1e-15)
    assert other.axes == own.axes
    tree = flight.scenario.tree
    assert tree["assumed_actuators"]["wheels"]["rotor_inertia"] == other.rotor_inertia
    assert planned(**tree).scenario.tree == tree
    same = planned(actuators="wheels", assumed_actuators="wheels", duration=0.05)
    assert "assumed_actuators" not in same.scenario.tree
