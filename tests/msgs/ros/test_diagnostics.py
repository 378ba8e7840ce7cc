"""What a node reports of itself: when, and at which simulated time."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

pytest.importorskip("rclpy")

from space_robot_msgs_py.ros.diagnostics import Diagnostics
from space_robot_msgs_py.ros.health import Health, Level
from space_robot_msgs_py.samples import Timebase


class Node:
    """A node without a graph, which keeps what is published."""

    def __init__(self) -> None:
        self.sent: list[Any] = []

    def create_publisher(self, *of: object) -> Any:
        return SimpleNamespace(publish=self.sent.append)

    def get_logger(self) -> Any:
        return SimpleNamespace(info=lambda text: None, warning=lambda text: None)

    def get_fully_qualified_name(self) -> str:
        return "/sat1/plant_node"


@given(tick=st.integers(0, 10**10), period_ns=st.integers(10_000, 100_000_000))
def test_the_stamp_is_the_simulated_time_of_the_tick(tick: int, period_ns: int) -> None:
    node: Any = Node()
    Diagnostics(node).report(Health("nominal", values={"tick": tick}), Timebase(period_ns))
    stamp = node.sent[0].header.stamp
    if tick * period_ns < 2**31 * 10**9:  # what a stamp can hold
        assert (stamp.sec, stamp.nanosec) == divmod(tick * period_ns, 10**9)


@pytest.mark.parametrize("values", [{}, {"tick": -1}])
def test_before_the_first_tick_it_is_zero(values: dict[str, int]) -> None:
    node: Any = Node()
    Diagnostics(node).report(Health("waiting", values=values), Timebase(500_000))
    assert (node.sent[0].header.stamp.sec, node.sent[0].header.stamp.nanosec) == (0, 0)


def test_every_change_of_mode_or_level_is_reported_and_nothing_else_at_once() -> None:
    node: Any = Node()
    diagnostics, timebase = Diagnostics(node), Timebase(500_000)
    reports = [
        Health("nominal"),
        Health("nominal", values={"tick": 3}),
        Health("nominal", Level.WARN),
        Health("holding", Level.WARN),
        Health("holding", Level.WARN),
        Health("nominal"),
    ]
    for health in reports:
        diagnostics.report(health, timebase)
    told = [(array.status[0].message, array.status[0].level) for array in node.sent]
    assert told == [("nominal", b"\0"), ("nominal", b"\1"), ("holding", b"\1"), ("nominal", b"\0")]
