"""The base's standard messages: each in one frame, right by the motion that it shows."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from space_robot_model.robot import Robot
from space_robot_msgs_py import topics
from space_robot_msgs_py.samples import Command
from space_robot_msgs_py.wire.definitions import decode
from space_robot_sim.plant.plant import Plant
from space_robot_sim.plant.settings import PlantNodeSettings

pytest.importorskip("rclpy")

from space_robot_sim.plant import base_output
from space_robot_sim.plant.base_output import BaseOutput

Array = NDArray[np.float64]
QUATERNION = [0.6, -0.5, 0.4, 0.3]
PERIOD = 5e-4


class Node:
    """A node in a namespace, and what it has published by topic."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, listeners: int = 1) -> None:
        self.sent: dict[str, list[Any]] = {}
        node = self

        class Publisher:
            listener_count = listeners

            def __init__(self, _: object, topic: topics.Topic) -> None:
                self._topic = topic

            def publish(self, data: bytes) -> None:
                node.sent.setdefault(self._topic.name, []).append(decode(data, self._topic.type))

        monkeypatch.setattr(base_output, "RawPublisher", Publisher)

    def get_namespace(self) -> str:
        return "/fleet/sat1"


def fly(
    node: Node, robot: Robot, ticks: int, thrusts: Sequence[float] = (), **settings: Any
) -> list[Any]:
    """Turn and move a base under constant torques and thrusts; return copies of its states."""
    read = PlantNodeSettings.resolve({"initial_quaternion": QUATERNION, "ticks": ticks, **settings})
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


def rotation(quaternion: Any) -> Rotation:
    return Rotation.from_quat([*xyz(quaternion), quaternion.w])


def stamp(message: Any) -> int:
    return round((message.header.stamp.sec + message.header.stamp.nanosec * 1e-9) / PERIOD)


def test_odometry_is_the_pose_in_its_parent_frame_and_the_twist_in_its_child_frame(
    paper_robot: Robot, monkeypatch: pytest.MonkeyPatch
) -> None:
    """By differences of the poses: as nav_msgs/Odometry and REP 105 have it."""
    node = Node(monkeypatch)
    states = fly(node, paper_robot, 2000)
    messages = node.sent["base/odometry"]
    assert [stamp(m) for m in messages] == list(range(0, 2001, 20))
    assert {(m.header.frame_id, m.child_frame_id) for m in messages} == {
        ("inertial", "fleet/sat1/base_link")
    }
    for message in messages[50:100]:
        tick = stamp(message)
        before, state, after = states[tick - 1 : tick + 2]
        pose, twist = message.pose.pose, message.twist.twist
        turn = rotation(pose.orientation)
        np.testing.assert_array_equal(xyz(pose.position), state.base_position)
        velocity = (after.base_position - before.base_position) / (2 * PERIOD)
        np.testing.assert_allclose(xyz(twist.linear), turn.inv().apply(velocity), atol=1e-7)
        turns = [Rotation.from_quat(s.quaternion[[1, 2, 3, 0]]) for s in (before, after)]
        omega = (turns[0].inv() * turns[1]).as_rotvec() / (2 * PERIOD)
        np.testing.assert_allclose(xyz(twist.angular), omega, atol=1e-6)
    assert np.linalg.norm(xyz(twist.linear)) > 1e-3
    assert np.linalg.norm(xyz(twist.angular)) > 1e-2


def test_the_imu_tells_attitude_and_rate_and_no_acceleration(
    paper_robot: Robot, monkeypatch: pytest.MonkeyPatch
) -> None:
    node = Node(monkeypatch)
    states = fly(node, paper_robot, 400)
    for message in node.sent["base/imu"]:
        state = states[stamp(message)]
        assert message.header.frame_id == "fleet/sat1/base_link"
        np.testing.assert_array_equal(xyz(message.angular_velocity), state.omega_base)
        q = message.orientation
        np.testing.assert_array_equal([q.w, q.x, q.y, q.z], state.quaternion)
        assert message.linear_acceleration_covariance[0] == -1.0
        assert not xyz(message.linear_acceleration).any()


def test_the_wrench_is_that_applied_to_the_base(
    paper_robot: Robot, monkeypatch: pytest.MonkeyPatch
) -> None:
    node = Node(monkeypatch)
    fly(node, paper_robot, 40)
    first, *others = node.sent["base/wrench"]
    assert not xyz(first.wrench.torque).any()
    for message in others:
        assert message.header.frame_id == "fleet/sat1/base_link"
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
