"""Input of the plant's states, which arrive in parts."""

from __future__ import annotations

import time
from collections import Counter, deque

from rclpy.node import Node

from space_robot_msgs_py.errors import MessageError
from space_robot_msgs_py.ros.endpoints import PolledCallbackGroup, RawSubscription
from space_robot_msgs_py.ros.loop import Wait
from space_robot_msgs_py.samples import RobotNames, RobotState, Timebase
from space_robot_msgs_py.wire.cdr import header_stamp_ns
from space_robot_msgs_py.wire.codecs import StateCodec

TIMEOUT_S = 0.02


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
        first, *others = (
            RawSubscription(node, topic, group) for topic in self.codec.control_topics
        )
        self.inputs = (first, *others)
        self._first = first
        self._parts = [_LaterPart(entry, self.codec, timebase) for entry in others]
        self._waits = {entry: Wait(TIMEOUT_S, (entry,), is_brief=True) for entry in self.inputs}
        self._newest = -1
        """Tick of the first part that was taken last."""
        self._tick = -1
        """Tick of the first part in `state`, of which others have not come yet; -1: none."""
        self._lacking: deque[_LaterPart] = deque()
        """Parts that have not arrived yet."""
        self._until = 0.0
        """How long they are waited for; 0: none has been looked for in vain yet."""

    @property
    def wait(self) -> Wait:
        """Wait after `take` returned no whole state."""
        return self._waits[self._first if self._tick < 0 else self._lacking[0].input]

    def take(self) -> int | None:
        """Read the newest whole state into `state`; return its tick, or None."""
        if self._tick < 0 and not self._take_first():
            return None
        tick = self._tick
        while self._lacking:
            part = self._lacking[0]
            try:
                taken = part.take(tick, self.state)
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

    def reject(self, reason: str) -> None:
        """Count the state taken last as rejected."""
        self.rejected[reason] += 1

    def _take_first(self) -> bool:
        """Take the newest joints' part, if one has arrived."""
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
            for part in self._parts:
                part.forget()
        self._newest = self._tick
        self._lacking, self._until = deque(self._parts), 0.0
        return True


class _LaterPart:
    """A part of the state that is read after the first part."""

    def __init__(self, entry: RawSubscription, codec: StateCodec, timebase: Timebase) -> None:
        self.input, self._codec, self._timebase = entry, codec, timebase
        self._ahead: bytes | None = None
        """Of a later tick than the one that was looked for: that one's part was never heard."""

    def take(self, tick: int, state: RobotState) -> bool | None:
        """Take the part of ``tick`` into ``state``; whether it is there, None if it may still come.

        Raises:
            MessageError: it does not fit.
        """
        while (data := self._ahead or self.input.take()) is not None:
            self._ahead = None
            stamped = self._timebase.tick(header_stamp_ns(data))
            if stamped == tick:
                self._codec.decode(self.input.topic, data, state)
                return True
            if stamped > tick:
                self._ahead = data
                return False
        return None

    def forget(self) -> None:
        """Discard parts of later ticks, since a new time begins."""
        self._ahead = None
