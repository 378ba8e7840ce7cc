"""A bag as a replay reads it: messages as bytes, streamed, so that long flights need no memory."""

from __future__ import annotations

import json
import math
import struct
from collections import deque
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

from rosbags.rosbag2 import ReaderError

from space_robot_msgs_py import topics
from space_robot_msgs_py.bag.coverage import excused_topics, message_tick
from space_robot_msgs_py.bag.folder import open_bag
from space_robot_msgs_py.bag.reader import REQUIRED
from space_robot_msgs_py.bag.recorder import FLIGHT_KEY
from space_robot_msgs_py.errors import InputError, MessageError
from space_robot_msgs_py.samples import Timebase
from space_robot_msgs_py.topics import Topic

from .commands import CommandList, Commands

UNREADABLE = (ReaderError, OSError, ValueError, LookupError, RuntimeError, struct.error)


class State(NamedTuple):
    """The two messages of a tick's state."""

    tick: int
    joints: bytes
    base: bytes


class Reference(NamedTuple):
    """A message of the reference."""

    tick: int
    """Of its first point."""
    topic: Topic
    data: bytes


class Recording:
    """The messages of a bag that a controller has seen, and its answers. Knows no ROS."""

    def __init__(self, path: Path, remap: Mapping[str, str] | None = None) -> None:
        """Open the bag in ``path``; ``remap``: our topic by the bag's.

        Raises:
            InputError: no bag is there, it cannot be read, or has no states or references.
        """
        self.path = path
        self._names = {ours: theirs for theirs, ours in (remap or {}).items()}
        with self._readable():
            self._bag = open_bag(path)
            counts = self._bag.counts()
            flight = json.loads(self._bag.custom_data().get(FLIGHT_KEY, "{}"))
        for topic in REQUIRED:
            if not counts.get(name := self._name(topic)):
                there = ", ".join(sorted(n for n, count in counts.items() if count)) or "nothing"
                raise InputError(f"{path}: no messages on {name}; there is {there}")
        self.flight: dict[str, Any] = flight
        """What was flown, as recorded; empty for a bag of another recorder."""
        self.timebase = Timebase(round(float(flight.get("period", 0.0005)) * 1e9))
        self.states_count = counts[self._name(topics.JOINT_STATES)]
        """Ticks, about."""
        self.has_commands = bool(counts.get(self._name(topics.COMMAND)))
        self.is_finished = self._bag.finished
        self.answers_are_complete = bool(flight) and topics.COMMAND.name not in excused_topics(
            flight
        )
        """Whether the controller has answered every state, so that no answer means a loss."""

    def commands(self, axis_names: tuple[str, ...]) -> Commands:
        """The recorded answers."""
        found = CommandList(axis_names, self.timebase)
        for _, data in self._messages(topics.COMMAND) if self.has_commands else ():
            found.add(data)
        return found.commands()

    def states(self, start: int = 0, stop: float = math.inf) -> Iterator[State]:
        """States of the ticks from ``start`` to before ``stop``, as they were sent.

        One of which half is missing, or whose stamp is none, is passed over.
        """
        joints: deque[tuple[int, bytes]] = deque()
        base: deque[tuple[int, bytes]] = deque()
        for topic, data in self._messages(topics.JOINT_STATES, topics.BASE_STATE):
            try:
                tick = message_tick(topic, data, self.timebase)
            except MessageError:
                continue
            (joints if topic is topics.JOINT_STATES else base).append((tick, data))
            while joints and base:
                if joints[0][0] != base[0][0]:  # the earlier one has lost its other half
                    min(joints, base, key=lambda queue: queue[0][0]).popleft()
                    continue
                (tick, one), (_, other) = joints.popleft(), base.popleft()
                if start <= tick < stop:
                    yield State(tick, one, other)

    def references(self, topic: Topic, start: int = 0) -> Iterator[Reference]:
        """Messages of half the reference, from the last one that begins by tick ``start``."""
        begun: Reference | None = None
        for _, data in self._messages(topic):
            try:
                reference = Reference(message_tick(topic, data, self.timebase), topic, data)
            except MessageError:
                continue
            if reference.tick <= start:
                begun = reference
                continue
            if begun:
                yield begun
                begun = None
            yield reference
        if begun:
            yield begun

    def _name(self, topic: Topic) -> str:
        """Of a topic in this bag."""
        return self._names.get(topic.name, topic.name)

    def _messages(self, *wanted: Topic) -> Iterator[tuple[Topic, bytes]]:
        by_name = {self._name(topic): topic for topic in wanted}
        named = [topic._replace(name=name) for name, topic in by_name.items()]
        with self._readable():
            for name, data in self._bag.messages(*named):
                yield by_name[name], data

    @contextmanager
    def _readable(self) -> Iterator[None]:
        try:
            yield
        except InputError:
            raise
        except UNREADABLE as error:
            raise InputError(f"{self.path}: cannot be read as a flight ({error})") from None
