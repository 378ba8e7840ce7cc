"""A foreign program that sends on every topic of the graph: python flood.py KIND RATE_HZ.

KIND: ``malformed``, from its start on; ``echo`` (the graph's own bytes again) and ``future``
(these, a thousand seconds ahead), when the flight has begun. It goes on until it is killed.
"""

from __future__ import annotations

import struct
import sys
import time

from space_robot_msgs_py import topics
from space_robot_msgs_py.ros.process_environment import set_defaults

set_defaults()

import rclpy  # noqa: E402

from space_robot_msgs_py.ros.endpoints import PolledCallbackGroup, RawPublisher, RawSubscription  # noqa: E402

NAME = "flood"
AHEAD_S = 1000
MALFORMED = b"\x00\x01\x00\x00junk"


def _corrupt(kind: str, data: bytes) -> bytes:
    if kind == "malformed":
        return MALFORMED
    if kind == "future":
        (seconds,) = struct.unpack_from("<i", data, 4)
        return data[:4] + struct.pack("<i", seconds + AHEAD_S) + data[8:]
    return data


def main(kind: str, rate_hz: float) -> None:
    """Send until killed."""
    rclpy.init(args=[])
    node, group = rclpy.create_node(NAME), PolledCallbackGroup()
    heard = {topic: RawSubscription(node, topic, group, depth=1) for topic in topics.ALL}
    clock = RawSubscription(node, topics.CLOCK, group, depth=1)
    while kind != "malformed" and clock.take() is None:
        time.sleep(0.005)
    newest: dict[topics.Topic, bytes] = {}
    outs = {topic: RawPublisher(node, topic) for topic in topics.ALL}
    print("sending", flush=True)
    begin, rounds = time.monotonic(), 0
    while True:
        rounds += 1
        for topic, out in outs.items():
            newest[topic] = heard[topic].take() or newest.get(topic, b"")
            if newest[topic] or kind == "malformed":
                out.publish(_corrupt(kind, newest[topic]))
        time.sleep(max(0.0, begin + rounds / rate_hz - time.monotonic()))


if __name__ == "__main__":
    main(sys.argv[1], float(sys.argv[2]))
