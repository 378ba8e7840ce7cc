"""launch/fly.launch.py, run by launch itself, where ROS has it: no wheel carries it."""

from __future__ import annotations

import os
import runpy
import shutil
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from flights import ros_environment, simulated
from matrix.scenarios import difference
from paths import ROOT

from space_robot.cli.launch_arguments import launch_arguments
from space_robot_msgs_py.bag.folder import open_bag
from space_robot_msgs_py.bag.reader import read_flight

pytest.importorskip("launch_ros")  # not "launch": this repository's folder would do for that

RUN = """
import sys
from launch import LaunchDescription, LaunchService
from launch.actions import IncludeLaunchDescription
from launch.launch_description_sources import PythonLaunchDescriptionSource
from launch.actions import GroupAction
from launch_ros.actions import PushRosNamespace
flights, arguments = [], []
for word in [*sys.argv[2:], "--"]:
    if word == "--":
        source = PythonLaunchDescriptionSource(sys.argv[1])
        include = IncludeLaunchDescription(source, launch_arguments=arguments)
        flights.append(GroupAction([PushRosNamespace("fleet"), include]))
        arguments = []
    else:
        arguments.append(tuple(word.split(":=", 1)))
service = LaunchService(argv=sys.argv[2:])
service.include_launch_description(
    LaunchDescription(flights if len(flights) > 1 else [include])
)
sys.exit(service.run())
"""
"""`ros2 launch FILE NAME:=VALUE...`, which no wheel carries either.

With `--` between the arguments of several flights: a launch file that includes one after another.
"""
Launch = Callable[..., subprocess.Popen[str]]


@pytest.fixture
def prefix(tmp_path: Path) -> Path:
    """The package as ament finds it: installed, as far as launch needs that."""
    prefix = tmp_path / "prefix"
    marker = prefix / "share/ament_index/resource_index/packages/space_robot"
    marker.parent.mkdir(parents=True)
    marker.touch()
    (prefix / "share/space_robot").mkdir()
    for name in ("launch", "config"):
        (prefix / "share/space_robot" / name).symlink_to(ROOT / name)
    (prefix / "bin").mkdir()
    command = prefix / "bin/space-robot"
    command.write_text(f'#!/bin/sh\nexec {sys.executable} -m space_robot.cli.main "$@"\n')
    command.chmod(0o755)
    shutil.copytree(ROOT / "resource/executables", prefix / "lib/space_robot")
    return prefix


@pytest.fixture
def launch(prefix: Path, free_domain: int) -> Launch:
    """Launch a flight in a domain of its own."""

    def start(*words: str) -> subprocess.Popen[str]:
        found = [str(prefix), *filter(None, [os.environ.get("AMENT_PREFIX_PATH", "")])]
        environment = {
            **ros_environment(),
            "ROS_DOMAIN_ID": str(free_domain),
            "AMENT_PREFIX_PATH": os.pathsep.join(found),
            "ROS_LOG_DIR": str(prefix / "log"),
        }
        command = [sys.executable, "-c", RUN, str(ROOT / "launch/fly.launch.py"), *words]
        pipes: dict[str, Any] = {"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT}
        return subprocess.Popen(command, text=True, env=environment, cwd=prefix, **pipes)

    return start


def test_it_is_the_flight_of_fly(launch: Launch, tmp_path: Path) -> None:
    process = launch("duration:=0.2", "controller:=tde_tsmc", f"bag:={tmp_path / 'bag'}")
    output, _ = process.communicate(timeout=120)
    assert process.returncode == 0, output
    log = read_flight(tmp_path / "bag")
    assert difference(log, simulated(controller="tde_tsmc", duration=0.2), {"telemetry"}) == ""
    assert not any(log.lost.values())


@pytest.mark.parametrize(
    ("word", "said"),
    [("controller:=pid", "unknown controller 'pid'"), ("kase:=1", "unknown argument 'kase'")],
)
def test_bad_arguments_start_no_node(launch: Launch, word: str, said: str) -> None:
    process = launch(word)
    output, _ = process.communicate(timeout=60)
    assert process.returncode == 1
    assert said in output
    assert "process started" not in output


def test_a_node_that_dies_ends_it_with_an_error(launch: Launch, tmp_path: Path) -> None:
    process = launch(f"bag:={tmp_path / 'bag'}")
    assert process.stdout is not None
    lines = []
    for line in process.stdout:
        lines.append(line)
        if "[mission_node-2]: process started with pid" in line:
            pid = int(line.split("[")[-1].strip("]\n"))
        if "[plant_node]: nominal" in line:
            os.kill(pid, signal.SIGKILL)
    process.wait(timeout=60)
    assert process.returncode == 1, lines
    assert "mission_node ended with exit code -9" in "".join(lines)


def test_of_two_flights_each_goes_to_its_end(launch: Launch, tmp_path: Path) -> None:
    """In the namespace of their group; the launch ends with the last one."""
    bags = {name: tmp_path / name for name in ("sat1", "sat2")}
    one = ("namespace:=sat1", "duration:=0.2", f"bag:={bags['sat1']}")
    other = ("namespace:=/sat2", "duration:=0.6", f"bag:={bags['sat2']}")
    process = launch(*one, "--", *other)
    output, _ = process.communicate(timeout=240)
    assert process.returncode == 0, output
    assert [read_flight(bag).ticks for bag in bags.values()] == [400, 1200]
    assert "/fleet/sat1/joint_states" in open_bag(bags["sat1"]).topics()
    assert "/sat2/joint_states" in open_bag(bags["sat2"]).topics()


@pytest.mark.parametrize("words", [("play:=mine",), ()])
def test_rviz_has_simulated_time_and_there_is_one_clock(
    monkeypatch: pytest.MonkeyPatch, prefix: Path, words: tuple[str, ...]
) -> None:
    """RViz on the flight's /clock, or on that of the bag, which `ros2 bag play` plays as it is."""
    from launch import LaunchContext
    from launch.actions import ExecuteProcess
    from launch_ros.actions import Node
    from launch_ros.utilities import evaluate_parameters

    monkeypatch.setenv("AMENT_PREFIX_PATH", str(prefix))
    monkeypatch.setattr(sys, "argv", ["ros2", "launch", "space_robot", "view.launch.py", *words])
    view = runpy.run_path(str(ROOT / "launch/view.launch.py"))["view"]
    context = LaunchContext()
    play = words[0][6:] if words else ""
    context.launch_configurations.update({"viewer": "rviz", "play": play})
    rviz, *played = (action for action in view(context) if isinstance(action, ExecuteProcess))
    assert isinstance(rviz, Node)
    parameters = evaluate_parameters(context, rviz._Node__parameters)  # no public way
    assert parameters == ({"use_sim_time": True},)
    commands = [[part[0].text for part in action.cmd] for action in played]
    assert commands == ([["ros2", "bag", "play", "mine"]] if words else [])


@pytest.mark.parametrize(
    "file", sorted((ROOT / "launch").glob("*.launch.py")), ids=lambda p: p.name
)
def test_launch_reads_the_files(file: Path) -> None:
    """With every argument declared, each with a description and a default: none must be given."""
    from launch.launch_description_sources import get_launch_description_from_python_launch_file

    description = get_launch_description_from_python_launch_file(str(file))
    declared = {argument.name: argument for argument in description.get_launch_arguments()}
    assert declared
    for name, argument in declared.items():
        assert argument.default_value is not None, name
        assert len(argument.description) > 10, name
    assert {a.name for a in launch_arguments()} <= set(declared)
    own = {"fly.launch.py": set[str](), "view.launch.py": {"play", "viewer"}}[file.name]
    own |= {"autostart", "shutdown"}
    assert {a.name for a in launch_arguments()} == set(declared) - own
    shown = declared["controller"].default_value
    assert [part.describe() for part in shown] == ["'tde_stc'"]
