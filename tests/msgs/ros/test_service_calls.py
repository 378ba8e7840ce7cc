"""Service calls between the ticks: one at a time, all of them in the end, a storm told."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from typing import Any

import pytest

from space_robot_msgs_py.ros.process_environment import set_defaults

set_defaults()
rclpy = pytest.importorskip("rclpy")

from rcl_interfaces.srv import GetParameters  # noqa: E402
from rclpy.executors import SingleThreadedExecutor  # noqa: E402

from space_robot_msgs_py.ros import node_scheduler, service_calls  # noqa: E402
from space_robot_msgs_py.ros.node_scheduler import PERIOD_S, Upkeep  # noqa: E402
from space_robot_msgs_py.ros.service_calls import ServiceCalls  # noqa: E402

REQUESTS = 8  # a client keeps ten answers


@pytest.fixture
def node(domain: int) -> Iterator[Any]:
    rclpy.init(args=[], domain_id=domain)
    node = rclpy.create_node("asked")
    node.declare_parameter("law", "ctc")
    yield node
    node.destroy_node()
    rclpy.try_shutdown()


@pytest.fixture
def ask(node: Any, domain: int) -> Iterator[Callable[[], list[Any]]]:
    """Send a burst of requests; their answers, once they are there."""
    context = rclpy.Context()
    rclpy.init(args=[], context=context, domain_id=domain)
    asking = rclpy.create_node("asking", context=context)
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(asking)
    client = asking.create_client(GetParameters, "/asked/get_parameters")
    assert client.wait_for_service(30.0)
    futures: list[Any] = []

    def run(count: int = 0) -> list[Any]:
        futures.extend(
            client.call_async(GetParameters.Request(names=["law"])) for _ in range(count)
        )
        executor.spin_once(timeout_sec=0.0)
        return [future for future in futures if future.done()]

    yield run
    asking.destroy_node()
    context.try_shutdown()


def test_one_at_a_time_until_all_are_answered(node: Any, ask: Callable[..., list[Any]]) -> None:
    calls = ServiceCalls(node)
    assert not calls.run_one()
    ask(REQUESTS)
    until = time.monotonic() + 30.0
    while calls.count < REQUESTS and time.monotonic() < until:
        before = calls.count
        has_run = calls.run_one()
        assert calls.count == before + has_run
    while len(ask()) < REQUESTS and time.monotonic() < until:
        pass
    assert len(ask()) == calls.count == REQUESTS
    calls.shutdown()


def test_a_storm_is_known_while_it_lasts(
    node: Any, ask: Callable[..., list[Any]], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(service_calls, "OVERLOADED_S", 0.05)
    calls = ServiceCalls(node)
    ask(REQUESTS)
    time.sleep(0.3)
    assert calls.run_one()
    assert not calls.is_overloaded
    time.sleep(0.06)
    assert calls.run_one()
    assert calls.is_overloaded
    while calls.run_one():
        pass
    assert not calls.is_overloaded
    calls.shutdown()


def test_what_comes_after_a_call_is_no_storm(
    node: Any, ask: Callable[..., list[Any]], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The loop that a call has started takes a while until it looks for calls again."""
    monkeypatch.setattr(service_calls, "OVERLOADED_S", 0.05)
    calls = ServiceCalls(node)
    ask(2)
    time.sleep(0.3)
    assert calls.run_one()
    assert calls.run_one()
    time.sleep(0.06)
    assert not calls.is_overloaded
    calls.shutdown()


def test_a_few_slow_calls_are_no_storm(
    node: Any, ask: Callable[..., list[Any]], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Transitions, and what else waits while a process is too busy to be asked."""
    monkeypatch.setattr(service_calls, "OVERLOADED_S", 0.25)
    monkeypatch.setattr(service_calls, "COUNTED_S", 0.1)
    calls = ServiceCalls(node)
    ask(4)
    time.sleep(0.3)
    judged = []
    while calls.run_one():
        judged.append(calls.is_overloaded)
        time.sleep(0.3)
    assert judged == [False, False, False, True]
    calls.shutdown()


class _Asked:
    """A node that always has calls waiting, for `Upkeep`, and the clock that both go by."""

    def __init__(self, took_s: float) -> None:
        self.took_s, self.count, self.calls = took_s, 0, self
        self.now = 1000.0

    def monotonic(self) -> float:
        return self.now

    def run_one(self, timeout_s: float) -> bool:
        self.now += self.took_s
        self.count += 1
        return True

    def report(self) -> None:
        pass


@pytest.fixture
def calls_in_half_a_second(monkeypatch: pytest.MonkeyPatch) -> Callable[[float], int]:
    def count(took_s: float) -> int:
        node: Any = _Asked(took_s)
        monkeypatch.setattr(node_scheduler, "time", node)
        served, begin = Upkeep(node), node.now
        while node.now < begin + 0.5:
            node.now = max(node.now + 1e-4, served.run())
        return int(node.count)

    return count


def test_calls_take_a_tenth_of_the_loop_but_are_not_ten_a_second(
    calls_in_half_a_second: Callable[[float], int],
) -> None:
    assert 0.5 / PERIOD_S < calls_in_half_a_second(0.002) <= 0.5 * 0.1 / 0.002 + 2


def test_long_calls_take_a_tenth_of_the_loop_too(
    calls_in_half_a_second: Callable[[float], int],
) -> None:
    """As the answers to a client that has gone."""
    assert calls_in_half_a_second(0.04) <= 2


def test_in_flight_a_report_never_comes_with_a_call() -> None:
    """Both in one turn would last longer than a tick leaves free; neither starves the other."""
    told: list[str] = []

    class Asked(_Asked):
        def run_one(self, timeout_s: float) -> bool:
            told.append("call")
            return True

        def report(self) -> None:
            told.append("report")

    served: Any = Asked(0.0)
    kept = Upkeep(served)
    turns = []
    until = time.monotonic() + 30.0
    while told.count("report") < 3 and time.monotonic() < until:
        before = len(told)
        kept.run()
        turns.append(len(told) - before)
    assert max(turns) == 1
    assert told.count("report") == 3
    assert told.count("call") > 3


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
