"""Scheduler of the nodes of a process: steps them in turn, and waits when all are idle."""

from __future__ import annotations

import gc
import os
import time
from collections.abc import Sequence
from functools import partial
from operator import attrgetter
from pathlib import Path
from typing import Any

from .loop import Loop, Wait
from .managed_node import ManagedNode
from .rclpy_internals import SubscriptionWaiter

SPIN_S = 300e-6
"""Time of polling and yielding before sleeping in the wait set. Not under SCHED_FIFO, where
yielding has no effect and sleeping threads wake without delay."""
LISTENER_PERIOD_S = 0.02
REMIND_S = 5.0
UPKEEP_GAP_S = 2e-3
"""Minimum time between the upkeep of two nodes, so that they do not delay a tick together."""
UPKEEP_PATIENCE_S = 0.02
"""Maximum time that due upkeep waits for an idle moment of all nodes."""
POLL_S = 1e-3
"""Period of polling for messages that are not expected soon, in a process with several nodes."""
NO_WAIT = Wait(0.0)
PERIOD_S = 0.1
"""Period of checks for service calls, which take time of the loop."""
SERVICE_SHARE = 0.1
"""Maximum share of a loop's time for queued service calls."""
LONGEST_PAUSE_S = 1.0


class Upkeep:
    """Executes a node's service calls and reports its health, each when due.

    In flight only one of the two at a time, since both together take longer than a tick allows.
    """

    def __init__(self, node: ManagedNode[Any]) -> None:
        self.node = node
        self._next_call = self._next_report = 0.0

    @property
    def due(self) -> float:
        """Time of the next call of `run`, monotonic clock."""
        return min(self._next_call, self._next_report)

    def run(self, timeout_s: float = 0.0) -> None:
        """Execute a service call or report the health, if due; only idle nodes wait for calls."""
        now = time.monotonic()
        serves_calls = timeout_s > 0.0 or self._next_call <= min(now, self._next_report)
        if serves_calls:
            has_run = self.node.calls.run_one(timeout_s)
            begin, now = now, time.monotonic()
            # after a call check again soon, within the allowed share of time; the answer to a
            # client that has ended takes the middleware 0.1 s
            pause = min((now - begin) / SERVICE_SHARE, LONGEST_PAUSE_S)
            self._next_call = now + (pause if has_run else PERIOD_S)
        if now >= self._next_report and (timeout_s or not serves_calls):
            self._next_report = now + PERIOD_S
            self.node.report()


class NodeScheduler:
    """Steps all nodes in turn, and lets the process sleep between two rounds if possible."""

    def __init__(self, nodes: Sequence[ManagedNode[Any]]) -> None:
        """Store the nodes in the order of their turns."""
        self._nodes = nodes
        self._scheduled = [ScheduledNode(node, is_alone=len(nodes) == 1) for node in nodes]
        self._upkeeps = [Upkeep(node) for node in nodes]
        self._upkeep_at = 0.0
        self._waiter = SubscriptionWaiter(nodes[0].context)
        self._is_alone = len(nodes) == 1
        for scheduled in self._scheduled if not self._is_alone else []:
            scheduled.node.let_others_work = partial(self._step_others, scheduled)

    def take(self) -> bool:
        """Step all nodes once; return False when the process is to end."""
        now = time.monotonic()
        if now >= self._upkeep_at:
            if not any(node.is_active for node in self._nodes):
                return self._serve_inactive()
            if now >= self._upkeep_at + UPKEEP_PATIENCE_S:
                self._serve_one()
        is_idle = True
        for scheduled in self._scheduled:
            if scheduled.step(now):
                is_idle = False
                if scheduled.is_complete:
                    return False
        return self._rest(now) if is_idle else True

    def _serve_inactive(self) -> bool:
        timeout_s = PERIOD_S / len(self._nodes)
        for upkeep in self._upkeeps:
            upkeep.run(timeout_s)
        return not all(node.is_shut_down for node in self._nodes)

    def _serve_one(self) -> None:
        min(self._upkeeps, key=attrgetter("due")).run()
        due = min(upkeep.due for upkeep in self._upkeeps)
        self._upkeep_at = max(due, time.monotonic() + UPKEEP_GAP_S)

    def _rest(self, now: float) -> bool:
        if now >= self._upkeep_at:
            self._serve_one()
            return True
        if self._is_alone and self._scheduled[0].spins and self._scheduled[0].spin(now + SPIN_S):
            return not self._scheduled[0].is_complete
        active = [scheduled for scheduled in self._scheduled if scheduled.node.is_active]
        until = min([scheduled.wake_at for scheduled in active], default=self._upkeep_at)
        if (left := until - time.monotonic()) <= 0.0:
            for scheduled in active:
                scheduled.step_at = min(scheduled.step_at, scheduled.wake_at)
            return True
        if handles := [entry.handle for node in active for entry in node.wait.inputs]:
            self._waiter.wait(handles, left)
            for scheduled in active:
                scheduled.step_at = 0.0
        else:
            time.sleep(left)
        return True

    def _step_others(self, scheduled: ScheduledNode) -> None:
        now = time.monotonic()
        for other in self._scheduled:
            if other is not scheduled:
                other.step(now)


class ScheduledNode:
    """A scheduled node with the state of its loop."""

    def __init__(self, node: ManagedNode[Any], is_alone: bool) -> None:
        """Store a node, in any lifecycle state."""
        self.node, self._is_alone = node, is_alone
        self.wait = NO_WAIT
        """Last wait requested by the loop."""
        self.wake_at = 0.0
        """Time at which the loop is stepped without message, monotonic clock."""
        self.step_at = 0.0
        """Earliest time of the next step."""
        self.spins = False
        """True to poll for the next message instead of sleeping."""
        self._may_spin = True
        self._loop: Loop | None = None
        """The loop while the node is active."""
        self._remind_at = 0.0

    @property
    def is_complete(self) -> bool:
        """True if its loop has ended."""
        return self._loop is not None and self._loop.is_complete

    def step(self, now: float) -> bool:
        """Step the loop if it is active and need not wait; return True if it did work."""
        if not self.node.is_active:
            self._loop, self.wait, self.step_at, self.spins = None, NO_WAIT, 0.0, False
            return False
        if now < self.step_at:
            return False
        if self._loop is None and not self._begin(now):
            return False
        assert self._loop is not None
        wait = self._loop.step()
        if wait is None:
            return True
        self._wait(wait, now)
        return False

    def spin(self, until: float) -> bool:
        """Step the loop repeatedly, yielding between; return True if it did work in time."""
        assert self._loop is not None
        step = self._loop.step
        while True:
            os.sched_yield()
            wait = step()
            if wait is None:
                return True
            if (now := time.monotonic()) >= until:
                self._wait(wait, now)
                return False

    def _wait(self, wait: Wait, now: float) -> None:
        self.wait = wait
        is_short = wait.is_for_others and not self._is_alone
        self.wake_at = now if is_short else now + wait.seconds
        self.step_at = self.wake_at if self._is_alone else self.wake_at + wait.patience_s
        self.spins = wait.is_brief and self._may_spin
        if wait.inputs:
            self.step_at = 0.0 if wait.is_brief else min(now + POLL_S, self.wake_at)

    def _begin(self, now: float) -> bool:
        """Start the loop of a newly active node once its subscribers exist; return True then."""
        node, loop = self.node, self.node.loop
        assert loop is not None
        self._remind_at = self._remind_at or now + REMIND_S
        missing = {out.full_name: out.missing_listeners(loop.wait_for) for out in loop.outputs}
        if any(missing.values()):
            if now > self._remind_at:
                self._remind_at = now + REMIND_S
                waiting = ", ".join(f"{', '.join(v)} on {k}" for k, v in missing.items() if v)
                node.log(f"waiting for {waiting}")
            self._wait(Wait(LISTENER_PERIOD_S), now)
            return False
        self._remind_at = 0.0
        gc.collect()
        gc.freeze()  # exclude permanent objects from garbage collection
        self._may_spin = not (node.settings and node.settings.fifo_priority)
        if node.settings and node.settings.fifo_priority:
            node.log(ask_for_fifo(node.settings.fifo_priority))
        self._loop = loop
        loop.begin()
        return True


def ask_for_fifo(priority: int) -> str:
    """Request SCHED_FIFO for all threads of this process; return a message on the result.

    The middleware's threads get a priority one above the loop's, since a loop that waits for a
    message must not block the thread that delivers it. Linux wakes such threads without delay.
    """
    loop = os.getpid()
    try:
        for entry in Path("/proc/self/task").iterdir():
            thread = int(entry.name)
            level = priority if thread == loop else priority + 1
            os.sched_setscheduler(thread, os.SCHED_FIFO, os.sched_param(level))
    except (OSError, AttributeError) as error:  # no permission; not Linux
        return f"SCHED_FIFO {priority} was not granted ({error}): default scheduling"
    return f"SCHED_FIFO {priority}"
