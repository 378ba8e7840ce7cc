"""The controller's state from two halves, whenever these were heard first."""

from __future__ import annotations

from collections import deque
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from paths import CONFIG

from space_robot_msgs_py import topics
from space_robot_msgs_py.samples import RobotNames, RobotState, Timebase
from space_robot_msgs_py.wire.codecs import StateCodec
from space_robot_msgs_py.wire.source_guard import SourceGuard
from space_robot_sim.robot import Robot

pytest.importorskip("rclpy")

from space_robot_control.controller import state_input
from space_robot_control.controller.state_input import StateInput

TIMEBASE = Timebase(500_000)
MS = 1_000_000
ROBOT = Robot.from_yaml(CONFIG / "robots" / "paper.yaml")


class Queue:
    """A `FollowedSubscription` that hears what the test sends."""

    def __init__(self, node: object, topic: topics.Topic, group: object) -> None:
        self.topic, self.source = topic, SourceGuard()
        self._sent: deque[tuple[bytes, int]] = deque()

    def send(self, data: bytes, sequence: int) -> None:
        self._sent.append((data, sequence))

    def take(self) -> bytes | None:
        while self._sent:
            data, sequence = self._sent.popleft()
            if self.source.passes(sequence, MS):
                return data
        return None


class Bench:
    """A plant that sends, and the input of a controller that has just joined."""

    def __init__(self, robot: Robot) -> None:
        names = RobotNames(robot.joint_names)
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(state_input, "FollowedSubscription", Queue)
            no_node: Any = None
            self.input = StateInput(no_node, names, TIMEBASE)
        self._codec = StateCodec(names, TIMEBASE)
        self._state = RobotState.allocate(robot.n)

    def send(self, tick: int, *halves: topics.Topic) -> None:
        """Send a state, of which the controller hears some halves."""
        self._state.tick = tick
        self._state.joint_positions[:] = self._state.base_position[:] = tick
        queues: Any = self.input.inputs
        for queue, data in zip(queues, self._codec.encode(self._state), strict=True):
            if queue.topic in halves:
                queue.send(data, tick + 1)

    def take_all(self) -> list[int]:
        """Take what is there as the controller does, which follows what it believes."""
        found = []
        while (tick := self.input.take()) is not None:
            state = self.input.state
            assert state.joint_positions[0] == state.base_position[0] == tick
            self.input.follow()
            found.append(tick)
        return found


@given(st.integers(0, 100), st.integers(0, 100), st.integers(1, 50))
def test_a_plant_heard_in_mid_flight_is_heard_from_then_on(
    joints_from: int, base_from: int, more: int
) -> None:
    """One half is heard before the other; what has come of the other is looked through for it."""
    bench, whole = Bench(ROBOT), max(joints_from, base_from)
    for tick in range(whole + more):
        halves = [topics.JOINT_STATES] if tick >= joints_from else []
        halves += [topics.BASE_STATE] if tick >= base_from else []
        bench.send(tick, *halves)
    for _ in range(joints_from, whole + 1):
        bench.take_all()
    for tick in range(whole + more, whole + more + 30):
        bench.send(tick, topics.JOINT_STATES, topics.BASE_STATE)
        assert bench.take_all() == [tick]
    assert [queue.source.others_messages for queue in bench.input.inputs] == [0, 0]
