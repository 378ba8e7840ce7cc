"""Input of the mission's reference, and its substitute while it is missing."""

from __future__ import annotations

import time
from collections import Counter
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
from space_robot_msgs_py.samples import Timebase
from space_robot_msgs_py.wire.telemetry import ReferenceCodec

from .reference_buffer import ReferenceBuffer

Array = NDArray[np.float64]

QUEUE_DEPTH = 10_000
MOST_AT_ONCE = 100
"""Messages read before other work continues, in case of a flood."""
DRAIN_S = 0.01
"""Longest search for a reference among received messages, s."""
TIMEOUT_S = 0.02
WAIT_TOLD_S = 0.5
"""Wait from which it is reported, s."""


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

        Args:
            node: that subscribes.
            robot: the joints.
            timebase: conversion between ticks and stamps.
            timeout_s: longest wait for the mission, s.
            join_timeout_s: longest wait for its first reference, s; 0: no limit.
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
        """How long the reference that is needed now is waited for; 0: none is."""
        self._waits_since = 0.0
        """When the wait began that has not ended well yet; 0: none."""
        codec, buffer = ReferenceCodec(robot.joint_names, timebase), self.buffer
        group = PolledCallbackGroup()
        self._halves = (
            _Half(
                RawSubscription(node, topics.REFERENCE_JOINTS, group, QUEUE_DEPTH),
                codec.decode_joints,
                buffer.add_joints,
            ),
            _Half(
                RawSubscription(node, topics.REFERENCE_BASE, group, QUEUE_DEPTH),
                codec.decode_base,
                buffer.add_base,
            ),
        )
        self.inputs = tuple(half.input for half in self._halves)
        self.wait = Wait(TIMEOUT_S, self.inputs)
        """The wait while `at` has no row."""

    @property
    def is_waited_for(self) -> bool:
        """True if a reference has been missing long enough to be reported."""
        return bool(self._waits_since) and time.monotonic() - self._waits_since > WAIT_TOLD_S

    @property
    def is_awaited(self) -> bool:
        """True if the row missing in `at` may still arrive."""
        return self._until > 0.0

    def at(self, tick: int) -> Block | None:
        """Return the `Reference` of ``tick``, or the last point if the mission is silent.

        None if they have not come yet (`is_awaited`), or if nothing has come that could be held.

        Raises:
            FlightError: nothing has come in time.
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
        return any([half.take(self.rejected) for half in self._halves])

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


class _Half:
    """One of the two topics."""

    def __init__(
        self,
        source: RawSubscription,
        decode: Callable[[bytes], tuple[int, Array]],
        add: Callable[[int, Array], None],
    ) -> None:
        self.input, self._decode, self._add = source, decode, add

    def take(self, rejected: Counter[str]) -> bool:
        """Take the next good message, if there is one."""
        for _ in range(MOST_AT_ONCE):
            data = self.input.take()
            if data is None:
                return False
            try:
                self._add(*self._decode(data))
            except MessageError as error:
                rejected[f"reference: {error.reason}"] += 1
                continue
            return True
        return False
