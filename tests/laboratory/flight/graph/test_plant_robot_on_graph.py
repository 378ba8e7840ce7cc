"""A graph whose plant flies another robot, and other actuators, than the controller assumes."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import yaml
from driven_robots import driven_paper
from flights import Flown
from paths import CONFIG

from space_robot.flight.graph.launched import launched_parameters
from space_robot.flight.plan import Flight, FlightPlan, resolve
from space_robot.flight.simulate import simulate
from space_robot_model.robot.find import find_robot
from space_robot_msgs_py.bag.reader import read_flight
from space_robot_msgs_py.config.settings import leaves
from space_robot_msgs_py.samples import ACTUATOR_FIELDS, STATE_FIELDS
from space_robot_sim.plant.settings import PlantNodeSettings

pytest.importorskip("rclpy")

COLUMNS = (*STATE_FIELDS, *ACTUATOR_FIELDS, "commanded_torque", "actuator_commands")
NODES = ("plant_node", "controller_node", "mission_node")


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> tuple[str, str]:
    """The paper's robot with gears, and the wheels with rotors that are heavier by a tenth."""
    folder = tmp_path_factory.mktemp("files")
    robot, wheels = folder / "geared.yaml", folder / "heavier.yaml"
    robot.write_text(yaml.safe_dump(driven_paper()), "utf-8")
    content = yaml.safe_load((CONFIG / "actuators" / "wheels.yaml").read_text("utf-8"))
    of_wheels = content["plant_node"]["ros__parameters"]["wheels"]
    of_wheels["rotor_inertia"] = [1.1 * value for value in of_wheels["rotor_inertia"]]
    wheels.write_text(yaml.safe_dump(content), "utf-8")
    return str(robot), str(wheels)


def test_the_plant_of_the_graph_is_that_of_the_option(
    fly: Callable[..., Flown], files: tuple[str, str]
) -> None:
    """With gears, which the controller knows nothing of: as `simulate` flies it, to the bit."""
    robot, wheels = files
    words = ("--plant-robot", robot, "--actuators", "wheels", "--assumed-actuators", wheels)
    log = read_flight(fly(*words, "--duration", "0.2").bag)
    plan = FlightPlan(plant_robot=robot, actuators="wheels", assumed_actuators=wheels, duration=0.2)
    expected = simulate(Flight(resolve(plan)))
    assert log.geared_names == expected.geared_names == ("joint2", "joint3", "joint5")
    for name in COLUMNS:
        np.testing.assert_array_equal(getattr(log, name), getattr(expected, name), name)


def test_launched_nodes_get_files_of_their_own(tmp_path: Path, files: tuple[str, str]) -> None:
    robot, wheels = files
    plan = FlightPlan(plant_robot=robot, actuators="wheels", assumed_actuators=wheels, duration=0.2)
    flight, folder = Flight(resolve(plan)), tmp_path / "launch"
    folder.mkdir()
    content = yaml.safe_load(
        launched_parameters(flight, tmp_path / "bag", True, folder, {}).read_text()
    )
    parameters = {}
    for name, values in content.items():
        node = next((node for node in NODES if node in name), "")
        parameters[node] = values["ros__parameters"]
    plant, controller = (parameters[name] for name in NODES[:2])
    assert find_robot(plant["robot"]).geared_names == ("joint2", "joint3", "joint5")
    assert find_robot(controller["robot"]).geared_names == ()
    assert controller["actuators"] != "wheels"
    assumed = yaml.safe_load(Path(controller["actuators"]).read_text())
    expected = flight.scenario.assumed_actuators.wheels.rotor_inertia
    assert assumed["plant_node"]["ros__parameters"]["wheels"]["rotor_inertia"] == expected
    # a plant that is told all this accepts it
    known = {name for name, _ in leaves(PlantNodeSettings)}
    PlantNodeSettings.resolve({key: plant[key] for key in known & plant.keys()})
