"""Inputs of the controller node: the plant's states and the mission's reference.

Both arrive in parts and are read without waiting.
"""

from __future__ import annotations

import time
from collections import Counter, deque
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from rclpy.node import Node

from space_robot_model.robot import Robot
from space_robot_msgs_py import topics
from space_robot_msgs_py.compiled.records import Block
from space_robot_msgs_py.errors import FlightError, MessageError
from space_robot_msgs_py.ros.endpoints import PolledCallbackGroup, RawSubscription
from space_robot_msgs_py.ros.loop import Wait
from space_robot_msgs_py.samples import RobotNames, RobotState, Timebase
from space_robot_msgs_py.wire.cdr import header_stamp_ns
from space_robot_msgs_py.wire.codecs import StateCodec
from space_robot_msgs_py.wire.telemetry import ReferenceCodec

from .reference_buffer import ReferenceBuffer

Array = NDArray[np.float64]

QUEUE_DEPTH = 10_000
MOST_AT_ONCE = 100
"""Messages read before other work continues, in case of a flood."""
DRAIN_S = 0.01
"""Longest search for a reference among received messages, s."""
TIMEOUT_S = 0.02
OVERDUE_S = 0.5
"""Wait after which a missing reference is reported, s."""


class StateInput:
    """Reader of whole states from the topics of their parts, without waiting.

    The joints' part is sent first: it is decoded while the others are on their way.
    """

    def __init__(self, node: Node, names: RobotNames, timebase: Timebase) -> None:
        """Subscribe to all parts of the state of a robot with these names."""
        self.state = RobotState.allocate(len(names.joints))
        """Overwritten by `take`; its tick is the caller's to set."""
        self.rejected: Counter[str] = Counter()
        """Messages not used, by reason."""
        self.codec = StateCodec(names, timebase)
        group = PolledCallbackGroup()
        self.inputs = tuple(
            RawSubscription(node, topic, group) for topic in self.codec.control_topics
        )
        self._first, self._timebase = self.inputs[0], timebase
        self._ahead: dict[RawSubscription, bytes] = {}
        """Parts of later ticks, taken while one was looked for that had never been received."""
        self._waits = {entry: Wait(TIMEOUT_S, (entry,), is_brief=True) for entry in self.inputs}
        self._newest = -1
        """Tick of the first part that was taken last."""
        self._tick = -1
        """Tick of the first part in `state`, of which others have not come yet; -1: none."""
        self._lacking: deque[RawSubscription] = deque()
        """Parts that have not arrived yet."""
        self._until = 0.0
        """When the wait for them ends; 0: all were there so far."""

    @property
    def wait(self) -> Wait:
        """Wait after `take` returned no whole state."""
        return self._waits[self._first if self._tick < 0 else self._lacking[0]]

    def take(self) -> int | None:
        """Read the newest whole state into `state`; return its tick, or None."""
        if self._tick < 0 and not self._take_first():
            return None
        tick = self._tick
        while self._lacking:
            try:
                taken = self._take_part(self._lacking[0], tick)
            except MessageError as error:
                self._tick = -1
                self.reject(error.reason)
                return None
            if taken is None:  # it may still come
                now = time.monotonic()
                self._until = self._until or now + TIMEOUT_S
                if now < self._until:
                    return None
            if not taken:
                self._tick = -1
                return None
            self._lacking.popleft()
        self._tick = -1
        return tick

    def _take_part(self, entry: RawSubscription, tick: int) -> bool | None:
        """Decode a part of ``tick``; None if it may still come, False if it never will."""
        while (data := self._ahead.pop(entry, None) or entry.take()) is not None:
            stamped = self._timebase.tick(header_stamp_ns(data))
            if stamped == tick:
                self.codec.decode(entry.topic, data, self.state)
                return True
            if stamped > tick:  # reliable topics keep their order
                self._ahead[entry] = data
                return False
        return None

    def reject(self, reason: str) -> None:
        """Count the state taken last as rejected."""
        self.rejected[reason] += 1

    def _take_first(self) -> bool:
        """Take the newest joints' part, if one has arrived."""
        # older states are passed over: their commands would come too late
        first, data = self._first, None
        while (newer := first.take()) is not None:
            data = newer
        if data is None:
            return False
        try:
            self._tick = self.codec.decode(first.topic, data, self.state)
        except MessageError as error:
            self.reject(error.reason)
            return False
        if self._tick < self._newest:
            self._ahead.clear()  # a new time begins
        self._newest = self._tick
        self._lacking, self._until = deque(self.inputs[1:]), 0.0
        return True


class ReferenceInput:
    """Reader of both halves of the reference into a `ReferenceBuffer`, without waiting."""

    def __init__(
        self,
        node: Node,
        robot: Robot,
        timebase: Timebase,
        timeout_s: float,
        join_timeout_s: float = 0.0,
    ) -> None:
        """Subscribe.

        ``timeout_s`` is the longest wait for the mission, ``join_timeout_s`` that for its first
        reference (0: no limit).
        """
        self._timeout_s, self._join_timeout_s = timeout_s, join_timeout_s
        self.buffer = ReferenceBuffer(robot.n)
        self.rejected: Counter[str] = Counter()
        """Messages not used, by reason."""
        self.held = 0
        """Ticks for which an earlier point was held."""
        self.is_missing = False
        """True if the reference of the last tick was held."""
        self._until = 0.0
        """When the wait for the reference that is needed now ends; 0: none is awaited."""
        self._waits_since = 0.0
        """When the wait began that no reference has ended yet; 0: none."""
        codec, buffer = ReferenceCodec(robot.joint_names, timebase), self.buffer
        group = PolledCallbackGroup()
        self.inputs = tuple(
            RawSubscription(node, topic, group, QUEUE_DEPTH)
            for topic in (topics.REFERENCE_JOINTS, topics.REFERENCE_BASE)
        )
        decoders = (codec.decode_joints, buffer.add_joints), (codec.decode_base, buffer.add_base)
        self._halves = [(entry, *pair) for entry, pair in zip(self.inputs, decoders, strict=True)]
        self.wait = Wait(TIMEOUT_S, self.inputs)
        """The wait while `at` has no row."""

    @property
    def is_overdue(self) -> bool:
        """True if a reference has been missing for `OVERDUE_S`."""
        return bool(self._waits_since) and time.monotonic() - self._waits_since > OVERDUE_S

    @property
    def is_awaited(self) -> bool:
        """True if the row missing in `at` may still arrive."""
        return self._until > 0.0

    def at(self, tick: int) -> Block | None:
        """Return the `Reference` of ``tick``, or the last point if the mission is silent.

        None if they have not come yet (`is_awaited`), or if nothing has come that could be held.

        Raises:
            FlightError: no reference has come within the join timeout.
        """
        buffer = self.buffer
        if buffer.covers(tick) or self._look_for(tick):
            self.is_missing, self._waits_since, self._until = False, 0.0, 0.0
            return buffer.at(tick)
        if self.is_awaited:
            return None
        held = buffer.hold(tick)
        if held is not None:
            self.is_missing, self._waits_since = True, 0.0
            self.held += 1
        elif 0.0 < self._join_timeout_s < time.monotonic() - self._waits_since:
            names = " and ".join(entry.full_name for entry in self.inputs)
            raise FlightError(
                f"no reference for tick {tick} within {self._join_timeout_s:g} s (join_timeout): "
                f"a mission must publish {names}"
            )
        return held

    def take(self) -> bool:
        """Take the next valid message of each half; return whether there was any."""
        return any([self._take(*half) for half in self._halves])

    def _take(
        self,
        entry: RawSubscription,
        decode: Callable[[bytes], tuple[int, Array]],
        add: Callable[[int, Array], None],
    ) -> bool:
        for _ in range(MOST_AT_ONCE):
            data = entry.take()
            if data is None:
                return False
            try:
                add(*decode(data))
            except MessageError as error:
                self.rejected[f"reference: {error.reason}"] += 1
                continue
            return True
        return False

    def _look_for(self, tick: int) -> bool:
        """Take messages until ``tick`` is covered or the timeout is over."""
        now = time.monotonic()
        self._waits_since = self._waits_since or now
        self._until = self._until or now + (0.0 if self.is_missing else self._timeout_s)
        turn_until = now + DRAIN_S
        while has_come := self.take():
            if self.buffer.covers(tick):
                return True
            if (now := time.monotonic()) >= turn_until:
                break
        if now >= self._until + (DRAIN_S if has_come else 0.0):
            self._until = 0.0
        return False
