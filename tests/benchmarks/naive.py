"""The graph's loop as one would write it first: message objects, callbacks, an executor.

    python -m benchmarks.naive plant|controller FILE TICKS

Two nodes that send the messages of the graph back and forth and do nothing else; no recorder, no
mission. The plant writes its rate, ticks/s, to FILE.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path
from typing import Any

from space_robot_msgs_py import topics
from space_robot_msgs_py.ros.endpoints import message_type, qos
from space_robot_msgs_py.ros.lifeline import hold_to_standard_input
from space_robot_msgs_py.ros.process_environment import set_defaults

set_defaults()

import rclpy  # noqa: E402
import rclpy.utilities  # noqa: E402
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor  # noqa: E402
from rclpy.node import Node  # noqa: E402

WARM_UP_TICKS = 200
JOINTS = [f"joint{k}" for k in range(1, 7)]
AXES = ["base_x", "base_y", "base_z", *JOINTS]


def _publisher(node: Node, topic: topics.Topic) -> Any:
    return node.create_publisher(message_type(topic.type), topic.full_name, qos(topic))


def _subscribe(node: Node, topic: topics.Topic, callback: Any) -> None:
    node.create_subscription(message_type(topic.type), topic.full_name, callback, qos(topic))


def _joint_state(tick: int, names: list[str]) -> Any:
    message = message_type(topics.JOINT_STATES.type)()
    message.header.stamp.sec, message.header.stamp.nanosec = divmod(tick * 500_000, 10**9)
    message.name = names
    message.position = message.velocity = message.effort = [0.1] * len(names)
    return message


def _base_state(tick: int) -> Any:
    message = message_type(topics.BASE_STATE.type)()
    message.header.stamp.sec, message.header.stamp.nanosec = divmod(tick * 500_000, 10**9)
    message.joint_names = [topics.BASE_JOINT]
    for field, name in (("transforms", "Transform"), ("twist", "Twist"), ("wrench", "Wrench")):
        setattr(message, field, [message_type(f"geometry_msgs/msg/{name}")()])
    return message


def _fly_plant(node: Node, ticks: int, file: Path) -> None:
    joints, base = _publisher(node, topics.JOINT_STATES), _publisher(node, topics.BASE_STATE)
    tick, begin = 0, 0.0

    def send() -> None:
        joints.publish(_joint_state(tick, JOINTS))
        base.publish(_base_state(tick))

    def on_command(message: Any) -> None:
        nonlocal tick, begin
        tick += 1
        if tick == WARM_UP_TICKS:
            begin = time.perf_counter()
        if tick < ticks:
            send()

    _subscribe(node, topics.COMMAND, on_command)
    while base.get_subscription_count() < 1 or node.count_publishers(topics.COMMAND.full_name) < 1:
        time.sleep(0.02)
    time.sleep(0.5)  # matched both ways
    send()
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    while tick < ticks:
        executor.spin_once(timeout_sec=1.0)
    file.write_text(str((ticks - WARM_UP_TICKS) / (time.perf_counter() - begin)), "utf-8")


def _answer_for_ever(node: Node) -> None:
    command = _publisher(node, topics.COMMAND)
    tick = 0

    def on_joints(message: Any) -> None:
        nonlocal tick
        stamp = message.header.stamp
        tick = (stamp.sec * 10**9 + stamp.nanosec) // 500_000

    _subscribe(node, topics.JOINT_STATES, on_joints)
    _subscribe(node, topics.BASE_STATE, lambda message: command.publish(_joint_state(tick, AXES)))
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    while rclpy.utilities.ok():
        executor.spin_once(timeout_sec=1.0)


def main() -> None:
    """See the module."""
    role, file, ticks = sys.argv[1:]
    rclpy.init(args=[])
    hold_to_standard_input()
    node = rclpy.create_node(f"naive_{role}")
    try:
        if role == "plant":
            _fly_plant(node, int(ticks), Path(file))
        else:
            _answer_for_ever(node)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        node.destroy_node()  # type: ignore[no-untyped-call]
        rclpy.utilities.try_shutdown()


if __name__ == "__main__":
    main()
