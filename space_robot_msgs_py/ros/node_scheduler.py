"""The nodes of a process in turn: served, stepped, and waited for when none has anything to do."""

from __future__ import annotations

import gc
import os
import time
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any

from .loop import Loop, Wait
from .managed_node import ManagedNode
from .upkeep import PERIOD_S, Upkeep
from .waiting import SPIN_S, Waiter

LISTENER_PERIOD_S = 0.02
REMIND_S = 5.0
UPKEEP_GAP_S = 2e-3
"""Between one node's upkeep and another's, so that all of them together delay no tick."""
UPKEEP_PATIENCE_S = 0.02
"""Upkeep that is due waits so long for a moment in which no node has anything to do."""
GLANCE_S = 1e-3
"""A node among several looks so often whether a message has come that is not expected at once."""
NO_WAIT = Wait(0.0)


class NodeScheduler:
    """Gives each node its turn, and lets the process sleep between two rounds if it can."""

    def __init__(self, nodes: Sequence[ManagedNode[Any]]) -> None:
        """Take the nodes in the order of their turns."""
        self._nodes = nodes
        self._seats = [ScheduledNode(node, is_alone=len(nodes) == 1) for node in nodes]
        self._upkeeps = [Upkeep(node) for node in nodes]
        self._due = [0.0] * len(nodes)
        """When each node's upkeep is due, by the monotonic clock."""
        self._upkeep_at = 0.0
        self._waiter = Waiter(nodes[0])
        self._is_alone = len(nodes) == 1
        for seat in self._seats if not self._is_alone else []:
            seat.node.let_others_work = partial(self._step_others, seat)

    def take(self) -> bool:
        """Give all nodes a turn each; False when the process has come to its end."""
        now = time.monotonic()
        if now >= self._upkeep_at:
            if not any(node.is_active for node in self._nodes):
                return self._serve_inactive()
            if now >= self._upkeep_at + UPKEEP_PATIENCE_S:
                self._serve_one()
        is_idle = True
        for seat in self._seats:
            if seat.step(now):
                is_idle = False
                if seat.is_complete:
                    return False
        return self._rest(now) if is_idle else True

    def _serve_inactive(self) -> bool:
        """Wait for service calls, as there is nothing else to do; False when all are shut down."""
        timeout_s = PERIOD_S / len(self._nodes)
        for upkeep in self._upkeeps:
            upkeep.run(timeout_s)
        return not all(node.is_shut_down for node in self._nodes)

    def _serve_one(self) -> None:
        """Run the upkeep that is due first."""
        first = self._due.index(min(self._due))
        self._due[first] = self._upkeeps[first].run()
        self._upkeep_at = max(min(self._due), time.monotonic() + UPKEEP_GAP_S)

    def _rest(self, now: float) -> bool:
        """Do what can wait for others, or wait until a node has something to do.

        Returns:
            False when the process has come to its end.
        """
        if now >= self._upkeep_at:
            self._serve_one()
            return True
        if self._is_alone and self._seats[0].spins and self._seats[0].spin(now + SPIN_S):
            return not self._seats[0].is_complete
        seats = [seat for seat in self._seats if seat.node.is_active]
        until = min([seat.wake_at for seat in seats], default=self._upkeep_at)
        if (left := until - time.monotonic()) <= 0.0:
            for seat in seats:
                seat.glance_at = min(seat.glance_at, seat.wake_at)
            return True
        if inputs := [entry for seat in seats for entry in seat.wait.inputs]:
            self._waiter.wait(inputs, left)
            for seat in seats:
                seat.glance_at = 0.0
        else:
            time.sleep(left)
        return True

    def _step_others(self, seat: ScheduledNode) -> None:
        now = time.monotonic()
        for other in self._seats:
            if other is not seat:
                other.step(now)


class ScheduledNode:
    """A node among those that take turns, and how far its loop is."""

    def __init__(self, node: ManagedNode[Any], is_alone: bool) -> None:
        """Take a node in any state."""
        self.node, self._is_alone = node, is_alone
        self.wait = NO_WAIT
        """The wait that its loop asked for last."""
        self.wake_at = 0.0
        """When it is to be stepped though no message has come, by the monotonic clock."""
        self.glance_at = 0.0
        """When it may be stepped at the earliest."""
        self.spins = False
        """True if it is better to look for its next message than to sleep."""
        self._may_spin = True
        self._loop: Loop | None = None
        """The loop while it is stepped."""
        self._remind_at = 0.0

    @property
    def is_complete(self) -> bool:
        """True if its loop has come to its end."""
        return self._loop is not None and self._loop.is_complete

    def step(self, now: float) -> bool:
        """Step the node's loop, if it is active and need not wait; whether it did something."""
        if not self.node.is_active:
            self._loop, self.wait, self.glance_at, self.spins = None, NO_WAIT, 0.0, False
            return False
        if now < self.glance_at:
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
        """Step the loop again and again, giving way between; whether it did something in time."""
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
        self.glance_at = self.wake_at if self._is_alone else self.wake_at + wait.patience_s
        self.spins = wait.is_brief and self._may_spin
        if wait.inputs:
            self.glance_at = 0.0 if wait.is_brief else min(now + GLANCE_S, self.wake_at)

    def _begin(self, now: float) -> bool:
        """Begin the loop of a node that has become active, once its listeners are there."""
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
        gc.freeze()  # what lives until the end need not be looked through in the loop
        self._may_spin = not (node.settings and node.settings.fifo_priority)
        if node.settings and node.settings.fifo_priority:
            node.log(ask_for_fifo(node.settings.fifo_priority))
        self._loop = loop
        loop.begin()
        return True


def ask_for_fifo(priority: int) -> str:
    """Put all threads of this process under SCHED_FIFO; return a message on the result.

    The middleware's threads go one above the loop: a loop that waits for a message must not keep
    the thread away that brings it. Linux wakes such threads at once, others when it suits.
    """
    loop = os.getpid()
    try:
        for entry in Path("/proc/self/task").iterdir():
            thread = int(entry.name)
            level = priority if thread == loop else priority + 1
            os.sched_setscheduler(thread, os.SCHED_FIFO, os.sched_param(level))
    except (OSError, AttributeError) as error:  # no permission; not Linux
        return f"SCHED_FIFO {priority} was not granted ({error}): the usual scheduling"
    return f"SCHED_FIFO {priority}"
