"""What a controller hears: states and references from their parts, the ring of rows."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from paths import CONFIG
from queued_input import QueuedInput

from space_robot_control.controller.reference_buffer import (
    MOST_PUT_ASIDE,
    PAST_SHARE,
    ReferenceBuffer,
)
from space_robot_model.robot import Robot
from space_robot_msgs_py import topics
from space_robot_msgs_py.errors import FlightError, MessageError
from space_robot_msgs_py.samples import Reference, ReferenceChunk, RobotNames, RobotState, Timebase
from space_robot_msgs_py.wire.codecs import StateCodec
from space_robot_msgs_py.wire.telemetry import ReferenceCodec

pytest.importorskip("rclpy")


from space_robot_control.controller import inputs
from space_robot_control.controller.inputs import OVERDUE_S, ReferenceInput, StateInput

TIMEBASE = Timebase(500_000)
ROBOT = Robot.from_yaml(CONFIG / "robots" / "paper.yaml")
TIMEOUT_S = 0.25


# States


class States:
    """A plant that sends, and the input of a controller that has just joined."""

    def __init__(self, robot: Robot, wheels: int = 0) -> None:
        self._wheels = wheels
        names = RobotNames(robot.joint_names, tuple(f"wheel_{k + 1}" for k in range(wheels)))
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(inputs, "RawSubscription", QueuedInput)
            no_node: Any = None
            self.input = StateInput(no_node, names, TIMEBASE)
        self.parts = [queue.topic for queue in self.input.inputs]
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
    bench = States(ROBOT, wheels)
    heard_from = dict(zip(bench.parts, begin, strict=False))
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
    bench = States(ROBOT, wheels=4)
    monkeypatch.setattr(inputs, "TIMEOUT_S", 0.0)
    found = []
    for tick in range(10):
        bench.send(tick, *(topic for k, topic in enumerate(bench.parts) if k != part or tick != 5))
        found += bench.take_all()
    assert found == [tick for tick in range(10) if tick != 5]


def test_a_part_that_comes_ahead_is_kept_for_its_state() -> None:
    """Else a controller that is quick enough would be one part behind for good."""
    bench = States(ROBOT)
    joints, base = bench.parts
    bench.send(0, joints)
    bench.send(1, base)
    assert bench.input.take() is None  # the base's part of tick 0 was never heard
    bench.send(1, joints)
    assert bench.take_all() == [1]


def test_what_came_ahead_is_forgotten_when_a_new_time_begins() -> None:
    bench = States(ROBOT)
    joints, base = bench.parts
    bench.send(500, joints)
    bench.send(501, base)
    assert bench.input.take() is None
    for tick in range(3):
        bench.send(tick, joints, base)
        assert bench.take_all() == [tick]


def test_a_part_that_cannot_be_read_costs_its_state_alone() -> None:
    bench = States(ROBOT)
    joints, base = bench.parts
    bench.send(0, joints)
    queue: Any = bench.input.inputs[1]
    queue.send(b"junk")
    assert bench.input.take() is None
    assert sum(bench.input.rejected.values()) == 1
    bench.send(1, joints, base)
    assert bench.take_all() == [1]


def test_a_controller_of_wheels_listens_to_them_and_not_to_thrusters() -> None:
    assert States(ROBOT, wheels=3).parts == [
        topics.JOINT_STATES,
        topics.WHEELS_STATE,
        topics.BASE_STATE,
    ]


# References


class References:
    """A mission that sends, and the input of a controller by a clock of the test's."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, join_timeout_s: float = 0.0) -> None:
        self.now = 100.0
        clock = SimpleNamespace(monotonic=lambda: self.now)
        monkeypatch.setattr(inputs, "time", clock)
        monkeypatch.setattr(inputs, "RawSubscription", QueuedInput)
        no_node: Any = None
        self.input = ReferenceInput(no_node, ROBOT, TIMEBASE, TIMEOUT_S, join_timeout_s)
        self._codec = ReferenceCodec(ROBOT.joint_names, TIMEBASE)

    def send(self, start: int, ticks: int) -> None:
        """Send a stretch whose values are the number of their tick."""
        rows = np.arange(start, start + ticks, dtype=float)
        joints = np.broadcast_to(rows[:, None, None], (ticks, 3, ROBOT.n)).copy()
        base = np.broadcast_to(rows[:, None], (ticks, 10)).copy()
        halves: Any = self.input.inputs
        chunk = ReferenceChunk(start, joints, base)
        for half, data in zip(halves, self._codec.encode(chunk), strict=True):
            half.send(data)

    def joint(self, tick: int) -> float | None:
        """Position of joint 1 that stands for ``tick``; None: nothing does yet."""
        row = self.input.at(tick)
        return None if row is None else float(row["joint_positions"].flat[0])


def test_a_mission_that_does_not_come_is_awaited_and_told_after_a_while(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    bench = References(monkeypatch)
    assert bench.joint(0) is None
    assert bench.input.is_awaited
    assert not bench.input.is_overdue
    bench.now += 0.9 * OVERDUE_S
    assert bench.joint(0) is None
    assert not bench.input.is_overdue
    bench.now += 0.2 * OVERDUE_S  # since the first look, not since the last
    assert bench.joint(0) is None
    assert bench.input.is_overdue
    bench.send(0, 5)
    assert bench.joint(0) == 0.0
    assert not bench.input.is_overdue
    assert not bench.input.is_awaited


def test_a_mission_that_stays_away_in_flight_is_held_after_the_timeout(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    bench = References(monkeypatch)
    bench.send(0, 5)
    assert [bench.joint(tick) for tick in range(5)] == [0.0, 1.0, 2.0, 3.0, 4.0]
    assert bench.joint(5) is None
    assert bench.input.is_awaited
    bench.now += 1.1 * TIMEOUT_S
    assert bench.joint(5) == 4.0
    assert bench.input.is_missing
    assert bench.input.held == 1
    assert bench.joint(6) == 4.0  # who is missing is not waited for again
    assert bench.input.held == 2
    bench.send(7, 3)
    assert [bench.joint(tick) for tick in (7, 8, 9)] == [7.0, 8.0, 9.0]
    assert not bench.input.is_missing
    assert bench.input.held == 2


def test_a_first_reference_that_is_overdue_ends_the_flight_and_a_later_one_is_held(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    bench = References(monkeypatch, join_timeout_s=9.0)

    def wait_until(end: float) -> None:
        while bench.now < end:
            assert bench.joint(0) is None
            bench.now += 0.1

    wait_until(108.9)
    with pytest.raises(FlightError, match=r"no reference for tick 0 within 9 s \(join_timeout\)"):
        wait_until(110.0)
    bench = References(monkeypatch, join_timeout_s=9.0)
    bench.send(0, 3)
    assert bench.joint(2) == 2.0
    for _ in range(20):
        bench.joint(3)
        bench.now += 1.0
    assert bench.joint(3) == 2.0


# The ring of their rows


CAPACITY = 32


def chunk(start: int, length: int, n: int = 2, version: float = 0.0) -> ReferenceChunk:
    """Rows that tell their tick."""
    ticks = np.arange(start, start + length, dtype=float)
    joints = ticks[:, None, None] + np.array([0.0, 0.1, 0.2])[:, None] + np.arange(n) * 1e-3
    return ReferenceChunk(start, joints + version, np.tile(ticks[:, None], 10) + 0.5 + version)


def assert_holds(buffer: ReferenceBuffer, tick: int) -> None:
    expected = chunk(tick, 1)
    assert buffer.covers(tick)
    np.testing.assert_array_equal(buffer.at(tick), expected.references())


def test_a_tick_sent_again_is_overwritten() -> None:
    """A changed plan: the last word counts."""
    buffer = ReferenceBuffer(2, CAPACITY)
    buffer.add(chunk(0, 8, version=1000.0))
    buffer.add(chunk(4, 4))
    assert_holds(buffer, 4)
    assert buffer.at(3)[0].quaternion[0] == 1003.5


@given(st.lists(st.tuples(st.integers(0, 5 * CAPACITY), st.integers(0, 2 * CAPACITY)), max_size=12))
def test_what_is_covered_is_always_right_and_the_newest_always_covered(
    arrivals: list[tuple[int, int]],
) -> None:
    """Any sequence of chunks, old ones repeated, empty or longer than the ring: place i holds the
    newest tick that fell on it."""
    buffer, newest = ReferenceBuffer(2, CAPACITY), {}
    for start, length in arrivals:
        buffer.add(chunk(start, length))
        for tick in range(start, start + length):
            newest[tick % CAPACITY] = max(tick, newest.get(tick % CAPACITY, 0))
    for tick in range(8 * CAPACITY):
        assert buffer.covers(tick) == (newest.get(tick % CAPACITY) == tick)
        if buffer.covers(tick):
            assert_holds(buffer, tick)


@given(
    st.integers(0, 10**6),
    st.lists(st.tuples(st.integers(-3 * CAPACITY, 3 * CAPACITY), st.integers(1, 8)), max_size=12),
)
def test_rows_around_now_are_kept_whatever_comes_from_elsewhere_in_time(
    now: int, others: list[tuple[int, int]]
) -> None:
    """Far ahead or long past, they take no place that is needed."""
    buffer = ReferenceBuffer(2, CAPACITY)
    buffer.begin(now)
    first = now - CAPACITY // PAST_SHARE
    buffer.add(chunk(now, 8))
    for offset, length in others:
        buffer.add(chunk(now + offset, length))
    for tick in range(now, now + 8):
        assert_holds(buffer, tick)
    for tick in range(now - 4 * CAPACITY, now + 4 * CAPACITY):
        if buffer.covers(tick):
            assert first <= tick < first + CAPACITY
            assert_holds(buffer, tick)


@given(st.integers(4 * CAPACITY, 10**6), st.integers(0, 2 * CAPACITY))
def test_a_new_time_finds_the_rows_that_came_before_it_was_known(old: int, new: int) -> None:
    """A mission that follows a new plant is faster than the states."""
    buffer = ReferenceBuffer(2, CAPACITY)
    buffer.begin(old)
    buffer.add(chunk(old, 4))
    buffer.add(chunk(new, 4))
    assert not buffer.covers(new)
    buffer.begin(new)
    for tick in range(new, new + 4):
        assert_holds(buffer, tick)
    buffer.add(chunk(new + 4, 4))
    assert_holds(buffer, new + 5)


def test_what_is_put_aside_is_bounded() -> None:
    buffer = ReferenceBuffer(2, CAPACITY)
    buffer.begin(10 * CAPACITY)
    for start in range(MOST_PUT_ASIDE):  # two halves each: the first ones are forgotten
        buffer.add(chunk(start % 5, 1))
    buffer.add(chunk(20, 1))
    buffer.begin(0)
    assert_holds(buffer, 20)
    assert_holds(buffer, 4)


@given(
    st.lists(st.tuples(st.integers(0, 3 * CAPACITY), st.integers(1, 8)), max_size=6),
    st.lists(st.tuples(st.integers(0, 3 * CAPACITY), st.integers(1, 8)), max_size=6),
    st.integers(0, 4 * CAPACITY),
)
def test_held_is_the_last_whole_point_before_at_rest(
    joints: list[tuple[int, int]], base: list[tuple[int, int]], tick: int
) -> None:
    """Of what is still in the ring; it needs both parts; a copy, and none from the future."""
    buffer = ReferenceBuffer(2, CAPACITY)
    for start, length in joints:
        buffer.add_joints(start, chunk(start, length).joints)
    for start, length in base:
        buffer.add_base(start, chunk(start, length).base)
    there = [k for k in range(tick + 1) if buffer.covers(k)]
    held = buffer.hold(tick)
    if not there:
        assert held is None
        return
    assert held is not None
    expected = chunk(there[-1], 1)
    expected.joints[0, 1:], expected.base[0, 4:] = 0.0, 0.0
    np.testing.assert_array_equal(held, expected.references())
    for part in Reference.parts(held):
        part[:] = -1.0
    assert_holds(buffer, there[-1])


@pytest.mark.parametrize("value", [np.nan, np.inf, -1e300])
@pytest.mark.parametrize("part", ["joints", "base"])
def test_rows_that_make_no_sense_are_refused_as_a_whole(part: str, value: float) -> None:
    """A law would carry a NaN on in its integral for ever."""
    buffer, bad = ReferenceBuffer(2, CAPACITY), chunk(0, 4)
    getattr(bad, part)[2, -1] = value
    with pytest.raises(MessageError, match="reference from tick 0") as caught:
        getattr(buffer, f"add_{part}")(0, getattr(bad, part))
    assert caught.value.reason == "not finite"
    buffer.add(chunk(0, 4))
    assert_holds(buffer, 2)
