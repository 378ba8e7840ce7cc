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
            patch.setattr(state_input, "TrustedSubscription", QueuedInput)
            no_node: Any = None
            self.input = StateInput(no_node, names, TIMEBASE)
        self._codec = StateCodec(names, TIMEBASE)
        self._state = RobotState.allocate(robot.n)

    def send(self, tick: int, *parts: topics.Topic) -> None:
        """Send a state, of which some parts are heard."""
        self._state.tick = tick
        self._state.joint_positions[:] = self._state.base_position[:] = tick
        self._state.wheel_velocities[: self._wheels] = tick
        queues: Any = self.input.inputs
        for queue, data in zip(queues, self._codec.encode(self._state), strict=True):
            if queue.topic in parts:
                queue.send(data)

    def take_all(self) -> list[int]:
        """Take what is there."""
        found = []
        while (tick := self.input.take()) is not None:
            state = self.input.state
            assert state.joint_positions[0] == state.base_position[0] == tick
            assert (state.wheel_velocities[: self._wheels] == tick).all()
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


@pytest.mark.parametrize("part", range(3))
def test_a_state_that_was_sent_without_a_part_is_passed_over(
    part: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The ones behind it are not, though their parts are heard while its own is looked for."""
    bench = Bench(ROBOT, wheels=4)
    parts = [queue.topic for queue in bench.input.inputs]
    monkeypatch.setattr(state_input, "TIMEOUT_S", 0.0)
    found = []
    for tick in range(10):
        bench.send(tick, *(topic for k, topic in enumerate(parts) if k != part or tick != 5))
        found += bench.take_all()
    assert found == [tick for tick in range(10) if tick != 5]


def test_a_part_that_comes_ahead_is_kept_for_its_state() -> None:
    """Else a controller that is quick enough would be one part behind for good."""
    bench = Bench(ROBOT)
    joints, base = (queue.topic for queue in bench.input.inputs)
    bench.send(0, joints)
    bench.send(1, base)
    assert bench.input.take() is None  # the base's part of tick 0 was never heard
    bench.send(1, joints)
    assert bench.take_all() == [1]


def test_what_came_ahead_is_forgotten_when_a_new_time_begins() -> None:
    bench = Bench(ROBOT)
    joints, base = (queue.topic for queue in bench.input.inputs)
    bench.send(500, joints)
    bench.send(501, base)
    assert bench.input.take() is None
    for tick in range(3):
        bench.send(tick, joints, base)
        assert bench.take_all() == [tick]


def test_a_part_that_cannot_be_read_costs_its_state_alone() -> None:
    bench = Bench(ROBOT)
    joints, base = (queue.topic for queue in bench.input.inputs)
    bench.send(0, joints)
    queue: Any = bench.input.inputs[1]
    queue.send(b"junk")
    assert bench.input.take() is None
    assert sum(bench.input.rejected.values()) == 1
    bench.send(1, joints, base)
    assert bench.take_all() == [1]


def test_a_controller_of_wheels_listens_to_them_and_not_to_thrusters() -> None:
    parts = [queue.topic for queue in Bench(ROBOT, wheels=3).input.inputs]
    assert parts == [topics.JOINT_STATES, topics.WHEELS_STATE, topics.BASE_STATE]
