"""The base's standard messages, the scene, and what late listeners of a paused plant are told."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from space_robot_model.elementary.matrices import Array
from space_robot_model.robot import Robot
from space_robot_model.robot.urdf_text import urdf_text
from space_robot_msgs_py import topics
from space_robot_msgs_py.samples import Command, RobotState, Timebase
from space_robot_msgs_py.wire.definitions import decode
from space_robot_msgs_py.wire.viewers import unwrap
from space_robot_sim.plant.pacing import REPEAT_EVERY_S, REPEAT_FOR_S, LateListeners
from space_robot_sim.plant.plant import Plant
from space_robot_sim.plant.settings import PlantNodeSettings

pytest.importorskip("rclpy")

from space_robot_sim.plant import outputs
from space_robot_sim.plant.outputs import BaseOutput

PERIOD, CHECK_EVERY_S = 5e-4, 0.02


class Node:
    """A node in a namespace, and what it has published by topic."""

    def __init__(self, patch: pytest.MonkeyPatch, listeners: int = 1) -> None:
        self.sent: dict[str, list[Any]] = {}

        def publisher(_: object, topic: topics.Topic) -> SimpleNamespace:
            sent = self.sent.setdefault(topic.name, [])
            return SimpleNamespace(
                listener_count=listeners, publish=lambda data: sent.append(decode(data, topic.type))
            )

        patch.setattr(outputs, "RawPublisher", publisher)

    def get_namespace(self) -> str:
        return "/fleet/sat1"


def fly(
    node: Node, robot: Robot, ticks: int, thrusts: Sequence[float] = (), **settings: Any
) -> list[RobotState]:
    """Turn and move a base under constant torques and thrusts; return copies of its states."""
    start = {"initial_quaternion": [0.6, -0.5, 0.4, 0.3], "ticks": ticks}
    read = PlantNodeSettings.resolve({**start, **settings})
    plant, states = Plant(robot, read, PERIOD), []
    output = BaseOutput(node, read)  # type: ignore[arg-type]
    torque = np.array([90.0, -60.0, 40.0, 2.0, -1.0, 1.5, 0.1, 0.1, 0.1])
    for tick in range(ticks + 1):
        states.append(plant.state.copy())
        output.send(plant.state)
        plant.step(Command(tick, np.append(torque, thrusts)))
    return states


def xyz(vector: Any) -> Array:
    return np.array([vector.x, vector.y, vector.z])


def stamp(message: Any) -> int:
    return round((message.header.stamp.sec + message.header.stamp.nanosec * 1e-9) / PERIOD)


def test_the_bases_messages_are_right_by_the_motion_that_they_show(
    paper_robot: Robot, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Pose in its parent frame, twist in its child frame (REP 105), by differences of the poses.

    The wrench is that applied, and the IMU tells no acceleration.
    """
    node = Node(monkeypatch)
    states = fly(node, paper_robot, 400)
    odometry, frame = node.sent["base/odometry"], "fleet/sat1/base_link"
    assert [stamp(m) for m in odometry] == list(range(0, 401, 20))
    assert {(m.header.frame_id, m.child_frame_id) for m in odometry} == {("inertial", frame)}
    for message in odometry[1:-1]:
        tick = stamp(message)
        before, state, after = states[tick - 1 : tick + 2]
        pose, twist = message.pose.pose, message.twist.twist
        turn = Rotation.from_quat([*xyz(pose.orientation), pose.orientation.w])
        np.testing.assert_array_equal(xyz(pose.position), state.base_position)
        velocity = (after.base_position - before.base_position) / (2 * PERIOD)
        np.testing.assert_allclose(xyz(twist.linear), turn.inv().apply(velocity), atol=1e-7)
        turns = [Rotation.from_quat(s.quaternion[[1, 2, 3, 0]]) for s in (before, after)]
        omega = (turns[0].inv() * turns[1]).as_rotvec() / (2 * PERIOD)
        np.testing.assert_allclose(xyz(twist.angular), omega, atol=1e-6)
    assert np.linalg.norm(xyz(twist.linear)) > 1e-4
    assert np.linalg.norm(xyz(twist.angular)) > 1e-3
    for message in node.sent["base/imu"]:
        state, q = states[stamp(message)], message.orientation
        assert message.header.frame_id == frame
        np.testing.assert_array_equal(xyz(message.angular_velocity), state.omega_base)
        np.testing.assert_array_equal([q.w, q.x, q.y, q.z], state.quaternion)
        assert message.linear_acceleration_covariance[0] == -1.0
        assert not xyz(message.linear_acceleration).any()
    first, *others = node.sent["base/wrench"]
    assert not xyz(first.wrench.torque).any()
    for message in others:
        assert message.header.frame_id == frame
        np.testing.assert_array_equal(xyz(message.wrench.torque), [90.0, -60.0, 40.0])
        assert not xyz(message.wrench.force).any()


def test_open_thrusters_push_the_base(paper_robot: Robot, monkeypatch: pytest.MonkeyPatch) -> None:
    node = Node(monkeypatch)
    thrusts = [4.5, *[0.0] * 11]  # of the first, at y = 1 m along z
    states = fly(node, paper_robot, 100, thrusts, actuators="thrusters")
    wrench = node.sent["base/wrench"][-1].wrench
    np.testing.assert_allclose(xyz(wrench.force), [0.0, 0.0, 4.5])
    np.testing.assert_allclose(xyz(wrench.torque), [4.5, 0.0, 0.0])
    assert np.linalg.norm(states[-1].base_velocity) > 0.0


@pytest.mark.parametrize(
    ("settings", "listeners", "ticks"),
    [
        ({"base_topics_rate": 0.0}, 1, []),
        ({"base_topics_rate": 1000.0}, 1, list(range(0, 41, 2))),
        ({"base_topics_rate": 1e6}, 1, list(range(41))),
        ({}, 0, []),
    ],
)
def test_the_rate_is_in_simulated_time_and_only_for_subscribers(
    paper_robot: Robot,
    monkeypatch: pytest.MonkeyPatch,
    settings: dict[str, float],
    listeners: int,
    ticks: list[int],
) -> None:
    node = Node(monkeypatch, listeners)
    fly(node, paper_robot, 40, **settings)
    assert [stamp(message) for message in node.sent.get("base/imu", [])] == ticks


ALL = {"tf2_msgs", "visualization_msgs"}


@pytest.mark.parametrize("installed", [set(), {"tf2_msgs"}, {"visualization_msgs"}, ALL])
def test_viewers_are_sent_what_they_can_show(
    paper_robot: Robot, monkeypatch: pytest.MonkeyPatch, installed: set[str]
) -> None:
    """To the recorder in any case, 100 times a simulated second; what stands still, to viewers."""
    sent: dict[str, list[bytes]] = {}
    marked: list[str] = []

    def publisher(_: object, topic: topics.Topic) -> SimpleNamespace:
        return SimpleNamespace(publish=sent.setdefault(topic.name, []).append)

    def markers(*_: object) -> SimpleNamespace:
        return SimpleNamespace(
            outputs=("the markers",),
            send=lambda truth: marked.append(f"sent {truth.tick}"),
            show=lambda truth: marked.append(f"shown {truth.tick}"),
        )

    monkeypatch.setattr(outputs, "RawPublisher", publisher)
    monkeypatch.setattr(outputs, "MarkerOutput", markers)
    monkeypatch.setattr(outputs, "find_spec", lambda name: name in installed or None)
    node: Any = SimpleNamespace(get_namespace=lambda: topics.ROOT)
    output = outputs.SceneOutput(node, paper_robot, Timebase(500_000))
    has_tf, has_markers = "tf2_msgs" in installed, "visualization_msgs" in installed
    assert (len(output.outputs), len(output.viewed)) == (3, 2 * has_tf + has_markers)
    for _ in range(2):
        output.begin()
    lasting = {"robot_description": 1, "_transforms": 0, "_transforms/static": 1}
    counts = {name: len(messages) for name, messages in sent.items()}
    assert counts == lasting | ({"/tf": 0, "/tf_static": 1} if has_tf else {})
    text = decode(sent["robot_description"][0], topics.ROBOT_DESCRIPTION.type).data
    assert text.rstrip("\n") == urdf_text(paper_robot).rstrip("\n")
    (tool,) = decode(unwrap(sent["_transforms/static"][0]), topics.TF_STATIC.type).transforms
    assert (tool.header.frame_id, tool.child_frame_id) == ("link6", "tool")
    truth = RobotState.allocate(paper_robot.n)
    truth.quaternion[0] = 1.0
    for truth.tick in range(41):
        output.send(truth)
    output.show(truth)
    assert len(sent["_transforms"]) == 3
    if has_tf:
        own = [unwrap(data) for data in sent["_transforms"]]
        assert sent["/tf"] == [*own, own[-1]]
        assert sent["/tf_static"] == [unwrap(sent["_transforms/static"][0])]
    expected = [*(f"sent {tick}" for tick in range(41)), "shown 40"]
    assert marked == (expected if has_markers else [])


@dataclass
class Output:
    listener_count: int


def times(late: LateListeners, start: float, stop: float) -> list[float]:
    """When a paused plant repeats its messages, between two times."""
    return [float(now) for now in np.arange(start, stop, CHECK_EVERY_S) if late.are_due(float(now))]


@pytest.mark.parametrize("which", [0, 1])
def test_messages_are_repeated_for_those_who_join_and_for_nobody_else(which: int) -> None:
    outputs = [Output(2), Output(1)]
    late = LateListeners(outputs)
    late.begin()
    assert times(late, 1.0, 3.0) == []
    outputs[which].listener_count += 1
    outputs[1 - which].listener_count -= 1
    repeated = times(late, 3.0, 10.0)
    assert repeated[0] == 3.0, "at once, though another has left"
    assert np.diff(repeated) == pytest.approx(REPEAT_EVERY_S, abs=CHECK_EVERY_S)
    assert repeated[-1] < 3.0 + REPEAT_FOR_S
    assert len(repeated) == round(REPEAT_FOR_S / REPEAT_EVERY_S)
    outputs[which].listener_count -= 1
    assert times(late, 10.0, 12.0) == [], "who leaves needs nothing"
    outputs[which].listener_count += 1
    assert times(late, 12.0, 12.1) == [12.0], "who joins again does"
    late = LateListeners(outputs)
    late.begin()
    outputs[which].listener_count += 1
    late.begin()
    assert times(late, 13.0, 14.0) == [], "who joined while the plant ran has had its messages"
