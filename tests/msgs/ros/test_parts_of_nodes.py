"""What nodes have of ROS: claimed topics, raw messages, reports, service calls between ticks."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from types import SimpleNamespace
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from space_robot_msgs_py import topics
from space_robot_msgs_py.ros.process import set_defaults
from space_robot_msgs_py.samples import Timebase

set_defaults()
rclpy = pytest.importorskip("rclpy")

from rcl_interfaces.srv import GetParameters  # noqa: E402
from rclpy.executors import SingleThreadedExecutor  # noqa: E402

from space_robot_msgs_py.ros.endpoints import (  # noqa: E402
    PolledCallbackGroup,
    RawPublisher,
    RawSubscription,
    Received,
)
from space_robot_msgs_py.ros.loop import Health, Level  # noqa: E402
from space_robot_msgs_py.ros.managed_node import Diagnostics  # noqa: E402
from space_robot_msgs_py.ros.service_calls import ServiceCalls  # noqa: E402

TIMEOUT_S = 240.0
REQUESTS = 8  # a client keeps ten answers
Make = Callable[..., "rclpy.node.Node"]


def until(done: Callable[[], bool]) -> None:
    end = time.monotonic() + TIMEOUT_S
    while not done():
        assert time.monotonic() < end
        time.sleep(0.005)


@pytest.fixture
def make_node(domain: int) -> Iterator[Make]:
    made = []

    def make(name: str, **options: object) -> rclpy.node.Node:
        context = rclpy.Context()
        rclpy.init(args=[], context=context, domain_id=domain)
        made.append(rclpy.create_node(name, context=context, **options))
        return made[-1]

    yield make
    for node in made:  # now, not by a collection of garbage in another test
        node.destroy_node()
        node.context.try_shutdown()


# Topics and their messages


def _next(entry: RawSubscription) -> Received:
    found: list[Received] = []

    def is_there() -> bool:
        found.extend(filter(None, [entry.take_with_info()]))
        return bool(found)

    until(is_there)
    return found[0]


def test_number_and_time_of_every_message(make_node: Make) -> None:
    node = make_node("sender")
    entry = RawSubscription(node, topics.COMMAND, PolledCallbackGroup())
    out = RawPublisher(node, topics.COMMAND)
    until(lambda: out.listener_count > 0)
    begin_ns = time.time_ns()
    for number, size in enumerate((16, 12_000, 40), 1):
        data = b"\x00\x01\x00\x00" + bytes([number]) * (size - 4)
        out.publish(data)
        taken = _next(entry)
        assert (taken.data, taken.sequence) == (data, number)
        assert begin_ns <= taken.sent_ns <= time.time_ns()
    assert entry.take_with_info() is None
    assert out.sent == 3


# Reports


class Publishing:
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
    node: Any = Publishing()
    Diagnostics(node).report(Health("nominal", values={"tick": tick}), Timebase(period_ns))
    stamp = node.sent[0].header.stamp
    if tick * period_ns < 2**31 * 10**9:  # what a stamp can hold
        assert (stamp.sec, stamp.nanosec) == divmod(tick * period_ns, 10**9)


@pytest.mark.parametrize("values", [{}, {"tick": -1}])
def test_before_the_first_tick_it_is_zero(values: dict[str, int]) -> None:
    node: Any = Publishing()
    Diagnostics(node).report(Health("waiting", values=values), Timebase(500_000))
    assert (node.sent[0].header.stamp.sec, node.sent[0].header.stamp.nanosec) == (0, 0)


def test_every_change_of_mode_or_level_is_reported_and_nothing_else_at_once() -> None:
    node: Any = Publishing()
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


# Service calls


@pytest.fixture
def node(domain: int) -> Iterator[Any]:
    """Of the default context, which the calls' executor is in."""
    rclpy.init(args=[], domain_id=domain)
    node = rclpy.create_node("asked")
    node.declare_parameter("law", "ctc")
    yield node
    node.destroy_node()
    rclpy.try_shutdown()


def test_one_at_a_time_until_all_are_answered(node: Any, make_node: Make) -> None:
    asking = make_node("asking")
    executor = SingleThreadedExecutor(context=asking.context)
    executor.add_node(asking)
    client = asking.create_client(GetParameters, "/asked/get_parameters")
    assert client.wait_for_service(TIMEOUT_S)
    calls = ServiceCalls(node)
    assert not calls.run_one()
    futures = [client.call_async(GetParameters.Request(names=["law"])) for _ in range(REQUESTS)]
    until = time.monotonic() + TIMEOUT_S
    while not all(future.done() for future in futures):
        assert time.monotonic() < until
        before = calls.count
        assert calls.run_one() == calls.count - before
        executor.spin_once(timeout_sec=0.0)
    assert calls.count == REQUESTS
    calls.shutdown()


def test_tasks_of_rclpy_wait_for_no_request(node: Any) -> None:
    """As an action's, of which one starts a goal and another one sends its result."""
    calls = ServiceCalls(node)
    while calls.run_one():
        pass
    done: list[int] = []
    for k in range(3):
        calls.create_task(done.append, k)
    assert all(calls.run_one() for _ in range(3))
    assert sorted(done) == [0, 1, 2]
    assert not calls.run_one()
    calls.shutdown()
