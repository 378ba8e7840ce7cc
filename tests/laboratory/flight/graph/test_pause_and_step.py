"""A graph that is paused, stepped, reset, and sent elsewhere in flight: `sim` and `goto`.

Its bag is that of an undisturbed flight; what is sent is followed without a jump, or refused.
"""

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
from bags import messages_of
from flights import forked_space_robot, planned, space_robot_here, wait_for_nodes
from forked import Forked

from space_robot.analysis.tool_error import leads_tool
from space_robot.flight.simulate import simulate
from space_robot_model.robot.find import find_robot
from space_robot_msgs_py import topics
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.bag.reader import read_flight
from space_robot_msgs_py.errors import FlightError
from space_robot_msgs_py.ros.locks import nodes_in
from space_robot_msgs_py.ros.process_environment import set_defaults
from space_robot_msgs_py.wire.cdr import header_stamp_ns
from space_robot_msgs_py.wire.definitions import decode

set_defaults()
pytest.importorskip("rclpy")

from ground import Ground  # noqa: E402

from space_robot.flight.graph import simulation_calls  # noqa: E402
from space_robot.flight.graph.node_services import set_parameters  # noqa: E402
from space_robot.flight.graph.simulation_calls import go_to  # noqa: E402
from space_robot.flight.graph.temporary_node import TemporaryNode  # noqa: E402
from space_robot_msgs_py.ros.endpoints import (  # noqa: E402
    PolledCallbackGroup,
    RawSubscription,
    message_type,
    qos,
)

IMPATIENT = tuple(
    word
    for name in (
        "plant.silence_timeout",
        "controller.state_timeout",
        "controller.reference_timeout",
    )
    for word in ("--set", f"{name}=0.3")
)
LONGER_THAN_ANY_WATCHDOG_S = 1.0
TIMEOUT_S = 60.0
SAME = (
    topics.JOINT_STATES,
    topics.BASE_STATE,
    topics.COMMAND,
    topics.CLOCK,
    topics.TELEMETRY,
    topics.LAW,
)


@contextmanager
def flying(domain: int, bag: Path, *options: str) -> Iterator[Forked]:
    """``fly --json`` in a domain, begun paused; ended if it is left before its end."""
    where = ("--domain", str(domain), "--bag", str(bag))
    process = forked_space_robot("fly", "--paused", *where, *options, "--json")
    try:
        wait_for_nodes(domain)
        yield process
    finally:
        process.send_signal(signal.SIGINT)
        process.communicate(timeout=TIMEOUT_S)


def sim(domain: int, *words: str) -> str:
    """``space-robot sim``, as soon as the plant is active; what it says."""
    until = time.monotonic() + TIMEOUT_S
    while True:
        result = space_robot_here("sim", *words, "--domain", str(domain))
        if result.returncode == 0:
            return result.stdout.strip()
        is_early = "is a graph flying" in result.stderr or "is not active" in result.stderr
        assert is_early, result.stderr
        assert time.monotonic() < until, result.stderr


def sent(bag: Path) -> dict[topics.Topic, list[bytes]]:
    found: dict[topics.Topic, list[bytes]] = {topic: [] for topic in SAME}
    for topic, data in messages_of(bag):
        if topic in found:
            found[topic].append(data)
    return found


def test_pauses_steps_and_a_reset_leave_no_trace(free_domain: int, tmp_path: Path) -> None:
    """In four processes. The flight that was reset has a bag of its own."""
    bag, domain = tmp_path / "bag", free_domain
    with flying(domain, bag, "--duration", "0.2", *IMPATIENT) as process:
        assert sim(domain, "step", "--ticks", "150") == "stepped to tick 150 (0.0750 s)"
        assert sim(domain, "reset") == "reset, paused at tick 0 (0.0000 s)"
        assert sim(domain, "step") == "stepped to tick 1 (0.0005 s)"
        assert sim(domain, "step", "--ticks", "99") == "stepped to tick 100 (0.0500 s)"
        assert sim(domain, "pause") == "already paused at tick 100 (0.0500 s)"
        time.sleep(LONGER_THAN_ANY_WATCHDOG_S)
        assert sim(domain, "resume") == "goes on at tick 100 (0.0500 s)"
        output, errors = process.communicate(timeout=TIMEOUT_S)
    assert process.returncode == 0, errors
    report = json.loads(output)
    assert report["ticks"] == 400
    assert not any(report["lost"].values())
    graph = report["graph"]
    assert graph["events"] == [], "a pause is no silence"
    assert (graph["failures"], graph["warnings"]) == ([], [])
    assert graph["nodes"]["plant_node"]["missed_deadlines"] == "0"
    simulate(planned(duration=0.2), tmp_path / "simulated")
    here, there = sent(bag), sent(tmp_path / "simulated")
    for topic in SAME:
        assert here[topic] == there[topic], topic.full_name
        assert here[topic], topic.full_name
    before = read_flight(tmp_path / "bag_before_reset_1")
    assert before.ticks == 151, "ticks 0 to 150 have been measured and answered"
    assert not any(before.lost.values())


@pytest.mark.parametrize("number", [signal.SIGQUIT, None])
def test_a_paused_flight_is_seen_late_and_ended_by_a_signal_or_in_a_step(
    free_domain: int, tmp_path: Path, number: signal.Signals | None
) -> None:
    """Tick 45 has no message of its own on /clock and /markers: shown is the clock of tick 40."""
    bag, heard = tmp_path / "bag", {}
    viewed = (topics.CLOCK, topics.JOINT_STATES, topics.MARKERS)
    with flying(free_domain, bag, "--duration", "0.05", "--composed") as process:
        sim(free_domain, "step", "--ticks", "45")
        viewer = Ground(free_domain)
        inputs = {t: RawSubscription(viewer.node, t, PolledCallbackGroup()) for t in viewed}

        def hears_all() -> bool:
            heard.update({t: d for t in viewed if (d := inputs[t].take()) is not None})
            return len(heard) == len(viewed)

        viewer.until(hears_all, "messages while the plant is paused")
        viewer.close()
        if number:
            process.send_signal(number)
        else:
            result = space_robot_here("sim", "step", "--ticks", "500", "--domain", str(free_domain))
            assert result.returncode == 1
            (line,) = result.stderr.splitlines()
            assert "the step ended at tick 100 of 545" in line
        _, errors = process.communicate(timeout=TIMEOUT_S)
    assert process.returncode == (128 + number if number else 0), errors
    log = read_flight(bag)
    assert log.ticks == (46 if number else 100), "ticks 0 to 45 have been measured and answered"
    assert not any(log.lost.values())
    assert header_stamp_ns(heard[topics.CLOCK]) == 40 * 500_000
    joints = decode(heard[topics.JOINT_STATES], topics.JOINT_STATES.type)
    assert joints.header.stamp.nanosec == 45 * 500_000
    assert list(joints.position) == log.joint_positions[45].tolist()


# Sent elsewhere

REFUSED = (
    ("{hold: 1e9}", "less than or equal to 1000000"),
    ("{reactionless: {joints_deg: [1e300, 0, 0, 0, 0, 0]}, duration: 5}", "can be flown, got 1e"),
    ("{trajectory: {time: [0, 1], joint1: [0]}}", "column 'joint2' is missing"),
    ("{file: /etc/passwd}", "file: no file is read in flight"),
    ("{base: target, duration: 60}", "base"),
    ("{tool: {xyz: [40, 0, 0]}, duration: 2}", "the tool cannot follow its path beyond t = "),
)


def until(is_done: Callable[[], bool]) -> None:
    end = time.monotonic() + TIMEOUT_S
    while not is_done():
        assert time.monotonic() < end
        time.sleep(0.02)


def flown(process: Forked, domain: int, bag: Path, said: str = "") -> FlightLog:
    """Let the flight go on to its end; its reference has no jump."""
    sim(domain, "resume")
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


def test_goto_moves_joints_and_base_and_what_cannot_be_flown_is_refused(
    free_domain: int, tmp_path: Path
) -> None:
    bag = tmp_path / "bag"
    goal = [1.0, 119.0, 219.0, 1.0, -9.0, 1.0]
    with flying(free_domain, bag, "--duration", "3.4", "--composed") as process:
        sim(free_domain, "step", "--ticks", "200")
        for segment, said in REFUSED:
            with pytest.raises(FlightError, match=re.escape(said)) as caught:
                go_to(segment, free_domain, "")
            assert "\n" not in str(caught.value)
        words = ("--joints", ",".join(map(str, goal)), "--base", "0,0,0.5", "--duration", "0.5")
        moved = space_robot_here("goto", *words, "--domain", str(free_domain))
        assert moved.returncode == 0, moved.stderr
        log = flown(process, free_domain, bag)
    robot = find_robot("paper")
    np.testing.assert_allclose(robot.to_degrees(log.reference_joints[-1, 0]), goal, atol=1e-9)
    assert leads_tool(log)
    assert log.reference_base[-1, 3] == pytest.approx(np.sin(np.radians(0.25)), rel=1e-12)


def test_a_joint_trajectory_of_a_publisher_is_followed(free_domain: int, tmp_path: Path) -> None:
    """Those that are nonsense, or lack a joint, are refused and leave the flight as it was."""
    bag, robot = tmp_path / "bag", find_robot("paper")
    names = robot.joint_names
    goal = np.radians([1.0, 119.0, 220.5, -1.0, -11.0, 0.5])
    with flying(free_domain, bag, "--duration", "3", "--composed") as process:
        sim(free_domain, "step", "--ticks", "200")
        node = TemporaryNode("planner", free_domain)
        try:
            for target, seconds in ((1.0, 2**31 - 1), (1e308, 1), (np.nan, 1), (3.0, 0)):
                publish_trajectory(node, names, np.full(6, target), seconds, nanosec=1)
            publish_trajectory(node, names[:4], goal[:4])
            publish_trajectory(node, names[::-1], goal[::-1])
            said = "mission_node: refused a trajectory: the trajectory lacks joint 'joint5'"
            log = flown(process, free_domain, bag, said)
        finally:
            node.leave()
    assert np.isfinite(log.reference_joints).all()
    np.testing.assert_allclose(log.reference_joints[-1, 0], goal, atol=1e-12)


def publish_trajectory(
    node: TemporaryNode,
    names: tuple[str, ...],
    goal: np.ndarray,
    seconds: int = 1,
    nanosec: int = 0,
) -> None:
    from rclpy.duration import Duration

    topic = topics.JOINT_TRAJECTORY
    kind = message_type(topic.type)
    point_type = message_type("trajectory_msgs/msg/JointTrajectoryPoint")
    publisher = node.node.create_publisher(kind, topic.name, qos(topic))
    until(lambda: publisher.get_subscription_count() > 0)
    point = point_type(positions=goal.tolist())
    point.time_from_start.sec, point.time_from_start.nanosec = seconds, nanosec
    publisher.publish(kind(joint_names=list(names), points=[point]))
    assert publisher.wait_for_all_acked(Duration(seconds=TIMEOUT_S))


def test_a_mission_that_is_killed_is_not_waited_for(
    free_domain: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with flying(free_domain, tmp_path / "bag", "--duration", "1"):
        sim(free_domain, "step")
        (name,) = (node.name for node in nodes_in(free_domain) if "mission" in node.name)
        pid = int(re.findall(r"pid (\d+)", name)[0])

        def killed_before(*arguments: Any) -> None:
            os.kill(pid, signal.SIGKILL)
            set_parameters(*arguments)

        monkeypatch.setattr(simulation_calls, "set_parameters", killed_before)
        with pytest.raises(FlightError, match="mission_node has gone"):
            go_to("{hold: 1}", free_domain, "")
