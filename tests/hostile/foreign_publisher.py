"""A process that does not belong to the flight, publishing on one of its topics.

It hears what others send there and sends it again, spoiled.
Use: ``foreign_publisher.py TOPIC KIND RATE_HZ``.
"""

from __future__ import annotations

import struct
import sys
import time
from collections import deque
from contextlib import suppress

import numpy as np

from space_robot_msgs_py import topics
from space_robot_msgs_py.ros.process_environment import set_defaults

set_defaults()
import rclpy  # noqa: E402

from space_robot_msgs_py.ros.endpoints import PolledCallbackGroup, RawPublisher, RawSubscription  # noqa: E402

KINDS = ("echo", "future", "past", "nan", "malformed")
STAMP = slice(4, 12)
"""Where the stamp is: all messages with one begin with it, after CDR's four bytes."""
LATER_S = 100
MOST_OWN = 1_000
"""Of its own messages so many are known again; to spoil them once more would wear them down."""


def corrupt(data: bytes, kind: str, count: int) -> bytes:
    """A message as heard, with something wrong with it."""
    seconds, nanoseconds = struct.unpack("<iI", data[STAMP])
    if kind == "future":
        return data[:4] + struct.pack("<iI", seconds + LATER_S, nanoseconds) + data[12:]
    if kind == "past":
        return data[:4] + struct.pack("<iI", 0, 0) + data[12:]
    if kind == "nan":
        return data[:-8] + struct.pack("<d", np.nan)
    if kind == "malformed":
        rng = np.random.default_rng(count)
        return data[:4] + rng.bytes(int(rng.integers(0, 2 * len(data))))
    return data


def main() -> None:
    """Publish until told to end."""
    name, kind, rate = sys.argv[1], sys.argv[2], float(sys.argv[3])
    rclpy.init(args=[])
    node = rclpy.create_node("foreign_publisher")
    topic = topics.BY_NAME[name]
    out, heard = (
        RawPublisher(node, topic),
        RawSubscription(node, topic, PolledCallbackGroup(), depth=10),
    )
    print("ready", flush=True)
    data, count, own = bytes(400), 0, deque[bytes](maxlen=MOST_OWN)
    begin = time.monotonic()
    while True:
        while (taken := heard.take()) is not None:
            if taken not in own and len(taken) >= STAMP.stop:
                data = taken
        own.append(corrupt(data, kind, count))
        with suppress(RuntimeError):  # longer than any message of its type: Fast DDS refuses it
            out.publish(own[-1])
        count += 1
        time.sleep(max(0.0, begin + count / rate - time.monotonic()))


if __name__ == "__main__":
    main()
