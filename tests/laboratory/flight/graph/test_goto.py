"""Segments and trajectories sent to a flight on the graph: followed without a jump, replayed."""

from __future__ import annotations

import json
import os
import re
import signal
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from flights import forked_space_robot, space_robot_here, wait_for_nodes
from forked import Forked

from space_robot_model.robot.find import find_robot
from space_robot_msgs_py import topics
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.bag.reader import read_flight
from space_robot_msgs_py.errors import FlightError
from space_robot_msgs_py.ros.locks import nodes_in
from space_robot_msgs_py.ros.process_environment import set_defaults

set_defaults()
pytest.importorskip("rclpy")

from space_robot.analysis.tool_error import leads_tool  # noqa: E402
from space_robot.flight.graph import simulation_calls  # noqa: E402
from space_robot.flight.graph.node_services import set_parameters  # noqa: E402
from space_robot.flight.graph.simulation_calls import go_to  # noqa: E402
from space_robot.flight.graph.temporary_node import TemporaryNode  # noqa: E402
from space_robot_msgs_py.ros.endpoints import message_type, qos  # noqa: E402

TIMEOUT_S = 60.0
STEP_TICKS = 1_000
DURATION = "4"


@contextmanager
def paused(domain: int, bag: Path, *more: str) -> Iterator[Forked]:
    """A flight that has flown some ticks of its mission, and is paused."""
    options = ("--duration", DURATION, "--domain", str(domain), "--bag", str(bag), "--json")
    process = forked_space_robot("fly", "--paused", *options, *more)
    try:
        wait_for_nodes(domain)
        until(lambda: sim(domain, "step", "--ticks", str(STEP_TICKS)) == 0)
        yield process
    finally:
        process.send_signal(signal.SIGINT)
        process.communicate(timeout=TIMEOUT_S)


def until(is_done: Callable[[], bool]) -> None:
    end = time.monotonic() + TIMEOUT_S
    while not is_done():
        assert time.monotonic() < end
        time.sleep(0.05)


def sim(domain: int, *words: str) -> int:
    return space_robot_here("sim", *words, "--domain", str(domain)).returncode


def flown(process: Forked, domain: int, bag: Path, said: str = "") -> FlightLog:
    """Let the flight go on to its end; the terminal has shown what is ``said``."""
    assert sim(domain, "resume") == 0
    output, errors = process.communicate(timeout=TIMEOUT_S)
    assert process.returncode == 0, errors
    assert said in errors
    assert not any(json.loads(output)["lost"].values())
    log = read_flight(bag)
    joints, base = log.reference_joints, log.reference_base
    mean = 0.5 * (joints[1:, 1] + joints[:-1, 1])
    steps = np.diff(joints[:, 0], axis=0) - mean * log.timebase.period
    assert np.abs(steps).max() < 1e-7
    assert np.abs(np.diff(joints[:, 1], axis=0)).max() < 1e-3
    assert np.abs(np.diff(base[:, :4], axis=0)).max() < 1e-3
    return log


def test_goto_moves_joints_and_base(free_domain: int, tmp_path: Path) -> None:
    bag = tmp_path / "bag"
    where = ("--domain", str(free_domain))
    goal = [1.0, 119.0, 219.0, 1.0, -9.0, 1.0]
    with paused(free_domain, bag) as process:
        refused = space_robot_here("goto", "--tool", "40,0,0", "--duration", "2", *where)
        assert refused.returncode == 1
        (line,) = refused.stderr.splitlines()
        assert "segment 1: the tool cannot follow its path beyond t = " in line
        words = ("--joints", ",".join(map(str, goal)), "--base", "0,0,0.5", "--duration", "0.5")
        moved = space_robot_here("goto", *words, *where)
        assert moved.returncode == 0, moved.stderr
        log = flown(process, free_domain, bag)
    robot = find_robot("paper")
    np.testing.assert_allclose(robot.to_degrees(log.reference_joints[-1, 0]), goal, atol=1e-9)
    assert leads_tool(log)
    assert log.reference_base[-1, 3] == pytest.approx(np.sin(np.radians(0.25)), rel=1e-12)
    replay = space_robot_here("replay", str(bag), "--json")
    assert replay.returncode == 0, replay.stderr


def test_goto_makes_the_base_point_with_the_orbit_of_the_plant(
    free_domain: int, tmp_path: Path
) -> None:
    bag, where = tmp_path / "bag", ("--domain", str(free_domain))
    with paused(free_domain, bag, "--orbit", "iss") as process:
        refused = space_robot_here("goto", "--base", "target", "--duration", "60", *where)
        assert refused.returncode == 1
        assert "base.point: target: flight software knows of no target" in refused.stderr
        words = ("--base", "nadir", "--tool", "0,0.1,0", "--frame", "orbit", "--duration", "60")
        moved = space_robot_here("goto", *words, *where)
        assert moved.returncode == 0, moved.stderr
        log = flown(process, free_domain, bag)
    rates = np.linalg.norm(log.reference_base[:, 4:7], axis=1)
    assert rates[-1] == rates.max() > 1e-5


REFUSED = (
    ("{hold: 1e9}", "less than or equal to 1000000"),
    ("{reactionless: {joints_deg: [1e300, 0, 0, 0, 0, 0]}, duration: 5}", "can be flown, got 1e"),
    ("{trajectory: {time: [0, 1], joint1: [0]}}", "column 'joint2' is missing"),
    ("{file: /etc/passwd}", "file: no file is read in flight"),
)


def test_what_cannot_be_flown_is_refused_and_the_flight_goes_on(
    free_domain: int, tmp_path: Path
) -> None:
    bag = tmp_path / "bag"
    with paused(free_domain, bag) as process:
        for segment, said in REFUSED:
            with pytest.raises(FlightError, match=re.escape(said)) as caught:
                go_to(segment, free_domain, "")
            assert "\n" not in str(caught.value)
        node = TemporaryNode("planner", free_domain)
        try:
            joints = find_robot("paper").joint_names
            for goal, seconds in ((1.0, 2**31 - 1), (1e308, 1), (np.nan, 1), (3.0, 0)):
                publish_trajectory(node, joints, np.full(6, goal), seconds, nanosec=1)
            go_to("{hold: 86400}", free_domain, "")
            log = flown(process, free_domain, bag)
        finally:
            node.leave()
    assert np.isfinite(log.reference_joints).all()


def test_a_mission_that_is_killed_is_not_waited_for(
    free_domain: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with paused(free_domain, tmp_path / "bag"):
        (name,) = (node.name for node in nodes_in(free_domain) if "mission" in node.name)
        pid = int(re.findall(r"pid (\d+)", name)[0])

        def killed_before(*arguments: Any) -> None:
            os.kill(pid, signal.SIGKILL)
            set_parameters(*arguments)

        monkeypatch.setattr(simulation_calls, "set_parameters", killed_before)
        with pytest.raises(FlightError, match="mission_node has gone"):
            go_to("{hold: 1}", free_domain, "")


def test_a_joint_trajectory_of_a_publisher_is_followed(free_domain: int, tmp_path: Path) -> None:
    bag = tmp_path / "bag"
    robot = find_robot("paper")
    goal = np.radians([2.0, 118.0, 221.0, -2.0, -12.0, 1.0])
    with paused(free_domain, bag) as process:
        node = TemporaryNode("planner", free_domain)
        try:
            publish_trajectory(node, robot.joint_names[:4], goal[:4])
            publish_trajectory(node, robot.joint_names[::-1], goal[::-1])
            refused = "mission_node: refused a trajectory: the trajectory lacks joint 'joint5'"
            log = flown(process, free_domain, bag, said=refused)
        finally:
            node.leave()
    np.testing.assert_allclose(log.reference_joints[-1, 0], goal, atol=1e-12)
    replay = space_robot_here("replay", str(bag), "--json")
    assert replay.returncode == 0, replay.stderr


def publish_trajectory(
    node: TemporaryNode,
    names: tuple[str, ...],
    goal: np.ndarray,
    seconds: int = 1,
    nanosec: int = 0,
) -> None:
    topic = topics.JOINT_TRAJECTORY
    kind = message_type(topic.type)
    point_type = message_type("trajectory_msgs/msg/JointTrajectoryPoint")
    publisher = node.node.create_publisher(kind, topic.name, qos(topic))
    until(lambda: publisher.get_subscription_count() > 0)
    point = point_type(positions=goal.tolist())
    point.time_from_start.sec, point.time_from_start.nanosec = seconds, nanosec
    publisher.publish(kind(joint_names=list(names), points=[point]))
    from rclpy.duration import Duration

    assert publisher.wait_for_all_acked(Duration(seconds=TIMEOUT_S))
