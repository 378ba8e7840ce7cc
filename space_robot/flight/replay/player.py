"""Player of recorded messages, in place of plant and mission."""

from __future__ import annotations

import time
from array import array
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from types import TracebackType
from typing import NamedTuple

import numpy as np

from space_robot_msgs_py import topics
from space_robot_msgs_py.errors import FlightError

from ..graph.temporary_node import TemporaryNode
from .commands import CommandList, Ticks
from .recording import ReferenceMessage, StateMessages

CONTROLLER = "controller_node"
REFERENCES = (topics.REFERENCE_JOINTS, topics.REFERENCE_BASE)
AHEAD = 10
"""Messages of each half of the reference that are sent ahead of need: as a rule half a second."""
POLL_S = 0.02
ASK_AGAIN_S = 0.5
"""Without an answer for this long the state is sent again, as the plant does."""
GIVE_UP_S = 10.0
"""Without an answer for this long a tick counts as unanswered."""
MOST_UNANSWERED = 3
"""Unanswered ticks in a row after which the controller counts as silent."""
LISTENER_TIMEOUT_S = 30.0
LAST_ANSWER_S = 1.0


class _Stream(NamedTuple):
    """One topic's messages of the reference."""

    messages: Iterator[ReferenceMessage]
    needed: deque[ReferenceMessage]
    """Those sent that are needed from now on: the last one that has begun, and what is ahead."""


class Player:
    """Node ``replay_node`` that publishes recorded messages and keeps the answers."""

    def __init__(self, domain: int, answers: CommandList, parts: Sequence[topics.Topic]) -> None:
        """Join the graph; `node` is for calling services.

        Args:
            domain: to join.
            answers: to add the controller's to.
            parts: of a state, in the order in which they are sent.
        """
        from space_robot_msgs_py.ros.endpoints import (
            PolledCallbackGroup,
            RawPublisher,
            RawSubscription,
        )
        from space_robot_msgs_py.ros.rclpy_internals import SubscriptionWaiter

        self._visitor = TemporaryNode("replay_node", domain)
        self.node = self._visitor.node
        self._outs = {t.name: RawPublisher(self.node, t) for t in (*parts, *REFERENCES)}
        self._parts_out = [self._outs[topic.name] for topic in parts]
        self._commands = RawSubscription(self.node, topics.COMMAND, PolledCallbackGroup())
        self._waiter = SubscriptionWaiter(self.node.context)
        self._answers = answers
        self._references: list[_Stream] = []
        self._played = array("q")
        self.check: Callable[[], None] = lambda: None
        """Called while waiting; raises to give up."""

    def __enter__(self) -> Player:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self._visitor.leave()

    @property
    def played(self) -> Ticks:
        """(N,) ticks whose states were sent."""
        return np.array(self._played, dtype=np.int64)

    def wait_for_controller(self) -> None:
        """Return when the controller listens to all topics.

        Raises:
            FlightError: it does not come.
        """
        until = time.monotonic() + LISTENER_TIMEOUT_S
        while any(out.missing_listeners([CONTROLLER]) for out in self._outs.values()):
            self.check()
            if time.monotonic() > until:
                raise FlightError(f"{CONTROLLER} does not listen for {LISTENER_TIMEOUT_S:.0f} s")
            time.sleep(POLL_S)

    def resend_pending(self) -> None:
        """Send the current reference again, as a mission does for new subscribers."""
        self.wait_for_controller()
        for stream in self._references:
            for reference in stream.needed:
                self._outs[reference.topic.name].publish(reference.data)

    def lockstep(
        self,
        states: Iterable[StateMessages],
        references: Iterable[Iterator[ReferenceMessage]],
        before: Callable[[int], None],
        show: Callable[[int], None],
    ) -> None:
        """Send the states, each after the answer to the previous one.

        Args:
            states: in their order; those that were not answered in flight left out.
            references: those of each topic in their order.
            before: called with each tick before its state is sent.
            show: called with each tick whose state was sent.

        Raises:
            FlightError: the controller has fallen silent, or `check` says so.
        """
        self._references = [_Stream(messages, deque()) for messages in references]
        unanswered = 0
        coming = iter(states)
        state = next(coming, None)
        while state is not None:
            self._send_references(state.tick)
            before(state.tick)
            self._send(state)
            following = next(coming, None)  # read while the controller computes
            unanswered = 0 if self._is_answered(state) else unanswered + 1
            if unanswered == MOST_UNANSWERED:
                raise FlightError(
                    f"the controller has not answered the {MOST_UNANSWERED} states up to "
                    f"tick {state.tick}"
                )
            show(state.tick)
            state = following

    def by_the_clock(
        self,
        states: Iterable[StateMessages],
        references: Iterable[Iterator[ReferenceMessage]],
        before: Callable[[int], None],
        show: Callable[[int], None],
        period_s: float,
    ) -> None:
        """Send a tick's state every ``period_s`` of the wall clock, answered or not.

        Time begins when the first one is answered, and stands still in ``before``. Arguments and
        errors: see `lockstep`.
        """
        self._references = [_Stream(messages, deque()) for messages in references]
        began, first = 0.0, -1
        for state in states:
            self._send_references(state.tick)
            paused = time.perf_counter()
            before(state.tick)
            began += time.perf_counter() - paused
            if first < 0:
                self._send(state)
                self._is_answered(state)
                began, first = time.perf_counter(), state.tick
                continue
            self._take_until(began + (state.tick - first) * period_s)
            self._send(state)
            show(state.tick)
        self._take_until(time.perf_counter() + LAST_ANSWER_S)

    def _send(self, state: StateMessages) -> None:
        self._publish(state)
        self._played.append(state.tick)

    def _publish(self, state: StateMessages) -> None:
        for output, message in zip(self._parts_out, state.messages, strict=True):
            output.publish(message)

    def _send_references(self, tick: int) -> None:
        """Keep both streams ahead of ``tick``."""
        for messages, needed in self._references:
            while len(needed) > 1 and needed[1].tick <= tick:
                needed.popleft()
            while len(needed) <= AHEAD and (reference := next(messages, None)):
                self._outs[reference.topic.name].publish(reference.data)
                if needed and max(needed[-1].tick, reference.tick) <= tick:
                    needed.pop()
                needed.append(reference)

    def _is_answered(self, state: StateMessages) -> bool:
        """Wait for the answer to the state just sent; return whether it arrived."""
        begin = time.monotonic()
        ask_again = begin + ASK_AGAIN_S
        while True:
            data = self._commands.take()
            if data is None:
                self._waiter.wait((self._commands.handle,), POLL_S)
                data = self._commands.take()
            if data is not None:
                if self._answers.add(data) == state.tick:
                    return True
                continue
            self.check()
            now = time.monotonic()
            if now > begin + GIVE_UP_S:
                return False
            if now > ask_again:
                ask_again = now + ASK_AGAIN_S
                self._publish(state)

    def _take_until(self, moment: float) -> None:
        while True:
            while (data := self._commands.take()) is not None:
                self._answers.add(data)
            left = moment - time.perf_counter()
            if left <= 0.0:
                return
            self._waiter.wait((self._commands.handle,), min(left, POLL_S))
            self.check()
