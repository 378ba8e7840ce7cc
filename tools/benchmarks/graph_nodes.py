"""Nodes of the section `graph`: plant and controller with a stopwatch, and two naive ones.

    graph_nodes plant|controller FILE --ros-args ...

The durations of calls go to FILE (.npz) when the node ends.

    graph_nodes 'naive plant'|'naive controller' FILE TICKS

The graph's loop as one would write it first, with message objects, callbacks and an executor: they
send the messages of the graph back and forth and do nothing else. The plant writes its rate,
ticks/s, to FILE.
"""

from __future__ import annotations

import sys
import time
from array import array
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

from space_robot_msgs_py.ros.process import set_defaults

set_defaults()
import rclpy  # noqa: E402
import rclpy.utilities  # noqa: E402
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor  # noqa: E402

from space_robot_control.controller.loop import ControllerLoop  # noqa: E402
from space_robot_control.controller.settings import ControllerNodeSettings  # noqa: E402
from space_robot_msgs_py import topics  # noqa: E402
from space_robot_msgs_py.ros.endpoints import message_type, qos  # noqa: E402
from space_robot_msgs_py.ros.managed_node import NodeKind  # noqa: E402
from space_robot_msgs_py.ros.node_host import run_nodes  # noqa: E402
from space_robot_msgs_py.ros.process import hold_to_standard_input  # noqa: E402
from space_robot_sim.plant.loop import PlantLoop  # noqa: E402
from space_robot_sim.plant.settings import PlantNodeSettings  # noqa: E402

WARM_UP_TICKS = 500
PARTS = {
    "plant": "_states.encode _state_out.0.publish _state_out.1.publish _command_in.take "
    "_commands.decode _plant.step",
    "controller": "_states.inputs.0.take _states.inputs.1.take _states.codec.decode "
    "_answering.supervisor.answer _answering.encode _command_out.publish",
}
"""Calls of a tick, by the attributes of the node's loop; a take in vain is waiting."""


def _timed(loop: Any, parts: list[str], file: str) -> Any:
    """Return a node's loop of which the calls are timed, until it is closed."""
    durations = {part: array("q") for part in parts}

    def with_clock(function: Callable[..., Any], part: str) -> Callable[..., Any]:
        clock, append, is_take = time.perf_counter_ns, durations[part].append, part.endswith("take")

        def call(*arguments: Any) -> Any:
            begin = clock()
            result = function(*arguments)
            end = clock()
            if not is_take or result is not None:
                append(end - begin)
            return result

        return call

    class Timed(loop):  # type: ignore[misc]
        def __init__(self, *arguments: Any) -> None:
            super().__init__(*arguments)
            for part in parts:
                *path, method = part.split(".")
                owner: Any = self
                for name in path:
                    owner = owner[int(name)] if name.isdecimal() else getattr(owner, name)
                setattr(owner, method, with_clock(getattr(owner, method), part))

        def close(self) -> None:
            super().close()
            arrays: dict[str, Any] = {part: np.array(times) for part, times in durations.items()}
            np.savez(file, **arrays)

    return Timed


class _Naive:
    """A node that sends and hears messages of the graph."""

    def __init__(self, name: str) -> None:
        self.node = rclpy.create_node(name)
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(self.node)

    def publisher(self, topic: topics.Topic) -> Any:
        return self.node.create_publisher(message_type(topic.type), topic.full_name, qos(topic))

    def hear(self, topic: topics.Topic, callback: Callable[[Any], None]) -> None:
        kind = message_type(topic.type)
        self.node.create_subscription(kind, topic.full_name, callback, qos(topic))

    def message(self, topic: topics.Topic, stamp_ns: int) -> Any:
        message = message_type(topic.type)()
        message.header.stamp.sec, message.header.stamp.nanosec = divmod(stamp_ns, 10**9)
        if topic is topics.BASE_STATE:
            message.joint_names = [topics.BASE_JOINT]
            for field in ("transforms", "twist", "wrench"):
                name = field.removesuffix("s").capitalize()
                setattr(message, field, [message_type(f"geometry_msgs/msg/{name}")()])
        else:
            message.name = [f"axis{k}" for k in range(9 if topic is topics.COMMAND else 6)]
            message.position = message.velocity = message.effort = [0.1] * len(message.name)
        return message

    def spin_while(self, condition: Callable[[], bool]) -> None:
        while condition():
            self._executor.spin_once(timeout_sec=0.1)


def _naive_plant(ticks: int, file: Path) -> None:
    naive, tick, begin = _Naive("naive_plant"), 0, 0.0
    sent = [(t, naive.publisher(t)) for t in (topics.JOINT_STATES, topics.BASE_STATE)]

    def send() -> None:
        for topic, publisher in sent:
            publisher.publish(naive.message(topic, tick * 500_000))

    def on_command(message: Any) -> None:
        nonlocal tick, begin
        tick += 1
        if tick == ticks // 4:
            begin = time.perf_counter()
        if tick < ticks:
            send()

    naive.hear(topics.COMMAND, on_command)
    heard = sent[1][1].get_subscription_count
    naive.spin_while(
        lambda: not (heard() and naive.node.count_publishers(topics.COMMAND.full_name))
    )
    time.sleep(0.5)  # matched both ways
    send()
    naive.spin_while(lambda: tick < ticks)
    file.write_text(str((ticks - ticks // 4) / (time.perf_counter() - begin)), "utf-8")


def _naive_controller() -> None:
    naive, stamp_ns = _Naive("naive_controller"), 0
    command = naive.publisher(topics.COMMAND)

    def on_joints(message: Any) -> None:
        nonlocal stamp_ns
        stamp_ns = message.header.stamp.sec * 10**9 + message.header.stamp.nanosec

    def on_base(message: Any) -> None:
        command.publish(naive.message(topics.COMMAND, stamp_ns))

    naive.hear(topics.JOINT_STATES, on_joints)
    naive.hear(topics.BASE_STATE, on_base)
    naive.spin_while(rclpy.utilities.ok)


def main() -> None:
    """See the module."""
    node, file, *arguments = sys.argv[1:]
    if node.startswith("naive"):
        rclpy.init(args=[])
        hold_to_standard_input()
        with suppress(KeyboardInterrupt, ExternalShutdownException):
            if node == "naive plant":
                _naive_plant(int(arguments[0]), Path(file))
            else:
                _naive_controller()
        rclpy.utilities.try_shutdown()
        return
    sys.argv[1:] = arguments  # what rclpy reads
    kinds: dict[str, Any] = {
        "plant": (PlantNodeSettings, PlantLoop, ()),
        "controller": (ControllerNodeSettings, ControllerLoop, ("controller",)),
    }
    settings, loop, changeable = kinds[node]
    run_nodes(NodeKind(settings, _timed(loop, PARTS[node].split(), file), changeable=changeable))
