"""The nodes of a process in turn, by a clock of the test's own: who is stepped, and when."""

from __future__ import annotations

import gc
import itertools
import sys
from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any

import pytest
from command import run_program

pytest.importorskip("rclpy")

from space_robot_msgs_py.ros import node_scheduler
from space_robot_msgs_py.ros.loop import Wait
from space_robot_msgs_py.ros.node_scheduler import (
    LISTENER_PERIOD_S,
    LONGEST_PAUSE_S,
    PERIOD_S,
    POLL_S,
    REMIND_S,
    SERVICE_SHARE,
    UPKEEP_GAP_S,
    UPKEEP_PATIENCE_S,
    NodeScheduler,
    ScheduledNode,
    Upkeep,
)


class Clock:
    """Goes on when somebody sleeps, and by a microsecond at every look."""

    def __init__(self) -> None:
        self.now = 1000.0
        self.slept: list[float] = []

    def monotonic(self) -> float:
        self.now += 1e-6
        return self.now

    def sleep(self, seconds: float) -> None:
        assert seconds > 0.0
        self.slept.append(seconds)
        self.now += seconds


class Loop:
    """Asks for one wait after the other, the last again and again; None: it did something."""

    wait_for = ("controller_node",)

    def __init__(self, *waits: Wait | None) -> None:
        self.waits = list(waits)
        self.is_complete = False
        self.begun = self.steps = 0
        self.missing: dict[str, list[str]] = {}
        self.outputs = [self._output(name) for name in ("/clock", "/joint_states")]

    def _output(self, name: str) -> Any:
        def missing(names: Sequence[str]) -> list[str]:
            assert names == self.wait_for
            return self.missing.get(name, [])

        return SimpleNamespace(full_name=name, missing_listeners=missing)

    def begin(self) -> None:
        self.begun += 1

    def step(self) -> Wait | None:
        self.steps += 1
        return self.waits.pop(0) if len(self.waits) > 1 else self.waits[0]


class Node:
    context = None

    def __init__(self, *waits: Wait | None, fifo: int = 0) -> None:
        self.loop = Loop(*waits)
        self.settings = SimpleNamespace(fifo_priority=fifo)
        self.is_active, self.is_shut_down = True, False
        self.said: list[str] = []
        self.reports = self.looks = 0
        self.waited_s = 0.0
        self.calls = SimpleNamespace(run_one=self._run_one)

    def log(self, text: str) -> None:
        self.said.append(text)

    def report(self) -> None:
        self.reports += 1

    def _run_one(self, timeout_s: float) -> bool:
        self.looks += 1
        self.waited_s += timeout_s
        return False


@pytest.fixture(autouse=True)
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    clock = Clock()
    monkeypatch.setattr(node_scheduler, "time", clock)
    monkeypatch.setattr(gc, "freeze", lambda: None)
    monkeypatch.setattr(gc, "collect", lambda: None)
    monkeypatch.setattr(node_scheduler, "ask_for_fifo", lambda priority: f"fifo {priority}")
    return clock


def scheduled_of(node: Any, is_alone: bool = True) -> ScheduledNode:
    return ScheduledNode(node, is_alone)


def scheduler_of(*nodes: Any, upkeep_at: float = 1e9) -> NodeScheduler:
    scheduler = NodeScheduler(nodes)
    scheduler._upkeep_at = upkeep_at
    return scheduler


def test_a_node_begins_once_all_its_listeners_are_there() -> None:
    """It is said from time to time who is waited for; one that stood still begins anew."""
    node = Node(Wait(10.0, is_brief=True))
    scheduled, loop = scheduled_of(node), node.loop
    loop.missing = {"/clock": ["a", "b"], "/joint_states": ["b"]}
    said = []
    for seconds in (0.0, REMIND_S, REMIND_S + 1.0, 2 * REMIND_S + 1.0, 2 * REMIND_S + 2.0):
        assert not scheduled.step(100.0 + seconds)
        said.append(len(node.said))
    assert said == [0, 0, 1, 1, 2]
    assert set(node.said) == {"waiting for a, b on /clock, b on /joint_states"}
    assert scheduled.wake_at == 100.0 + seconds + LISTENER_PERIOD_S
    loop.missing = {}
    scheduled.step(scheduled.wake_at - 0.5 * LISTENER_PERIOD_S)
    assert (loop.begun, loop.steps) == (0, 0), "it is not looked at so soon"
    assert not scheduled.step(scheduled.wake_at)
    assert (loop.begun, loop.steps, scheduled.spins) == (1, 1, True)
    node.is_active = False
    assert not scheduled.step(200.0)
    assert (scheduled.wait, scheduled.spins, scheduled.is_complete) == (Wait(0.0), False, False)
    node.is_active, loop.missing = True, {"/clock": ["a"]}
    scheduled.step(300.0)
    assert len(node.said) == 2, "time is counted anew"
    loop.missing = {}
    scheduled.step(400.0)
    assert (loop.begun, loop.steps) == (2, 2)


INPUT: Any = object()


@pytest.mark.parametrize(
    ("wait", "is_alone", "wake_after", "step_after"),
    [
        (Wait(2.0), True, 2.0, 2.0),
        (Wait(2.0, patience_s=0.5), True, 2.0, 2.0),
        (Wait(2.0, patience_s=0.5), False, 2.0, 2.5),
        (Wait(2.0, is_for_others=True), True, 2.0, 2.0),
        (Wait(2.0, is_for_others=True), False, 0.0, 0.0),
        (Wait(2.0, (INPUT,)), True, 2.0, POLL_S),
        (Wait(2.0, (INPUT,)), False, 2.0, POLL_S),
        (Wait(0.1 * POLL_S, (INPUT,)), True, 0.1 * POLL_S, 0.1 * POLL_S),
        (Wait(2.0, (INPUT,), is_brief=True), True, 2.0, 0.0),
    ],
)
def test_when_a_node_is_looked_at_again(
    wait: Wait, is_alone: bool, wake_after: float, step_after: float
) -> None:
    node = Node(wait)
    scheduled = scheduled_of(node, is_alone)
    assert not scheduled.step(100.0)
    assert scheduled.wait == wait
    assert scheduled.wake_at == pytest.approx(100.0 + wake_after, abs=1e-9)
    step_at = 0.0 if wait.is_brief and wait.inputs else 100.0 + step_after
    assert scheduled.step_at == pytest.approx(step_at, abs=1e-9)
    scheduled.step(step_at - 1e-6)
    assert node.loop.steps == 1
    scheduled.step(scheduled.step_at)
    assert node.loop.steps == 2


def test_one_that_expects_a_message_at_once_looks_for_it_without_sleep(clock: Clock) -> None:
    node = Node(Wait(5.0, (INPUT,), is_brief=True))
    scheduled = scheduled_of(node)
    scheduled.step(clock.monotonic())
    begin = clock.monotonic()
    assert not scheduled.spin(begin + 1e-4)
    assert begin + 1e-4 <= clock.now < begin + 1.1e-4
    assert scheduled.wake_at == pytest.approx(clock.now + 5.0)
    node.loop.waits = [*node.loop.waits * 3, None]
    assert scheduled.spin(begin + 1.0)
    assert clock.now < begin + 0.01
    under_fifo = scheduled_of(Node(Wait(5.0, is_brief=True), fifo=10))
    under_fifo.step(1.0)
    assert not under_fifo.spins, "yielding gives way to nobody there"
    assert under_fifo.node.said == ["fifo 10"]  # type: ignore[attr-defined]


def test_each_has_a_turn_a_round_until_one_has_come_to_its_end() -> None:
    """And others are stepped while one lets them work."""
    first, second, third = nodes = [Node(None) for _ in range(3)]
    scheduler = scheduler_of(*nodes)
    assert all(scheduler.take() for _ in range(5))
    scheduler._scheduled[0].node.let_others_work()
    assert [node.loop.steps for node in nodes] == [5, 6, 6]
    second.loop.is_complete = True
    assert not scheduler.take()
    assert [first.loop.steps, second.loop.steps, third.loop.steps] == [6, 7, 6]
    alone = Node(None)
    scheduler_of(alone)
    assert not hasattr(alone, "let_others_work")


def test_the_process_sleeps_until_the_first_node_is_to_be_stepped(
    clock: Clock, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Or until a message of any of them."""
    slow, fast, idle = Node(Wait(0.5)), Node(Wait(0.2)), Node(Wait(0.01))
    idle.is_active = False
    scheduler = scheduler_of(slow, fast, idle)
    assert all(scheduler.take() for _ in range(2))
    assert (slow.loop.steps, fast.loop.steps, idle.loop.steps) == (1, 2, 0)
    assert clock.slept == pytest.approx([0.2, 0.2], abs=1e-4)
    inputs: Any = [SimpleNamespace(handle=name) for name in ("one", "another")]
    mine, other = Node(Wait(0.5, (inputs[0],))), Node(Wait(0.3, (inputs[1],)))
    scheduler, waits = scheduler_of(mine, other), list[tuple[list[Any], float]]()

    def wait(handles: list[Any], timeout_s: float) -> None:
        waits.append((handles, timeout_s))

    monkeypatch.setattr(scheduler._waiter, "wait", wait)
    assert all(scheduler.take() for _ in range(2))
    assert [handles for handles, _ in waits] == [["one", "another"]] * 2
    assert waits[0][1] == pytest.approx(0.3, abs=1e-4)
    assert (mine.loop.steps, other.loop.steps) == (2, 2), "who waits is looked at after it"
    assert len(clock.slept) == 2


def test_a_patient_wait_lasts_longer_only_while_another_node_is_busy(clock: Clock) -> None:
    for other, seconds in ((Node(Wait(9.0)), 0.1), (Node(None), 0.4)):
        patient = Node(Wait(0.1, patience_s=0.3), None)
        scheduler, begin = scheduler_of(patient, other), clock.now
        while patient.loop.steps < 2:
            assert scheduler.take()
            clock.now += 1e-4
        assert clock.now - begin == pytest.approx(seconds, abs=1e-3)


def test_without_an_active_node_calls_are_waited_for_until_all_are_shut_down() -> None:
    first, second = nodes = Node(None), Node(None)
    first.is_active = second.is_active = False
    scheduler = scheduler_of(*nodes, upkeep_at=0.0)
    first.is_shut_down = True
    assert scheduler.take()
    assert [node.waited_s for node in nodes] == [0.5 * PERIOD_S] * 2
    second.is_shut_down = True
    assert not scheduler.take()


def test_upkeep_that_is_due_waits_for_a_moment_of_rest_but_not_for_long(clock: Clock) -> None:
    for node, patience in ((Node(Wait(1e-3)), 0.0), (Node(None), UPKEEP_PATIENCE_S)):
        scheduler, begin = scheduler_of(node, upkeep_at=clock.now), clock.now
        while not node.looks:
            assert scheduler.take()
            clock.now += 1e-4
        assert clock.now - begin == pytest.approx(patience, abs=5e-4)


def test_each_node_has_its_upkeep_one_after_the_other(clock: Clock) -> None:
    nodes = Node(Wait(1e-3)), Node(Wait(1e-3)), Node(Wait(1e-3))
    scheduler, begin, at = scheduler_of(*nodes, upkeep_at=0.0), clock.now, list[float]()
    while clock.now < begin + 1.0:
        before = sum(node.looks + node.reports for node in nodes)
        assert scheduler.take()
        after = sum(node.looks + node.reports for node in nodes)
        at += [clock.now] * (after > before)
        assert after - before <= 1
    assert [node.looks for node in nodes] == pytest.approx([1.0 / PERIOD_S] * 3, abs=2)
    assert [node.reports for node in nodes] == pytest.approx([1.0 / PERIOD_S] * 3, abs=2)
    assert min(b - a for a, b in itertools.pairwise(at)) >= UPKEEP_GAP_S - 1e-4


@pytest.mark.parametrize(("lasts", "pause"), [(0.002, 0.02), (0.3, LONGEST_PAUSE_S)])
def test_calls_one_behind_another_take_no_more_than_their_share(
    clock: Clock, lasts: float, pause: float
) -> None:
    """And a report never comes with a call: both in one turn would last too long."""
    assert pytest.approx(min(lasts / SERVICE_SHARE, LONGEST_PAUSE_S)) == pause
    node: Any = Node(None)
    at: list[float] = []

    def run_one(timeout_s: float) -> bool:
        at.append(clock.now)
        clock.now += lasts
        return True

    node.calls.run_one = run_one
    kept = Upkeep(node)
    for _ in range(4000):
        before = len(at) + node.reports
        kept.run()
        assert len(at) + node.reports - before <= 1
        clock.now += 1e-3
    gaps = [b - a for a, b in itertools.pairwise(at)]
    assert min(gaps) == pytest.approx(lasts + pause, abs=3e-3)
    assert node.reports == pytest.approx((clock.now - 1000.0) / PERIOD_S, rel=0.5)


def test_the_middleware_has_a_higher_priority_than_the_loop_or_it_is_told_that_it_is_refused() -> (
    None
):
    """In a process of its own, since its threads keep what they were given."""
    program = (
        "import os, threading;"
        "threading.Thread(target=threading.Event().wait, daemon=True).start();"
        "from space_robot_msgs_py.ros.node_scheduler import ask_for_fifo;"
        "print(ask_for_fifo(3));"
        "tasks = [int(task) for task in os.listdir('/proc/self/task')];"
        "print([os.sched_getparam(task).sched_priority for task in sorted(tasks)])"
    )
    ran = run_program([sys.executable, "-c", program])
    told, priorities = ran.stdout.splitlines()
    if told == "SCHED_FIFO 3":
        assert priorities.startswith("[3, 4"), priorities
    else:
        assert told.startswith("SCHED_FIFO 3 was not granted ("), told
        assert set(priorities) <= set("[0, ]")
