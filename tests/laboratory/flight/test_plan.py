"""One resolved plan: what is set by any way is flown, sent to the nodes, and told in bags."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from flights import planned
from matrix.scenarios import PLANS, Planned, in_root
from paths import ROOT

from space_robot.flight.flown_log import empty_log
from space_robot.flight.graph.orchestrator import flight_parameters
from space_robot.flight.plan import Flight, FlightPlan, resolve
from space_robot.flight.simulate import simulate
from space_robot.processes import software
from space_robot.processes.node_modules import MODULES
from space_robot.scenario.node_settings import NODES, SCHEMAS
from space_robot_control.allocation.assumed_actuators import assumed_actuators
from space_robot_control.controller.controller import Controller
from space_robot_control.controller.gains import build_laws, split_gains
from space_robot_control.controller.settings import ControllerNodeSettings
from space_robot_control.guidance.mission import Mission
from space_robot_control.guidance.settings import MissionNodeSettings
from space_robot_model.robot import Robot
from space_robot_model.robot.find import find_robot
from space_robot_msgs_py.bag.reader import read_flight
from space_robot_sim.plant.plant import Plant
from space_robot_sim.plant.settings import PlantNodeSettings

OWN_FILES = {"plant_robot", "assumed_actuators"}
"""Options for which a graph writes files for its nodes."""


@pytest.fixture
def _in_root() -> Iterator[None]:
    with in_root():
        yield


@pytest.mark.usefixtures("_in_root")
@pytest.mark.parametrize(
    "plan", [plan for plan in PLANS.values() if not plan.options.keys() & OWN_FILES], ids=str
)
def test_all_that_is_made_of_a_plan_agrees(plan: Planned) -> None:
    """Settings and objects as the nodes make them of what they are sent; labels; `simulate`."""
    flight, parameters = plan.scenario.check(), plan.options.get("parameters", {})
    sent = json.loads(json.dumps(flight.scenario.parameters))
    for schema in SCHEMAS:
        for name in parameters.get(schema.node, {}):
            assert name in sent[schema.node]
    plant = PlantNodeSettings.resolve(sent["plant"])
    own, gains = split_gains(sent["controller"])
    controller = ControllerNodeSettings.resolve(own)
    mission = MissionNodeSettings.resolve(sent["mission"])
    assert plant == flight.plant_settings
    assert controller == flight.controller_settings
    assert mission == flight.mission_settings
    said = empty_log(flight).flight
    assert said == flight.description
    assert said["parameters"] == sent
    assert (said["case"], said["realtime"]) == (plant.case, plant.realtime)
    assert (said["gains"], said["seed"]) == (controller.gains, plant.fault_seed)
    assert said.get("faults", []) == [text for text in plant.faults if text]
    assert said.get("swaps", []) == [text for text in controller.swaps if text]
    assert said["command_latency_ticks"] == plant.command_latency_ticks
    assert said["friction"] is bool(plant.friction.coulomb or plant.friction.viscous)
    # as the nodes build them
    robot = find_robot(controller.robot)
    built = build_laws(controller, len(robot.nominal.axis_names), gains)
    law = next(iter(built.values()))
    assert said["controller"] == law.name
    assert said["gains_used"] == {name: row.tolist() for name, row in law.gain_values.items()}
    theirs = Plant(find_robot(plant.robot), plant, plant.period)
    assert theirs.block.tobytes() == flight.plant.block.tobytes()
    assert theirs.command_delay_buffer.shape == flight.plant.command_delay_buffer.shape
    assert assumed_actuators(controller.actuators, robot) == flight.scenario.assumed_actuators
    loop = Controller(
        robot,
        law,
        controller.period,
        controller.acceleration_filter_hz,
        controller.filter_settings,
        assumed_actuators(controller.actuators, robot),
        controller.allocation,
    )
    assert loop.block.tobytes() == flight.controller.block.tobytes()
    assert law.gains_block.tobytes() == flight.controller.law.gains_block.tobytes()
    reference = Mission(robot, mission, mission.period).chunk(0, 100)
    np.testing.assert_array_equal(reference.joints, flight.mission.chunk(0, 100).joints)


def test_lists_go_to_the_nodes_as_declared(tmp_path: Path) -> None:
    """ROS takes no list of whole and decimal numbers."""
    parameters = {"plant": {"initial_quaternion": [0.9, 1, 0, 0], "case": 2}}
    flight = planned(duration=0.05, parameters=parameters)
    sent = flight_parameters(flight, tmp_path / "bag")["plant"]
    assert json.dumps(sent["initial_quaternion"]) == "[0.9, 1.0, 0.0, 0.0]"
    assert sent["case"] == "2"


# What a bag says of its flight


def test_a_bag_has_all_to_fly_its_flight_again(tmp_path: Path) -> None:
    plan = FlightPlan(
        controller="tde_smc",
        case="3",
        seed=7,
        friction=False,
        robot="seven_joint",
        duration=0.02,
        parameters={"plant": {"hold_ticks": 40}},
    )
    flight = Flight(resolve(plan))
    simulate(flight, tmp_path / "bag")
    said = read_flight(tmp_path / "bag").flight
    assert said == flight.description
    assert json.dumps(said) == json.dumps(Flight(resolve(plan)).description)
    assert (said["seed"], planned().description["seed"]) == (7, 0)
    assert tuple(said["parameters"]) == NODES == tuple(MODULES)
    robot = Robot.from_dict(said["robot_file"], where="the bag")
    np.testing.assert_array_equal(robot.inertia, flight.robot.inertia)


def test_versions_and_commit_are_those_installed() -> None:
    assert software.versions()["numpy"] == np.__version__
    command = ["git", "-C", str(ROOT), "rev-parse", "HEAD"]
    done = subprocess.run(command, capture_output=True, text=True)
    head = done.stdout.strip()
    known = (head, f"{head}-dirty") if done.returncode == 0 else (None,)
    assert software.commit() in known
