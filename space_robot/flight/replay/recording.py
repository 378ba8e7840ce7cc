"""Recorded messages for a replay, streamed as bytes to save memory."""

from __future__ import annotations

import math
from collections import Counter, deque
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py import topics
from space_robot_msgs_py.bag.description import read_description
from space_robot_msgs_py.bag.folder import open_bag
from space_robot_msgs_py.bag.message_accounting import (
    message_tick,
    noted_accounts,
    topics_with_allowed_gaps,
)
from space_robot_msgs_py.bag.reader import first_states, missing, read_flight, timebase_of
from space_robot_msgs_py.bag.selection import REQUIRED, Selection
from space_robot_msgs_py.config.text import printable
from space_robot_msgs_py.errors import InputError, MessageError
from space_robot_msgs_py.samples import LawInForce, in_order
from space_robot_msgs_py.topics import Topic
from space_robot_msgs_py.wire.telemetry import LawCodec

from .comparison import CommandList, ReplayedCommands

COMPARED = (
    *topics.STATES,
    topics.REFERENCE_JOINTS,
    topics.REFERENCE_BASE,
    topics.COMMAND,
    topics.LAW,
)
"""Topics that a controller receives and sends."""


class StateMessages(NamedTuple):
    """The messages of a tick's state."""

    tick: int
    messages: tuple[bytes, ...]
    """One of each part that was asked for, in that order."""


class Recording:
    """Messages of a bag that its controller received and sent."""

    def __init__(
        self, path: Path, remap: Mapping[str, str] | None = None, namespace: str | None = None
    ) -> None:
        """Open a bag; ``remap`` and ``namespace``: see `read_flight`."""
        self.path = path
        with self._readable():
            self._bag = open_bag(path)
            self._selection = Selection(self._bag, remap or {}, namespace)
            flight = read_description(self._bag.custom_data())
            counts: Counter[Topic] = Counter()
            stamps_ns = [np.empty(0, np.int64)]
            for topic, batch in self._selection.batches():
                counts[topic] += len(batch)
                if topic is topics.JOINT_STATES:
                    stamps_ns.append(batch.stamps)
            for topic in REQUIRED:
                if not counts[topic]:
                    raise missing(topic, self._bag, self._selection)
            _, stamps = first_states(self._bag, self._selection)
            self.timebase, doubts = timebase_of(stamps, flight)
            if doubts:
                raise InputError(doubts[0])
        self.namespace = self._selection.namespace
        """Namespace of the robot."""
        self.flight: dict[str, Any] = flight
        """The flight as recorded; empty for a bag of another recorder."""
        self.parts = tuple(topic for topic in topics.STATES if counts[topic])
        """The parts of states that are there."""
        self.states_count = counts[topics.JOINT_STATES]
        """Approximate number of ticks."""
        self.has_commands = bool(counts[topics.COMMAND])
        account = noted_accounts(self._bag.custom_data()).get(topics.COMMAND.full_name)
        self.lost_commands = account.missing if account else 0
        """Answers that the recorder knows to have missed: what was answered then is not known."""
        self.is_finished = self._bag.finished
        excused = topics_with_allowed_gaps(flight)
        self.answers_are_complete = bool(flight) and topics.COMMAND.full_name not in excused
        """True if the controller has answered every state, so that no answer means a loss."""
        self.unfinished, self.damage = "", tuple[str, ...]()
        """As in `FlightLog`."""
        self._whole: NDArray[np.bool_] | None = None
        """(N,) whether state and reference of a tick can be read; None: whatever is there is
        sent."""
        recorded = self._selection.recorded() or {}
        is_short = any(recorded.get(topic.full_name, 0) > counts[topic] for topic in COMPARED)
        steps = np.diff(np.concatenate(stamps_ns), prepend=-self.timebase.period_ns)
        has_gaps = not excused and np.any(steps[0 if flight else 1 :] != self.timebase.period_ns)
        self.is_whole = not (is_short or has_gaps or self._bag.incomplete) and self.is_finished
        """True if the bag holds all that the controller was sent and answered, as far as anybody
        knows."""
        if self._bag.damage or not self.is_whole:
            log = read_flight(path, remap, namespace=namespace)
            self.unfinished, self.damage = log.unfinished, log.damage
            if "period" in flight and not excused:
                self._whole = log.as_measured().whole

    def commands(self, names: tuple[str, ...]) -> ReplayedCommands:
        """The recorded answers; ``names``: see `RobotNames.commanded`."""
        recorded = CommandList(names, self.timebase)
        for _, data in self._messages(topics.COMMAND) if self.has_commands else ():
            recorded.add(data)
        return recorded.commands()

    def laws(self) -> tuple[LawInForce, ...]:
        """The laws in force, with their gains, by rising tick; empty: not recorded."""
        in_force = []
        for _, tick, data in self._stamped_messages(topics.LAW):
            with suppress(MessageError):
                in_force.append(LawCodec.decode(data, tick))
        return in_order(in_force)

    def states(
        self, parts: Sequence[Topic], start: int = 0, stop: float = math.inf
    ) -> Iterator[StateMessages]:
        """States of the ticks from ``start`` to before ``stop``, as they were sent.

        One without any of the ``parts``, or with a wrong stamp, is passed over; of a damaged bag
        also one without its reference, for which the controller would have held an earlier one.
        """
        queues: dict[Topic, deque[tuple[int, bytes]]] = {topic: deque() for topic in parts}
        for topic, tick, data in self._stamped_messages(*parts):
            queues[topic].append((tick, data))
            while all(queues.values()):
                ticks = [queue[0][0] for queue in queues.values()]
                if min(ticks) != max(ticks):  # the earliest one has lost another part
                    min(queues.values(), key=lambda queue: queue[0][0]).popleft()
                    continue
                messages = tuple([queue.popleft()[1] for queue in queues.values()])
                if start <= ticks[0] < stop and self._is_whole(ticks[0]):
                    yield StateMessages(ticks[0], messages)

    @property
    def first_gap(self) -> float:
        """The first tick that the controller was sent in flight and cannot be sent now.

        Infinite if there is none, or if nobody knows.
        """
        whole = self._whole
        return math.inf if whole is None else int(np.argmin([*whole, False]))

    def _is_whole(self, tick: int) -> bool:
        whole = self._whole
        return whole is None or (tick < len(whole) and bool(whole[tick]))

    def references(self, topic: Topic, start: int = 0) -> Iterator[tuple[int, bytes]]:
        """First tick and data of half the reference, from the last message begun by ``start``."""
        begun: list[tuple[int, bytes]] = []
        for _, tick, data in self._stamped_messages(topic):
            if tick <= start:
                begun = [(tick, data)]
                continue
            yield from begun
            begun = []
            yield tick, data
        yield from begun

    def _stamped_messages(self, *wanted: Topic) -> Iterator[tuple[Topic, int, bytes]]:
        for topic, data in self._messages(*wanted):
            with suppress(MessageError):
                yield topic, message_tick(topic, data, self.timebase), data

    def _messages(self, *wanted: Topic) -> Iterator[tuple[Topic, bytes]]:
        with self._readable():
            for topic, batch in self._selection.batches():
                if topic in wanted:
                    yield from ((topic, batch.message(i)) for i in range(len(batch)))

    @contextmanager
    def _readable(self) -> Iterator[None]:
        try:
            yield
        except InputError as error:
            text = printable(str(error))
            raise InputError(text if str(self.path) in text else f"{self.path}: {text}") from None
        except OSError as error:
            why = error.strerror or error
            raise InputError(f"{self.path}: cannot be read ({why})") from None
