"""The controller's state from its parts, whenever these were heard first."""

from __future__ import annotations

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from paths import CONFIG
from queued_input import QueuedInput

from space_robot_model.robot import Robot
from space_robot_msgs_py import topics
from space_robot_msgs_py.samples import RobotNames, RobotState, Timebase
from space_robot_msgs_py.wire.codecs import StateCodec

pytest.importorskip("rclpy")

from space_robot_control.controller import state_input
from space_robot_control.controller.state_input import StateInput

TIMEBASE = Timebase(500_000)
ROBOT = Robot.from_yaml(CONFIG / "robots" / "paper.yaml")


class Bench:
    """A plant that sends, and the input of a controller that has just joined."""

    def __init__(self, robot: Robot, wheels: int = 0) -> None:
        self._wheels = wheels
        names = RobotNames(robot.joint_names, tuple(f"wheel_{k + 1}" for k in range(wheels)))
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(state_input, "FollowedSubscription", QueuedInput)
            no_node: Any = None
            self.input = StateInput(no_node, names, TIMEBASE)
        self._codec = StateCodec(names, TIMEBASE)
        self._state = RobotState.allocate(robot.n)

    def send(self, tick: int, *parts: topics.Topic, number: int = -1) -> None:
        """Send a state, the ``number``-th (-1: the tick-th), of which some parts are heard."""
        self._state.tick = tick
        self._state.joint_positions[:] = self._state.base_position[:] = tick
        self._state.wheel_velocities[: self._wheels] = tick
        queues: Any = self.input.inputs
        for queue, data in zip(queues, self._codec.encode(self._state), strict=True):
            if queue.topic in parts:
                queue.send(data, (tick if number < 0 else number) + 1)

    def take_all(self) -> list[int]:
        """Take what is there as the controller does, which follows what it believes."""
        found = []
        while (tick := self.input.take()) is not None:
            state = self.input.state
            assert state.joint_positions[0] == state.base_position[0] == tick
            assert (state.wheel_velocities[: self._wheels] == tick).all()
            self.input.follow()
            found.append(tick)
        return found


@given(st.tuples(*3 * [st.integers(0, 100)]), st.integers(1, 50), st.sampled_from([0, 1, 4]))
def test_a_plant_heard_in_mid_flight_is_heard_from_then_on(
    begin: tuple[int, ...], more: int, wheels: int
) -> None:
    """One part is heard before another; what has come of that is looked through for it."""
    bench = Bench(ROBOT, wheels)
    heard_from = dict(zip([queue.topic for queue in bench.input.inputs], begin, strict=False))
    whole = max(heard_from.values())
    for tick in range(whole + more):
        bench.send(tick, *(topic for topic, first in heard_from.items() if tick >= first))
    for _ in range(min(heard_from.values()), whole + 1):
        bench.take_all()
    for tick in range(whole + more, whole + more + 30):
        bench.send(tick, *heard_from)
        assert bench.take_all() == [tick]
    assert not any(queue.source.others_messages for queue in bench.input.inputs)
    assert all(queue.source.is_followed for queue in bench.input.inputs)


@pytest.mark.parametrize("part", range(3))
def test_a_state_that_was_sent_without_a_part_is_passed_over(
    part: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    bench = Bench(ROBOT, wheels=4)
    parts = [queue.topic for queue in bench.input.inputs]
    monkeypatch.setattr(state_input, "TIMEOUT_S", 0.0)
    found = []
    for tick in range(10):
        others = [topic for k, topic in enumerate(parts) if k != part]
        bench.send(tick, *others)
        if tick != 5:
            bench.send(tick, parts[part], number=tick - (tick > 5))
        found += bench.take_all()
    assert found == [tick for tick in range(10) if tick != 5]


def test_a_state_that_is_not_followed_leaves_every_sender_unknown() -> None:
    bench = Bench(ROBOT, wheels=4)
    for tick in range(20):
        bench.send(tick, *(queue.topic for queue in bench.input.inputs))
        bench.input.take()
    assert not any(queue.source.is_followed for queue in bench.input.inputs)


def test_a_controller_of_wheels_listens_to_them_and_not_to_thrusters() -> None:
    parts = [queue.topic for queue in Bench(ROBOT, wheels=3).input.inputs]
    assert parts == [topics.JOINT_STATES, topics.WHEELS_STATE, topics.BASE_STATE]
