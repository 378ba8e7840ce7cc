"""A graph that is paused, stepped, reset, and sent elsewhere in flight: `sim` and `goto`.

Its bag is that of an undisturbed flight; what is sent is followed without a jump, or refused.
"""

from __future__ import annotations

import json
import re
import time
from collections import defaultdict
from pathlib import Path

import numpy as np
import pytest
from bags import messages_of
from flights import PausedFlight, simulated, space_robot_here

from space_robot.analysis.tool_path import leads_tool
from space_robot_model.robot.find import find_robot
from space_robot_msgs_py import topics
from space_robot_msgs_py.bag.reader import read_flight
from space_robot_msgs_py.errors import FlightError
from space_robot_msgs_py.ros.process import set_defaults
from space_robot_msgs_py.wire.cdr import header_stamp_ns
from space_robot_msgs_py.wire.definitions import decode

set_defaults()
pytest.importorskip("rclpy")

from ground import Ground  # noqa: E402
from rclpy.duration import Duration  # noqa: E402

from space_robot.flight.graph.node_services import go_to  # noqa: E402
from space_robot_msgs_py.ros.endpoints import (  # noqa: E402
    PolledCallbackGroup,
    RawSubscription,
    message_type,
    qos,
)

WATCHDOGS = ("plant.silence_timeout", "controller.state_timeout", "controller.reference_timeout")
IMPATIENT = tuple(word for name in WATCHDOGS for word in ("--set", f"{name}=0.3"))
LONGER_THAN_ANY_WATCHDOG_S = 0.6
TIMEOUT_S = 240.0
SAME = (
    topics.JOINT_STATES,
    topics.BASE_STATE,
    topics.COMMAND,
    topics.CLOCK,
    topics.TELEMETRY,
    topics.LAW,
)


def sent(bag: Path) -> dict[topics.Topic, list[bytes]]:
    found = defaultdict(list)
    for topic, data in messages_of(bag):
        if topic in SAME:
            found[topic].append(data)
    return found


def test_pauses_steps_and_a_reset_leave_no_trace(
    free_domain: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In four processes. The flight that was reset has a bag of its own."""
    options = ("--duration", "0.2", "--json", *IMPATIENT)
    flight = PausedFlight(tmp_path / "bag", free_domain, *options)
    assert flight.sim("step", "--ticks", "150") == "stepped to tick 150 (0.0750 s)"
    assert flight.sim("reset") == "reset, paused at tick 0 (0.0000 s)"
    assert flight.sim("step") == "stepped to tick 1 (0.0005 s)"
    assert flight.sim("step", "--ticks", "99") == "stepped to tick 100 (0.0500 s)"
    assert flight.sim("pause") == "already paused at tick 100 (0.0500 s)"
    time.sleep(LONGER_THAN_ANY_WATCHDOG_S)
    assert flight.sim("resume") == "goes on at tick 100 (0.0500 s)"
    code, output, errors = flight.end()
    assert code == 0, errors
    report = json.loads(output)
    assert report["ticks"] == 400
    assert not any(report["lost"].values())
    graph = report["graph"]
    assert graph["events"] == [], "a pause is no silence"
    assert (graph["failures"], graph["warnings"]) == ([], [])
    assert graph["nodes"]["plant_node"]["missed_deadlines"] == "0"
    simulated(tmp_path / "simulated", duration=0.2)
    here, there = sent(flight.bag), sent(tmp_path / "simulated")
    assert here.keys() == {*SAME}
    for topic in SAME:
        assert here[topic] == there[topic], topic.full_name
    before = read_flight(tmp_path / "bag_before_reset_1")
    assert before.ticks == 151, "ticks 0 to 150 have been measured and answered"
    assert not any(before.lost.values())
    monkeypatch.setattr("space_robot.flight.graph.node_services.FIND_S", 0.0)
    assert "no service /plant_node/pause in ROS domain" in flight.sim("pause", code=2)


def test_a_paused_flight_is_seen_late_and_ended_in_a_step(free_domain: int, tmp_path: Path) -> None:
    """Tick 45 has no message of its own on /clock and /markers: shown is the clock of tick 40."""
    heard = {}
    viewed = (topics.CLOCK, topics.JOINT_STATES, topics.MARKERS)
    flight = PausedFlight(tmp_path / "bag", free_domain, "--duration", "0.05", "--composed")
    flight.sim("step", "--ticks", "45")
    viewer = Ground(free_domain)
    inputs = {t: RawSubscription(viewer.node, t, PolledCallbackGroup()) for t in viewed}

    def hears_all() -> bool:
        heard.update({t: d for t in viewed if (d := inputs[t].take()) is not None})
        return len(heard) == len(viewed)

    viewer.until(hears_all, "messages while the plant is paused")
    viewer.close()
    said = flight.sim("step", "--ticks", "500", code=1)
    assert "the step ended at tick 100 of 545" in said
    code, _, errors = flight.end()
    assert code == 0, errors
    log = read_flight(flight.bag)
    assert log.ticks == 100
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


class Planner(Ground):
    """Sends trajectories of the joints."""

    def publish(
        self, names: tuple[str, ...], goal: np.ndarray, seconds: int = 1, nanosec: int = 0
    ) -> None:
        topic = topics.JOINT_TRAJECTORY
        kind = message_type(topic.type)
        point = message_type("trajectory_msgs/msg/JointTrajectoryPoint")(positions=goal.tolist())
        point.time_from_start.sec, point.time_from_start.nanosec = seconds, nanosec
        publisher = self.node.create_publisher(kind, topic.name, qos(topic))
        self.until(lambda: publisher.get_subscription_count() > 0, "the mission")
        publisher.publish(kind(joint_names=list(names), points=[point]))
        assert publisher.wait_for_all_acked(Duration(seconds=TIMEOUT_S))


def test_segments_and_trajectories_are_followed_and_what_cannot_be_flown_is_refused(
    free_domain: int, tmp_path: Path
) -> None:
    """The flight is left as it was by what is refused; its reference has no jump."""
    robot = find_robot("paper")
    names = robot.joint_names
    gone_to, planned = [1.0, 119.0, 219.0, 1.0, -9.0, 1.0], [1.0, 119.0, 220.5, -1.0, -11.0, 0.5]
    options = ("--period", "0.002", "--duration", "4.5", "--set", "mission.lead_ticks=100")
    flight = PausedFlight(tmp_path / "bag", free_domain, *options, "--composed", "--json")
    flight.sim("step", "--ticks", "50")
    for segment, said in REFUSED:
        with pytest.raises(FlightError, match=re.escape(said)) as caught:
            go_to(segment, free_domain, "")
        assert "\n" not in str(caught.value)
    words = ("--joints", ",".join(map(str, gone_to)), "--base", "0,0,0.5", "--duration", "0.5")
    moved = space_robot_here("goto", *words, "--domain", str(free_domain))
    assert moved.returncode == 0, moved.stderr
    flight.sim("step", "--ticks", "1530")
    planner = Planner(free_domain)
    planner.publish(names[:4], np.zeros(4))
    refused = "refused a trajectory: the trajectory lacks joint 'joint5'"
    planner.until(lambda: planner.value("mission", "trajectories refused") == 1, refused)
    for target, seconds in ((1.0, 2**31 - 1), (1e308, 1), (np.nan, 1), (3.0, 0)):
        planner.publish(names, np.full(6, target), seconds, nanosec=1)
    planner.publish(names[::-1], np.radians(planned)[::-1])
    flight.sim("resume")
    code, output, errors = flight.end()
    planner.close()
    assert code == 0, errors
    assert f"mission_node: {refused}" in errors
    assert not any(json.loads(output)["lost"].values())
    log = read_flight(flight.bag)
    joints, base = log.reference_joints, log.reference_base
    mean = 0.5 * (joints[1:, 1] + joints[:-1, 1])
    steps = np.diff(joints[:, 0], axis=0) - mean * log.timebase.period
    assert np.abs(steps).max() < 1e-6
    assert np.abs(np.diff(joints[:, 1], axis=0)).max() < 4e-3
    assert np.abs(np.diff(base[:, :4], axis=0)).max() < 4e-3
    moved_at = joints[1_580, 0]
    np.testing.assert_allclose(robot.to_degrees(moved_at), gone_to, atol=1e-9)
    assert base[-1, 3] == pytest.approx(np.sin(np.radians(0.25)), rel=1e-12)
    assert leads_tool(log)
    np.testing.assert_allclose(robot.to_degrees(joints[-1, 0]), planned, atol=1e-9)
