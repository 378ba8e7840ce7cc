"""Service calls between the ticks: one at a time, all of them in the end, a storm told."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from types import SimpleNamespace
from typing import Any

import pytest

from space_robot_msgs_py.ros.process_environment import set_defaults

set_defaults()
rclpy = pytest.importorskip("rclpy")

from rcl_interfaces.srv import GetParameters  # noqa: E402
from rclpy.executors import SingleThreadedExecutor  # noqa: E402

from space_robot_msgs_py.ros import service_calls  # noqa: E402
from space_robot_msgs_py.ros.service_calls import COUNTED_S, OVERLOADED_S, ServiceCalls  # noqa: E402

REQUESTS = 8  # a client keeps ten answers
TIMEOUT_S = 30.0


@pytest.fixture
def node(domain: int) -> Iterator[Any]:
    rclpy.init(args=[], domain_id=domain)
    node = rclpy.create_node("asked")
    node.declare_parameter("law", "ctc")
    yield node
    node.destroy_node()
    rclpy.try_shutdown()


def test_one_at_a_time_until_all_are_answered(node: Any, domain: int) -> None:
    context = rclpy.Context()
    rclpy.init(args=[], context=context, domain_id=domain)
    asking = rclpy.create_node("asking", context=context)
    executor = SingleThreadedExecutor(context=context)
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
    asking.destroy_node()
    context.try_shutdown()


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


# Overload, by a clock of the test's own


@pytest.fixture
def judged(monkeypatch: pytest.MonkeyPatch, node: Any) -> Iterator[Callable[..., list[bool]]]:
    """What is said after each call of a row of them, so long after one another; None: a rest."""
    clock = SimpleNamespace(now=1000.0)
    monkeypatch.setattr(service_calls, "time", SimpleNamespace(monotonic=lambda: clock.now))
    calls, waiting = ServiceCalls(node), list[Any]()
    monkeypatch.setattr(calls, "_is_worth_a_look", lambda: True)
    monkeypatch.setattr(calls, "_next", lambda timeout_s: waiting.pop(0) if waiting else None)

    class Call:
        def __call__(self) -> None:
            pass

        def done(self) -> bool:
            return True

        def exception(self) -> None:
            return None

    def run(*after: float | None) -> list[bool]:
        found = []
        for seconds in after:
            clock.now += seconds or 10.0
            waiting.extend([] if seconds is None else [Call()])
            assert calls.run_one() == (seconds is not None)
            found.append(calls.is_overloaded)
        return found

    yield run
    calls.shutdown()


def test_a_storm_is_known_while_it_lasts(judged: Callable[..., list[bool]]) -> None:
    """Not by a few slow calls, nor by what comes after a rest."""
    many = round(OVERLOADED_S / COUNTED_S) + 2
    said = judged(*[0.9 * COUNTED_S] * 2 * many, None, *[0.9 * COUNTED_S] * 3)
    first = said.index(True)
    assert first * 0.9 * COUNTED_S > OVERLOADED_S >= (first - 1) * 0.9 * COUNTED_S
    assert all(said[first : 2 * many])
    assert not any(said[2 * many :])
    assert not any(judged(None, *[5 * OVERLOADED_S] * 3))
    assert judged(None, *[5 * OVERLOADED_S] * (many + 2))[-1], "many of them are one"
