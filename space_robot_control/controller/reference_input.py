"""The mission's reference as it comes, and what stands in for it while it stays away."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py import topics
from space_robot_msgs_py.errors import MessageError
from space_robot_msgs_py.ros.endpoints import FollowedSubscription, PolledCallbackGroup, Waiter
from space_robot_msgs_py.ros.node_host import NodeHost
from space_robot_msgs_py.samples import Timebase
from space_robot_msgs_py.wire.reference_codec import ReferenceCodec
from space_robot_sim.robot import Robot

from .reference_buffer import ReferenceBuffer

Array = NDArray[np.float64]

QUEUE_DEPTH = 10_000
MOST_AT_ONCE = 100
"""Messages looked at before other work goes on: somebody may flood a topic."""
DRAIN_S = 0.01
"""How long a reference is looked for among those that have come already."""
PATIENCE_S = 0.02
WAIT_TOLD_S = 0.5
"""A wait that lasts longer is told."""


class ReferenceInput:
    """Takes both halves of the reference into a `ReferenceBuffer`."""

    def __init__(self, host: NodeHost, robot: Robot, timebase: Timebase, timeout_s: float) -> None:
        """``timeout_s``: how long `at` waits for the mission."""
        self._host, self._timeout_s = host, timeout_s
        self.buffer = ReferenceBuffer(robot.n)
        self.rejected: Counter[str] = Counter()
        """Messages not used, by reason."""
        self.held = 0
        """Ticks for which a point before was held."""
        self.is_missing = False
        """Whether the last one was."""
        self._waits_since = 0.0
        """When the wait began that has not ended well yet; 0: none."""
        codec, buffer = ReferenceCodec(robot.joint_names, timebase), self.buffer
        node, group = host.node, PolledCallbackGroup()
        self._halves = (
            _Half(
                FollowedSubscription(node, topics.REFERENCE_JOINTS, group, QUEUE_DEPTH),
                codec.decode_joints, buffer.add_joints,
            ),
            _Half(
                FollowedSubscription(node, topics.REFERENCE_BASE, group, QUEUE_DEPTH),
                codec.decode_base, buffer.add_base,
            ),
        )  # fmt: skip
        self.inputs = tuple(half.input for half in self._halves)
        self._waiter = Waiter(node, *self.inputs)

    @property
    def is_waited_for(self) -> bool:
        """Whether a reference has been waited for in vain, for so long that it is worth a word."""
        return bool(self._waits_since) and time.monotonic() - self._waits_since > WAIT_TOLD_S

    def at(self, tick: int) -> tuple[Array, Array] | None:
        """The (3, n) and (10,) rows of ``tick``, or its last point where the mission stays away.

        None if told to stop, or if nothing has come that could be held.
        """
        buffer = self.buffer
        if not buffer.covers(tick) and not self._wait(tick):
            held = None if self._host.stopping else buffer.hold(tick)
            if held:
                self.is_missing, self._waits_since = True, 0.0
                self.held += 1
            return held
        self.is_missing, self._waits_since = False, 0.0
        return buffer.at(tick)

    def take(self) -> bool:
        """Take the next good message of each half; whether there was any."""
        return any([half.take(self.rejected) for half in self._halves])

    def _wait(self, tick: int) -> bool:
        """Take what comes until it covers ``tick``; False if it stays away."""
        begin = time.monotonic()
        self._waits_since = self._waits_since or begin
        until = begin + (0.0 if self.is_missing else self._timeout_s)
        while not self.buffer.covers(tick):
            if self._host.stopping:
                return False
            has_come, now = self.take(), time.monotonic()
            if now >= until + (DRAIN_S if has_come else 0.0):
                return self.buffer.covers(tick)
            if not has_come:
                self._waiter.wait(PATIENCE_S)
            self._host.serve()
        return True


class _Half:
    """One of the two topics; what another than the mission sends only fills gaps."""

    def __init__(
        self, source: FollowedSubscription, decode: Callable[[bytes], tuple[int, Array]],
        add: Callable[[int, Array, bool], bool],
    ) -> None:  # fmt: skip
        self.input, self._decode, self._add = source, decode, add
        self._stop = -1
        """Where the mission's next message should begin."""

    def take(self, rejected: Counter[str]) -> bool:
        """Take the next good message, if there is one; bad ones take nobody's place."""
        source = self.input.source
        for _ in range(MOST_AT_ONCE):
            data = self.input.take()
            if data is None:
                return False
            try:
                start, rows = self._decode(data)
                has_place = self._add(start, rows, not source.is_sure)
            except MessageError as error:
                rejected[f"reference: {error.reason}"] += 1
                source.doubt()
                continue
            continues = start == self._stop
            if source.is_sure or continues or (has_place and not source.is_contested):
                source.follow()
                self._stop = start + len(rows)
            return True
        return False
