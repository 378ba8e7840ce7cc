"""``fly --composed``: the same nodes in one process, on the real middleware, with the same bits.

With faults, too: `test_fault_matrix` flies the same ones in one process and in four.
"""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from flights import COMMAND, Flown, ros_environment, space_robot_here

from space_robot.flight.plan import Flight, FlightPlan, resolve
from space_robot.flight.simulate import simulate
from space_robot_msgs_py import topics
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.bag.folder import open_bag
from space_robot_msgs_py.bag.reader import read_flight
from space_robot_msgs_py.errors import InputError

pytest.importorskip("rclpy")

SHORT = ("--duration", "0.5")
SWAP = ("--swap", "0.1:ctc", "--swap", "0.3:tde_smc")
STATES_AND_COMMANDS = (topics.JOINT_STATES, topics.BASE_STATE, topics.COMMAND)
COLUMNS = (
    "base_position",
    "quaternion",
    "base_velocity",
    "omega_base",
    "joint_positions",
    "joint_velocities",
    "applied_torque",
    "reference_joints",
    "reference_base",
)
NODES = {"recorder_node", "mission_node", "controller_node", "plant_node"}


def messages(bag: Path, topic: topics.Topic) -> list[bytes]:
    return [data for _, data in open_bag(bag).messages(topic)]


def assert_same_columns(one: FlightLog, other: FlightLog) -> None:
    for column in COLUMNS:
        np.testing.assert_array_equal(getattr(one, column), getattr(other, column), column)


def test_it_is_the_flight_of_four_processes_and_of_none(fly: Callable[..., Flown]) -> None:
    """With two swaps of laws; states and commands to the last byte, the report to the last bit."""
    composed, processes = fly(*SHORT, *SWAP, "--composed"), fly(*SHORT, *SWAP)
    for topic in STATES_AND_COMMANDS:
        assert messages(composed.bag, topic) == messages(processes.bag, topic), topic.full_name
    swaps = ["0.1:ctc", "0.3:tde_smc"]
    log = simulate(Flight(resolve(FlightPlan(swaps=swaps, duration=0.5))))
    assert_same_columns(read_flight(composed.bag), log)
    here, there = dict(composed.bag_report), dict(processes.bag_report)
    for report in (here, there):
        del report["latency"]  # of the wall clock
    assert here == there


def test_the_report_tells_of_all_nodes_and_nothing_is_lost(fly: Callable[..., Flown]) -> None:
    report = fly(*SHORT, *SWAP, "--composed").report
    graph = report["graph"]
    assert set(graph["nodes"]) == NODES
    assert graph["nodes"]["plant_node"]["tick"] == "1000"
    assert graph["nodes"]["controller_node"]["sent /command"] == "1000"
    assert (graph["failures"], graph["warnings"], graph["restarts"]) == ([], [], 0)
    assert not any(report["lost"].values())


def test_by_the_wall_clock_every_tick_is_flown(fly: Callable[..., Flown]) -> None:
    flown = fly("--duration", "2", "--composed", "--realtime")
    assert flown.report["ticks"] == 4000
    assert not any(flown.report["lost"].values())
    assert flown.report["rms"]["mean_axis"]["attitude"] < 1e-3


@pytest.mark.parametrize(
    ("options", "asked"),
    [
        (("--fault", "kill_controller@1"), "fault kill_controller@1"),
        (("--fault", "stop_recorder@1:2"), "fault stop_recorder@1:2"),
        (("--restart-controller",), "restart_controller"),
    ],
)
def test_what_needs_processes_is_refused_in_one_line(
    options: tuple[str, ...], asked: str, tmp_path: Path
) -> None:
    result = space_robot_here("fly", "--composed", *options, "--bag", str(tmp_path / "bag"))
    assert (result.returncode, result.stdout) == (2, "")
    (line,) = result.stderr.splitlines()
    assert asked in line
    assert "fly without --composed" in line
    assert not (tmp_path / "bag").exists()


def test_plans_are_refused_likewise() -> None:
    with pytest.raises(InputError, match=re.escape("kill_mission@1")):
        Flight(resolve(FlightPlan(composed=True, faults=["kill_mission@1"])))


def test_a_flight_that_diverges_ends_with_the_tick(tmp_path: Path) -> None:
    bag = tmp_path / "bag"
    gains = ("--controller", "ctc", "--gains", "printed")
    result = space_robot_here("fly", "--composed", *SHORT, *gains, "--bag", str(bag), "--json")
    assert result.returncode == 1, result.stderr
    assert "Traceback" not in result.stderr
    report = json.loads(result.stdout)
    assert report["diverged"], result.stderr
    assert report["diverged"]["tick"] == report["ticks"] == 11
    assert (report["outcome"], report["ended_at_s"]) == ("diverged", 0.0055)


def test_ctrl_c_closes_the_bag_and_leaves_no_process(tmp_path: Path) -> None:
    bag = tmp_path / "bag"
    command = [*COMMAND, "fly", "--composed", "--bag", str(bag)]
    process = subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=ros_environment()
    )
    try:
        file, until = bag / "bag_0.mcap", time.monotonic() + 100.0
        while not (file.exists() and file.stat().st_size > 2_000_000):
            assert process.poll() is None
            assert time.monotonic() < until
            time.sleep(0.02)
        children = Path(f"/proc/{process.pid}/task/{process.pid}/children").read_text().split()
        process.send_signal(signal.SIGINT)
        _, errors = process.communicate(timeout=60)
    finally:
        process.kill()
    assert process.returncode == 130, errors
    assert (bag / "metadata.yaml").exists(), errors
    log = read_flight(bag)
    assert log.ticks > 100
    assert not any(log.lost.values())
    assert len(children) == 1
    assert not any(_is_alive(int(child)) for child in children)


def _is_alive(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    return True
