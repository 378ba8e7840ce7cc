"""recorder_node: writes every message of the graph into a bag."""

from __future__ import annotations

import itertools
import os
import time
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import NoReturn

from . import topics
from .bag.recorder import BagRecorder, RecorderNodeSettings
from .config.text import parse_json
from .errors import InputError, MessageError
from .ros.endpoints import PolledCallbackGroup, RawPublisher, RawSubscription
from .ros.loop import SENT, Health, Level, Wait
from .ros.managed_node import ManagedNode, NodeKind
from .ros.node_host import run_nodes
from .wire.definitions import decode

SILENCE_S = 0.3
"""A deactivated recorder stops when nothing that was sent before has come for this long, or when no
publisher is left."""
DRAIN_S = 8.0
"""Maximum time that a deactivated recorder takes messages."""
QUEUE_DEPTH = 20_000
TURN = 100
"""Maximum number of messages taken of a topic before the next one has its turn."""
REPORTS = 5
"""Maximum number of reports read in a round: each takes a tenth of a millisecond."""
CHECK_PERIOD_S = 0.02
"""Period of checks for publishers of topics that only some flights have."""
EARLY_TOPICS = (topics.REFERENCE_JOINTS, topics.REFERENCE_BASE)
"""Topics sent ahead of need: messages that came during a pause belong to the time after it, too."""
TIMEOUT_S = 0.002
"""Extra time that messages may wait while other nodes of the process are busy. After ten times as
long the middleware would have queued so many that it hands them out at half the speed."""
NEVER_NS = 1 << 63
NICENESS = 5
"""Niceness of the recorder's process: plant and controller go first where cores are short, and the
queues hold seconds of traffic."""


class RecorderLoop:
    """Empties the queues of all topics in turn; deep queues bridge the time between rounds."""

    wait_for = ()
    is_complete = False

    def __init__(
        self,
        node: ManagedNode[RecorderNodeSettings],
        settings: RecorderNodeSettings,
        gives_way: bool = False,
    ) -> None:
        """Open the bag and subscribe to the topics that every flight has.

        With ``gives_way`` it yields to other processes after each message.
        """
        self._node, self._settings, self._gives_way = node, settings, gives_way
        try:
            flight = parse_json(settings.flight)
        except ValueError as error:
            raise InputError(f"recorder parameters: flight: not JSON ({error})") from None
        path = Path(settings.bag or time.strftime("bag_%Y%m%d-%H%M%S"))
        if node.times_configured and settings.bag:  # reset: a bag is one flight from its start
            node.log(f"the bag of before the reset is now {set_aside(path)}")
        self._group, namespace = PolledCallbackGroup(), node.get_namespace()
        self._names = {topic: node.resolve_topic_name(topic.name) for topic in topics.RECORDED}
        self._inputs = [
            self._listen_to(topic) for topic in topics.RECORDED if not topic.is_optional
        ]
        self._unsent = [topic for topic in topics.RECORDED if topic.is_optional]
        """Optional topics without publisher so far."""
        self._check_at = 0.0
        """Time of the next check for their publishers, monotonic clock."""
        self._recorder = BagRecorder(
            path,
            {"period": settings.period, **flight},
            settings.timebase,
            settings.compression,
            settings.split_size,
            {topic.name: name for topic, name in self._names.items()},
            namespace,
        )
        self.outputs: tuple[RawPublisher, ...] = ()
        self._ours = {name: topic.full_name for topic, name in self._names.items()}
        """Names in the root namespace by names in the graph."""
        self._pause = Wait(settings.drain_period, patience_s=TIMEOUT_S)
        self._diagnostics = RawSubscription(node, topics.DIAGNOSTICS, self._group)
        self._description = RawSubscription(node, topics.PLANT_DESCRIPTION, self._group)
        self._is_failure_logged = False
        self._from_ns = 0
        """Time since which it records again, by the senders' clock; 0: it never paused."""
        self._until_ns: int | None = None
        """Time when this recorder was requested to stop; None while it records."""
        of_whom = "" if namespace == topics.ROOT else f" the topics in {namespace}"
        node.log(f"recording{of_whom} to {path}")

    @property
    def failure(self) -> str:
        """Reason why the bag is no longer written; empty if it is."""
        return self._recorder.failure

    def begin(self) -> None:
        """Record, again after a pause."""
        if self._until_ns is not None:  # active again
            self._from_ns, self._until_ns = time.time_ns(), None
            self._recorder.pause()

    def step(self) -> Wait | None:
        """End a chunk or take messages: both at once would last longer than a tick."""
        if self._recorder.flush_if_due():
            return self._pause
        if self._unsent:
            self._subscribe_to_optional()
        _, is_busy = self._take_round()
        return None if is_busy else self._pause

    def deactivate(self) -> None:
        """Take what was sent until now: the file of an inactive recorder does not grow."""
        if self._until_ns is not None:
            return
        self._until_ns = time.time_ns()
        begun = last_arrival = time.monotonic()
        while time.monotonic() < min(last_arrival + SILENCE_S, begun + DRAIN_S):
            is_timely, busy = self._take_round()
            self._recorder.flush_if_due()
            if is_timely or self._recorder.is_behind:
                last_arrival = time.monotonic()  # a round may last longer than the silence
            elif not (busy or any(map(self._node.count_publishers, self._names.values()))):
                break
            if not busy:
                time.sleep(self._settings.drain_period)
        self._recorder.flush()

    def health(self) -> Health:
        """Return the number of received messages, and whether they are written."""
        recorder = self._recorder
        tick = recorder.accounting[topics.JOINT_STATES.full_name].last
        values = {"tick": max(0, tick), "received": recorder.received}
        if self.failure:
            return Health(f"not recording: {self.failure}", Level.ERROR, values)
        return Health("nominal", values=values)

    def close(self) -> None:
        """Close the bag; a `FlightError` says why it could not be written to its end."""
        lost = {name: count for name, count in self._recorder.lost.items() if count}
        self._node.log(f"{self._recorder.received} messages received, missing: {lost or 0}")
        self._recorder.close()

    def _listen_to(self, topic: topics.Topic) -> RawSubscription:
        return RawSubscription(self._node, topic, self._group, QUEUE_DEPTH)

    def _subscribe_to_optional(self) -> None:
        # a plant that publishes them waits for this subscription
        if (now := time.monotonic()) < self._check_at:
            return
        self._check_at = now + CHECK_PERIOD_S
        for topic in [t for t in self._unsent if self._node.count_publishers(self._names[t])]:
            self._unsent.remove(topic)
            self._inputs.append(self._listen_to(topic))

    def _take_round(self) -> tuple[bool, bool]:
        is_timely = waiting = False  # in turns: a backlog of one topic must not delay the others
        for entry in self._inputs:
            taken, timely = self._take_some(entry)
            is_timely, waiting = is_timely or timely > 0, waiting or taken == TURN
        self._take_description()
        self._take_counts()
        if self.failure and not self._is_failure_logged:
            self._is_failure_logged = True
            self._node.log(f"the bag is no longer written: {self.failure}; the flight goes on")
        return is_timely, waiting

    def _take_some(self, entry: RawSubscription) -> tuple[int, int]:
        """Return the numbers of messages taken, and of those sent before the end."""
        timely = 0  # with those of a pause: behind them in the queue are some to be recorded
        begin_ns = 0 if entry.topic in EARLY_TOPICS else self._from_ns
        until_ns = self._end_ns
        for count in range(TURN):
            if (taken := entry.take_with_info()) is None:
                return count, timely
            if taken.sent_ns <= until_ns:
                timely += 1
                if taken.sent_ns >= begin_ns:
                    self._recorder.record(entry.topic, *taken)
            if self._gives_way and self._until_ns is None:  # no yielding after a stop request
                os.sched_yield()  # Linux may make a waking thread wait until we enter the kernel
        return TURN, timely

    def _take_description(self) -> None:
        if (taken := self._description.take_with_info()) is not None:
            with suppress(MessageError, ValueError):
                flown = parse_json(decode(taken.data, topics.PLANT_DESCRIPTION.type).data)
                self._recorder.describe(flown)

    def _take_counts(self) -> None:
        for _ in range(REPORTS):
            if (taken := self._diagnostics.take_with_info()) is None:
                return
            if not self._from_ns <= taken.sent_ns <= self._end_ns:
                continue
            with suppress(MessageError, ValueError):
                for status in decode(taken.data, topics.DIAGNOSTICS.type).status:
                    for item in status.values:
                        if item.key.startswith(SENT):
                            name = self._ours.get(item.key.removeprefix(SENT), "")
                            self._recorder.note_sent(name, int(item.value))

    @property
    def _end_ns(self) -> int:
        return NEVER_NS if self._until_ns is None else self._until_ns


def set_aside(bag: Path) -> Path:
    """Rename a closed bag to ``<bag>_before_reset_<number>``, the first free; return that."""
    names = (bag.with_name(f"{bag.name}_before_reset_{number}") for number in itertools.count(1))
    free = next(name for name in names if not name.exists())
    try:
        return bag.rename(free)
    except OSError as error:
        raise InputError(f"{bag}: cannot be renamed to {free.name} ({error.strerror})") from None


NODE = NodeKind(RecorderNodeSettings, RecorderLoop)


def main() -> NoReturn:
    """Entry point of recorder_node."""
    os.nice(max(0, NICENESS - os.nice(0)))
    run_nodes(NodeKind(RecorderNodeSettings, partial(RecorderLoop, gives_way=True)))


if __name__ == "__main__":
    main()
