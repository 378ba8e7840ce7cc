"""The plant's states as they come: two halves, each from the publisher that is followed."""

from __future__ import annotations

import time
from collections import Counter

from rclpy.node import Node

from space_robot_msgs_py import topics
from space_robot_msgs_py.errors import MessageError
from space_robot_msgs_py.ros.endpoints import FollowedSubscription, PolledCallbackGroup
from space_robot_msgs_py.ros.loop import Wait
from space_robot_msgs_py.samples import RobotState, Timebase
from space_robot_msgs_py.wire.cdr import header_stamp_ns
from space_robot_msgs_py.wire.codecs import StateCodec
from space_robot_sim.robot import Robot

PATIENCE_S = 0.02
MOST_KEPT = 1_000
"""Base states of unknown senders that may find their other half."""


class StateInput:
    """Takes whole states off /joint_states and /base/state, without waiting for them.

    The joints' half is sent first: it is decoded while the base's half is on its way.
    """

    def __init__(self, node: Node, robot: Robot, timebase: Timebase) -> None:
        """Subscribe to both halves."""
        self.state = RobotState.allocate(robot.n)
        """Overwritten by `take`; its tick is the caller's to set."""
        self.rejected: Counter[str] = Counter()
        """Messages not used, by reason."""
        self._timebase = timebase
        self.codec = StateCodec(robot.joint_names, timebase)
        group = PolledCallbackGroup()
        self._joints = FollowedSubscription(node, topics.JOINT_STATES, group)
        self._base = FollowedSubscription(node, topics.BASE_STATE, group)
        self.inputs = self._joints, self._base
        self._for_joints = Wait(PATIENCE_S, (self._joints,), is_brief=True)
        self._for_base = Wait(PATIENCE_S, (self._base,), is_brief=True)
        self._half = -1
        """Tick of the joints in `state` whose base has not come yet; -1: none."""
        self._half_until = 0.0
        """How long that base is waited for; 0: it has not been looked for in vain yet."""
        self._bases: dict[int, tuple[bytes, tuple[int, int]]] = {}
        """States taken before their tick's joints, by tick, and their `SourceGuard.passed`: of
        unknown senders, or what the followed one had sent when it became so."""

    @property
    def wait(self) -> Wait:
        """The wait when `take` has found no whole state."""
        return self._for_joints if self._half < 0 else self._for_base

    def take(self) -> int | None:
        """Take the newest whole state into `state`; its tick, or None if there is none yet."""
        if self._half < 0 and not self._take_joints():
            return None
        tick, joints, base = self._half, self._joints, self._base
        is_known = joints.source.is_sure and base.source.is_followed
        try:
            found = self._take_base(tick) if is_known else self._find_base(tick)
        except MessageError as error:
            self._half = -1
            self._reject(error.reason, base)
            return None
        if found is None:  # it may still come
            now = time.monotonic()
            self._half_until = self._half_until or now + PATIENCE_S
            if now < self._half_until:
                return None
        self._half = -1
        return tick if found else None

    def follow(self) -> None:
        """Follow whoever has sent the state last taken: it was good."""
        self._joints.source.follow()
        self._base.source.follow()

    def reject(self, reason: str) -> None:
        """Count the state last taken as not good."""
        self._bases.clear()
        self._reject(reason, self._joints, self._base)

    def _reject(self, reason: str, *inputs: FollowedSubscription) -> None:
        self.rejected[reason] += 1
        for entry in inputs:
            entry.source.doubt()

    def _take_joints(self) -> bool:
        joints = self._joints
        data = joints.take()
        if data is None:
            return False
        # among messages of unknown senders the newest need not be the best
        while joints.source.is_sure and (newer := joints.take()) is not None:
            data = newer
        try:
            self._half, self._half_until = self.codec.decode_joints(data, self.state), 0.0
        except MessageError as error:
            self._reject(error.reason, joints)
            return False
        return True

    def _take_base(self, tick: int) -> bool | None:
        """Take the base's half up to ``tick``; whether it is there, None if it may still come."""
        if self._bases and (found := self._take_kept(tick)) is not None:
            return found
        base_tick = -1
        while base_tick < tick:
            data = self._base.take()
            if data is None:
                return None
            base_tick = self.codec.decode_base(data, self.state)
        return base_tick == tick

    def _take_kept(self, tick: int) -> bool | None:
        """`_take_base` from what the followed publisher had sent when it became so."""
        has_sent = self._base.source.has_sent
        self._bases = {
            base_tick: kept
            for base_tick, kept in self._bases.items()
            if base_tick >= tick and has_sent(kept[1][0])
        }
        if tick in self._bases:
            return self.codec.decode_base(self._bases.pop(tick)[0], self.state) == tick
        return False if self._bases else None

    def _find_base(self, tick: int) -> bool | None:
        """Look for the base's half among all that has come: in a flood it may be far behind."""
        for _ in range(topics.BASE_STATE.depth):
            if tick in self._bases or (data := self._base.take()) is None:
                break
            try:
                base_tick = self._timebase.tick(header_stamp_ns(data))
            except MessageError as error:
                self.rejected[error.reason] += 1
                continue
            if len(self._bases) == MOST_KEPT:
                del self._bases[next(iter(self._bases))]
            self._bases[base_tick] = data, self._base.source.passed
        if tick not in self._bases:
            return False if self._bases else None
        data, self._base.source.passed = self._bases[tick]
        self._bases = {later: kept for later, kept in self._bases.items() if later > tick}
        return self.codec.decode_base(data, self.state) == tick
