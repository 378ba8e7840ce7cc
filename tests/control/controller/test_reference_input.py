"""The controller's reference from its two halves, and what is told while it stays away."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from paths import CONFIG
from queued_input import QueuedInput

from space_robot_model.robot import Robot
from space_robot_msgs_py.errors import FlightError
from space_robot_msgs_py.samples import ReferenceChunk, Timebase
from space_robot_msgs_py.wire.reference_codec import ReferenceCodec

pytest.importorskip("rclpy")

from space_robot_control.controller import reference_input
from space_robot_control.controller.reference_input import WAIT_TOLD_S, ReferenceInput

TIMEBASE = Timebase(500_000)
ROBOT = Robot.from_yaml(CONFIG / "robots" / "paper.yaml")
TIMEOUT_S = 0.25


class Bench:
    """A mission that sends, and the input of a controller by a clock of the test's."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, join_timeout_s: float = 0.0) -> None:
        self.now = 100.0
        clock = SimpleNamespace(monotonic=lambda: self.now)
        monkeypatch.setattr(reference_input, "time", clock)
        monkeypatch.setattr(reference_input, "TrustedSubscription", QueuedInput)
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
    bench = Bench(monkeypatch)
    assert bench.joint(0) is None
    assert bench.input.is_awaited
    assert not bench.input.is_waited_for
    bench.now += 0.9 * WAIT_TOLD_S
    assert bench.joint(0) is None
    assert not bench.input.is_waited_for
    bench.now += 0.2 * WAIT_TOLD_S  # since the first look, not since the last
    assert bench.joint(0) is None
    assert bench.input.is_waited_for
    bench.send(0, 5)
    assert bench.joint(0) == 0.0
    assert not bench.input.is_waited_for
    assert not bench.input.is_awaited


def test_a_mission_that_stays_away_in_flight_is_held_after_the_timeout(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    bench = Bench(monkeypatch)
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
    bench = Bench(monkeypatch, join_timeout_s=9.0)

    def wait_until(end: float) -> None:
        while bench.now < end:
            assert bench.joint(0) is None
            bench.now += 0.1

    wait_until(108.9)
    with pytest.raises(FlightError, match=r"no reference for tick 0 within 9 s \(join_timeout\)"):
        wait_until(110.0)
    bench = Bench(monkeypatch, join_timeout_s=9.0)
    bench.send(0, 3)
    assert bench.joint(2) == 2.0
    for _ in range(20):
        bench.joint(3)
        bench.now += 1.0
    assert bench.joint(3) == 2.0
