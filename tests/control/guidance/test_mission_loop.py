"""The mission's loop without a graph: what it streams, how far ahead, by whose clock."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Iterable
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from space_robot_control.guidance.mission import MissionNodeSettings
from space_robot_model.robot import Robot
from space_robot_msgs_py import topics
from space_robot_msgs_py.wire.telemetry import ClockCodec, ReferenceCodec

pytest.importorskip("rclpy")

from space_robot_control.guidance import loop, mission_changes
from space_robot_control.guidance.loop import CLOCK_WAIT_S, MOST_AT_ONCE, RESEND_S, MissionLoop
from space_robot_control.guidance.mission import Mission
from space_robot_control.guidance.mission_changes import WARNING_S
from space_robot_msgs_py.ros.loop import Level

CHUNK, LEAD = 10, 35
NO_TRAJECTORIES = {"trajectories accepted": 0, "trajectories refused": 0}
PERIOD_NS = 500_000


class Topic:
    """Publisher or subscription: what was sent, and what is to be taken."""

    def __init__(self, node: Node, topic: topics.Topic, *_: object, depth: int = 0) -> None:
        self.sent: list[bytes] = []
        self.waiting: deque[bytes] = deque()
        self.listener_count = 0
        node.by_name[topic.name] = self

    def publish(self, data: bytes) -> None:
        self.sent.append(data)

    def take(self) -> bytes | None:
        return self.waiting.popleft() if self.waiting else None


class Node:
    def __init__(self) -> None:
        self.by_name: dict[str, Topic] = {}
        self.said: list[str] = []
        self.on_set: list[Any] = []

    def add_on_set_parameters_callback(self, callback: Any) -> None:
        self.on_set.append(callback)

    def log(self, text: str) -> None:
        self.said.append(text)


class Bench:
    """The loop, by a clock of the test's own."""

    def __init__(self, robot: Robot, patch: pytest.MonkeyPatch, chunk: int = CHUNK) -> None:
        self.now, self.chunk = 1000.0, chunk
        patch.setattr(time, "monotonic", lambda: self.now)
        for name in ("RawPublisher", "RawSubscription"):
            patch.setattr(loop, name, Topic)
        patch.setattr(mission_changes, "RawSubscription", Topic)
        self.settings = MissionNodeSettings.resolve({"chunk_ticks": chunk, "lead_ticks": LEAD})
        self.node: Any = Node()
        self.loop = MissionLoop(self.node, self.settings)
        self.loop.begin()
        self._codec = ReferenceCodec(robot.joint_names, self.settings.timebase)
        self._mission = Mission(robot, self.settings, self.settings.period)
        self.joints, self.base, self.clock = (
            self.node.by_name[topic.name]
            for topic in (topics.REFERENCE_JOINTS, topics.REFERENCE_BASE, topics.CLOCK)
        )

    def hear(self, ticks: Iterable[int]) -> None:
        self.clock.waiting.extend(ClockCodec().encode(tick * PERIOD_NS) for tick in ticks)

    def run(self) -> list[int]:
        """Step until it waits; the first ticks of the chunks sent, each the mission's own."""
        self.joints.sent.clear()
        self.base.sent.clear()
        steps = (self.loop.step() for _ in range(100_000))
        wait = next(wait for wait in steps if wait is not None)
        assert wait.seconds == CLOCK_WAIT_S
        assert wait.inputs == (self.clock,)
        starts = []
        for joints, base in zip(self.joints.sent, self.base.sent, strict=True):
            start, rows = self._codec.decode_joints(joints)
            own = self._mission.chunk(start, self.chunk)
            np.testing.assert_array_equal(rows, own.joints)
            same, rows = self._codec.decode_base(base)
            np.testing.assert_array_equal(rows, own.base)
            assert same == start
            starts.append(start)
        return starts


@pytest.fixture
def bench(paper_robot: Robot, monkeypatch: pytest.MonkeyPatch) -> Bench:
    return Bench(paper_robot, monkeypatch)


def test_the_stream_is_kept_a_lead_ahead_of_the_clock(bench: Bench) -> None:
    assert bench.run() == [0, 10, 20, 30], "before the clock is heard, from the mission's begin"
    bench.hear([0])
    assert bench.run() == []
    bench.hear(range(1, 6))
    assert bench.run() == []
    bench.hear([6])
    assert bench.run() == [40]
    bench.hear([30])
    assert bench.run() == [50, 60]
    assert bench.loop.health().values["tick"] == 30


def test_who_joins_is_told_again_what_is_still_needed(bench: Bench) -> None:
    bench.hear([0, 33])
    assert bench.run() == [0, 10, 20, 30, 40, 50, 60]
    bench.joints.listener_count = bench.base.listener_count = 1
    assert bench.run() == [], "nobody looks so soon"
    bench.now += RESEND_S
    assert bench.run() == [30, 40, 50, 60]
    for count in (1, 0):
        bench.base.listener_count = count
        bench.now += RESEND_S
        assert bench.run() == []
    bench.base.listener_count = 1
    bench.now += RESEND_S
    assert bench.run() == [30, 40, 50, 60]


def test_in_the_midst_of_a_flight_nothing_is_said_of_its_past(bench: Bench) -> None:
    bench.joints.listener_count = 1
    bench.run()
    bench.hear([5003])
    assert bench.run() == [5000, 5010, 5020, 5030]
    assert bench.node.said == []


def test_a_new_time_has_a_new_stream(bench: Bench) -> None:
    """Several stamps that agree are one; a single one is wrong, and its sender doubted."""
    bench.hear([1000])
    bench.run()
    bench.hear([3, 1001, 10**9, 1002])
    assert bench.run() == []
    assert bench.loop.health().values["rejected: stamp"] == 2
    bench.hear(range(20, 25))
    assert bench.run() == [20, 30, 40, 50]
    assert bench.node.said == ["a new time begins at tick 24, after 1002: the stream too"]
    values = bench.loop.health().values
    assert values == {"tick": 24, "rejected: stamp": 6, **NO_TRAJECTORIES}


def test_after_an_activation_it_says_that_it_is_active_again(
    paper_robot: Robot, monkeypatch: pytest.MonkeyPatch
) -> None:
    bench = Bench(paper_robot, monkeypatch, chunk=1000)
    bench.hear([0])
    bench.run()
    bench.loop.begin()
    later = round(61.0 / bench.settings.period)
    bench.hear(range(later, later + 6))
    bench.run()
    assert bench.node.said == [f"active again at tick {later + 4}, after 0: the stream too"]
    bench.loop.begin()
    bench.hear(range(20, 26))
    bench.run()
    assert bench.node.said[1] == f"a new time begins at tick 24, after {later + 5}: the stream too"


def test_stamps_that_are_no_tick_or_a_stop_above_a_minute_are_counted(
    paper_robot: Robot, monkeypatch: pytest.MonkeyPatch
) -> None:
    bench = Bench(paper_robot, monkeypatch, chunk=1000)
    assert bench.loop.health().values["tick"] == 0
    bench.hear([5, 5, 5])
    bench.clock.waiting.append(ClockCodec().encode(PERIOD_NS + 1))
    bench.clock.waiting.append(b"no clock")
    longest = 5 + round(60.0 / bench.settings.period)
    for stamps, tick, rejected in (
        ([], 5, 2),
        ([longest], longest, 2),
        ([2 * longest], longest, 3),
    ):
        bench.hear(stamps)
        bench.run()
        values = bench.loop.health().values
        assert (values["tick"], values["rejected: stamp"]) == (tick, rejected)


def test_the_stream_goes_on_while_the_clock_is_flooded(bench: Bench) -> None:
    bench.run()
    bench.hear(range(2 * MOST_AT_ONCE + 1))
    assert bench.loop.step() is None
    assert len(bench.clock.waiting) == MOST_AT_ONCE + 1
    assert len(bench.joints.sent) == 4 + 1
    assert bench.run() == [*range(50, 2 * MOST_AT_ONCE + LEAD, CHUNK)]


@pytest.mark.parametrize("error", [MemoryError, ZeroDivisionError])
def test_what_nobody_foresaw_in_a_plan_is_a_refusal(
    bench: Bench, error: type[Exception], monkeypatch: pytest.MonkeyPatch
) -> None:
    def plan(*_: object) -> None:
        raise error("unforeseen,\nin two lines")

    monkeypatch.setattr(Mission, "go_to", plan)
    (on_set,) = bench.node.on_set
    result = on_set([SimpleNamespace(name="goto", value="{hold: 1}")])
    assert not result.successful
    assert result.reason == f"it cannot be planned ({error.__name__}: unforeseen, in two lines)"
    assert bench.run() == [0, 10, 20, 30], "the stream goes on"


def test_junk_on_the_topic_of_trajectories_is_refused_in_one_line(bench: Bench) -> None:
    trajectories = bench.node.by_name[topics.JOINT_TRAJECTORY.name]
    trajectories.waiting.extend([b"", b"\0\1\0\0junk", bytes(40)])
    bench.loop.step()
    refused = [line for line in bench.node.said if line.startswith("refused a trajectory")]
    assert len(refused) == 3
    assert not any("\n" in line for line in refused)
    told = [bench.loop.health() for _ in range(4)]
    assert told[0].values["trajectories refused"] == 3
    assert [health.mode for health in told] == [*refused, refused[-1]]
    assert {health.level for health in told} == {Level.WARN}
    bench.now += WARNING_S
    assert (bench.loop.health().mode, bench.loop.health().level) == ("nominal", Level.OK)
