"""The plant's states as they come: in parts, each from the publisher that is followed."""

from __future__ import annotations

import time
from collections import Counter, deque

from rclpy.node import Node

from space_robot_msgs_py.errors import MessageError
from space_robot_msgs_py.ros.endpoints import FollowedSubscription, PolledCallbackGroup
from space_robot_msgs_py.ros.loop import Wait
from space_robot_msgs_py.samples import RobotNames, RobotState, Timebase
from space_robot_msgs_py.wire.cdr import header_stamp_ns
from space_robot_msgs_py.wire.codecs import StateCodec

TIMEOUT_S = 0.02
MOST_KEPT = 1_000
"""Messages of a part, of unknown senders, that may find the other parts."""


class StateInput:
    """Takes whole states off the topics of their parts, without waiting for them.

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
            FollowedSubscription(node, topic, group) for topic in self.codec.control_topics
        )
        self.inputs = (first, *others)
        self._first = first
        self._parts = [_LaterPart(entry, self.codec, timebase, self.rejected) for entry in others]
        self._waits = {entry: Wait(TIMEOUT_S, (entry,), is_brief=True) for entry in self.inputs}
        self._tick = -1
        """Tick of the first part in `state`, of which others have not come yet; -1: none."""
        self._lacking: deque[_LaterPart] = deque()
        """The parts that have not come yet."""
        self._until = 0.0
        """How long they are waited for; 0: none has been looked for in vain yet."""

    @property
    def wait(self) -> Wait:
        """The wait when `take` has found no whole state."""
        return self._waits[self._first if self._tick < 0 else self._lacking[0].input]

    def take(self) -> int | None:
        """Take the newest whole state into `state`; its tick, or None if there is none yet."""
        if self._tick < 0 and not self._take_first():
            return None
        tick = self._tick
        while self._lacking:
            part = self._lacking[0]
            try:
                taken = part.take(tick, self.state, self._first.source.is_sure)
            except MessageError as error:
                self._tick = -1
                self._reject(error.reason, part.input)
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

    def follow(self) -> None:
        """Follow whoever has sent the state last taken: it was good."""
        for entry in self.inputs:
            entry.source.follow()

    def reject(self, reason: str) -> None:
        """Count the state last taken as not good."""
        for part in self._parts:
            part.forget()
        self._reject(reason, *self.inputs)

    def _reject(self, reason: str, *inputs: FollowedSubscription) -> None:
        self.rejected[reason] += 1
        for entry in inputs:
            entry.source.doubt()

    def _take_first(self) -> bool:
        first = self._first
        data = first.take()
        if data is None:
            return False
        # among messages of unknown senders the newest need not be the best
        while first.source.is_sure and (newer := first.take()) is not None:
            data = newer
        try:
            self._tick = self.codec.decode(first.topic, data, self.state)
        except MessageError as error:
            self._reject(error.reason, first)
            return False
        self._lacking, self._until = deque(self._parts), 0.0
        return True


class _LaterPart:
    """A part of the state that is looked for once the first one is there."""

    def __init__(
        self,
        entry: FollowedSubscription,
        codec: StateCodec,
        timebase: Timebase,
        rejected: Counter[str],
    ) -> None:
        self.input, self._codec, self._timebase = entry, codec, timebase
        self._rejected = rejected
        self._kept: dict[int, tuple[bytes, tuple[int, int]]] = {}
        """What was taken before its tick's first part, by tick, and its `SourceGuard.passed`: of
        unknown senders, or what the followed one had sent when it became so."""

    def take(self, tick: int, state: RobotState, is_sure: bool) -> bool | None:
        """Take the part of ``tick`` into ``state``; whether it is there, None if it may still come.

        ``is_sure``: the first part is its followed publisher's.

        Raises:
            MessageError: it does not fit.
        """
        if is_sure and self.input.source.is_followed:
            return self._take_up_to(tick, state)
        return self._find(tick, state)

    def forget(self) -> None:
        """Forget what was put aside."""
        self._kept.clear()

    def _take_up_to(self, tick: int, state: RobotState) -> bool | None:
        if self._kept and (kept := self._take_kept(tick, state)) is not None:
            return kept
        taken = -1
        while taken < tick:
            data = self.input.take()
            if data is None:
                return None
            taken = self._codec.decode(self.input.topic, data, state)
        return taken == tick

    def _take_kept(self, tick: int, state: RobotState) -> bool | None:
        """`_take_up_to` from what the followed publisher had sent when it became so."""
        has_sent = self.input.source.has_sent
        self._kept = {
            stamped: kept
            for stamped, kept in self._kept.items()
            if stamped >= tick and has_sent(kept[1][0])
        }
        if tick in self._kept:
            return self._codec.decode(self.input.topic, self._kept.pop(tick)[0], state) == tick
        return False if self._kept else None

    def _find(self, tick: int, state: RobotState) -> bool | None:
        """Look for it among all that has come: in a flood it may be far behind."""
        kept, topic = self._kept, self.input.topic
        for _ in range(topic.depth):
            if tick in kept or (data := self.input.take()) is None:
                break
            try:
                stamped = self._timebase.tick(header_stamp_ns(data))
            except MessageError as error:
                self._rejected[error.reason] += 1
                continue
            if len(kept) == MOST_KEPT:
                del kept[next(iter(kept))]
            kept[stamped] = data, self.input.source.passed
        if tick not in kept:
            return False if kept else None
        data, self.input.source.passed = kept[tick]
        self._kept = {later: aside for later, aside in kept.items() if later > tick}
        return self._codec.decode(topic, data, state) == tick
