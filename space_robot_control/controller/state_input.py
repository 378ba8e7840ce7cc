"""The plant's states as they come: two halves, each from the publisher that is followed."""

from __future__ import annotations

from collections import Counter

from rclpy.node import Node

from space_robot_msgs_py import topics
from space_robot_msgs_py.errors import MessageError
from space_robot_msgs_py.ros.endpoints import (
    FollowedSubscription,
    PolledCallbackGroup,
    Waiter,
    take_or_wait,
)
from space_robot_msgs_py.samples import RobotState, Timebase
from space_robot_msgs_py.wire.cdr import header_stamp_ns
from space_robot_msgs_py.wire.codecs import StateCodec
from space_robot_sim.robot import Robot

PATIENCE_S = 0.02
MOST_KEPT = 1_000
"""Base states of unknown senders that may find their other half."""


class StateInput:
    """Takes whole states off /joint_states and /base/state.

    The joints' half is sent first: it is decoded while the base's half is on its way.
    """

    def __init__(self, node: Node, robot: Robot, timebase: Timebase, spin_s: float) -> None:
        """``spin_s``: see `Waiter`."""
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
        self._joints_waiter = Waiter(node, self._joints, spin_s=spin_s)
        self._base_waiter = Waiter(node, self._base, spin_s=spin_s)
        self._bases: dict[int, tuple[bytes, tuple[int, int]]] = {}
        """What unknown senders have sent, by tick, and its `SourceGuard.passed`."""

    def take(self) -> int | None:
        """The tick of the newest whole state, decoded into `state`; None if there is none."""
        joints = self._joints
        data = take_or_wait(joints, self._joints_waiter, PATIENCE_S)
        if data is None:
            return None
        # among messages of unknown senders the newest need not be the best
        while joints.source.is_sure and (newer := joints.take()) is not None:
            data = newer
        current = joints
        try:
            tick = self.codec.decode_joints(data, self.state)
            current = self._base
            is_known = joints.source.is_sure and self._base.source.is_followed
            has_come = self._take_base(tick) if is_known else self._find_base(tick)
        except MessageError as error:
            self._reject(error.reason, current)
            return None
        return tick if has_come else None

    def follow(self) -> None:
        """The state last taken was good: whoever has sent it is the plant."""
        self._joints.source.follow()
        self._base.source.follow()

    def reject(self, reason: str) -> None:
        """The state last taken was not good."""
        self._reject(reason, self._joints, self._base)

    def _reject(self, reason: str, *inputs: FollowedSubscription) -> None:
        self.rejected[reason] += 1
        for entry in inputs:
            entry.source.doubt()

    def _take_base(self, tick: int) -> bool:
        base_tick = -1
        while base_tick < tick:
            data = take_or_wait(self._base, self._base_waiter, PATIENCE_S)
            if data is None:
                return False
            base_tick = self.codec.decode_base(data, self.state)
        return base_tick == tick

    def _find_base(self, tick: int) -> bool:
        """Look for the base's half among all that has come: in a flood it may be far behind."""
        if not self._bases:
            self._base_waiter.wait(PATIENCE_S)
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
            return False
        data, self._base.source.passed = self._bases[tick]
        self._bases.clear()
        return self.codec.decode_base(data, self.state) == tick
