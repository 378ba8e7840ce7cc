"""What a bag says of its flight: enough to fly it again, and nothing of when and where."""

from __future__ import annotations

import json
import shutil
import subprocess
from pathlib import Path

import numpy as np
from paths import CONFIG, ROOT

from space_robot.flight.plan import Flight, FlightPlan, resolve
from space_robot.flight.simulate import simulate
from space_robot.processes import software
from space_robot.processes.node_modules import MODULES
from space_robot.scenario.node_settings import NODES
from space_robot_control.controller.gains import split_gains
from space_robot_control.controller.settings import ControllerNodeSettings
from space_robot_model.robot import Robot
from space_robot_msgs_py.bag.reader import read_flight
from space_robot_sim.plant.settings import PlantNodeSettings

PLAN = FlightPlan(
    controller="tde_smc",
    case="3",
    seed=7,
    friction=False,
    robot="seven_joint",
    duration=0.02,
    parameters={"plant": {"hold_ticks": 40}},
)


def test_bag_has_all_to_fly_it_again(tmp_path: Path) -> None:
    flight = Flight(resolve(PLAN))
    simulate(flight, tmp_path / "bag")
    said = read_flight(tmp_path / "bag").flight
    assert said == flight.description
    assert said["seed"] == 7
    robot = Robot.from_dict(said["robot_file"], where="the bag")
    np.testing.assert_array_equal(robot.inertia, flight.robot.inertia)
    assert tuple(said["parameters"]) == NODES == tuple(MODULES)
    told = said["parameters"]
    assert PlantNodeSettings.resolve(told["plant"]) == flight.plant_settings
    own, gains = split_gains(told["controller"])
    assert ControllerNodeSettings.resolve(own) == flight.controller_settings
    assert gains[said["controller"]] == said["gains_used"]


def test_robot_is_told_though_its_file_is_gone(tmp_path: Path) -> None:
    source = CONFIG / "robots" / "paper.yaml"
    file = Path(shutil.copy(source, tmp_path / "paper.yaml"))
    flight = Flight(resolve(FlightPlan(robot=str(file), duration=0.02)))
    file.unlink()
    robot = Robot.from_dict(flight.description["robot_file"])
    np.testing.assert_array_equal(robot.com, flight.robot.com)


def test_seed_is_told_without_faults() -> None:
    assert Flight(resolve(FlightPlan())).description["seed"] == 0


def test_description_is_json_and_the_same_every_time() -> None:
    texts = {json.dumps(Flight(resolve(PLAN)).description) for _ in range(2)}
    assert len(texts) == 1


def test_commit_is_the_checkouts() -> None:
    root = ROOT
    done = subprocess.run(
        ["git", "-C", str(root), "rev-parse", "HEAD"], capture_output=True, text=True
    )
    found = software.commit()
    if done.returncode == 0:
        assert found in (done.stdout.strip(), f"{done.stdout.strip()}-dirty")
    else:
        assert found is None


def test_versions_are_those_installed() -> None:
    assert software.versions()["numpy"] == np.__version__
