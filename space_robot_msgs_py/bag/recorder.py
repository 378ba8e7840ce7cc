"""Recorder of every message of a flight into a bag, with counts of lost messages."""

from __future__ import annotations

import json
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, ClassVar

from pydantic import ByteSize, Field, field_validator

from .. import topics
from ..config.settings import NodeSettings
from ..errors import FlightError, MessageError
from ..samples import Timebase
from ..wire.viewers import unwrap
from .message_accounting import (
    ACCOUNTS_KEY,
    MessageAccounting,
    SequenceCount,
    lost_messages,
    message_tick,
    topics_with_allowed_gaps,
)
from .writer import BagWriter, Compression

FLIGHT_KEY = "space_robot.flight"
TOPICS_KEY = "space_robot.topics"
"""Of our topics by the ones that they were recorded as, where these are others."""
ROBOT_KEY = "robot_file"
"""Key of the robot's numbers in the description."""
CHUNK_BYTES = 1 << 16
"""Size of a chunk: written in 0.2 ms, within the free time of a tick."""
MOST_CHUNKS = 4
"""Factor by which a chunk may grow when messages pile up."""
CHUNK_AGE_S = 0.25
"""Longest time a chunk stays open, s; a killed recorder loses its open chunk."""


LEAST_SPLIT_SIZE = 65_536
"""Every file has 20 kB of definitions and indexes, whatever its messages."""
LARGEST_SPLIT_SIZE = 2**62
"""A ROS parameter holds no more."""


class RecorderNodeSettings(NodeSettings):
    """Parameters of recorder_node."""

    node: ClassVar[str] = "recorder"

    bag: str = Field(
        "", description="folder of the bag to write; it must not exist (empty: bag_<time>)"
    )
    flight: str = Field(
        "{}", description="description of the flight, a JSON object; stored in the bag"
    )
    compression: Compression = Field("lz4", description="compression of the bag: none, lz4 or zstd")
    split_size: ByteSize = Field(
        ByteSize(0),
        description="size in bytes at which a new file of the bag starts, as 500K, 100M, 2G "
        "(powers of 1000) or 512KiB (0: one file)",
    )
    drain_period: Annotated[float, Field(ge=0.0005, le=0.1)] = Field(
        0.02, description="period of reading the queues, s"
    )

    @field_validator("split_size")
    @classmethod
    def _worth_a_file(cls, size: ByteSize) -> ByteSize:
        if size and not LEAST_SPLIT_SIZE <= size <= LARGEST_SPLIT_SIZE:
            raise ValueError(
                f"0 (one file) or {LEAST_SPLIT_SIZE} to {LARGEST_SPLIT_SIZE} bytes are allowed"
            )
        return size


class BagRecorder:
    """Recorder of serialized messages, in any order between topics. Independent of ROS.

    The log time of a message is its simulated stamp; its publish time is when it was sent, if
    that is known. A message that came before (a plant that asked again, a mission that started
    anew) is counted and left out.

    A bag that can no longer be written (disk full, folder gone) stops nobody: `failure` says why,
    later messages are counted and let go, and `close` raises.
    """

    def __init__(
        self,
        path: Path,
        flight: Mapping[str, Any],
        timebase: Timebase,
        compression: Compression = "lz4",
        split_size: int = 0,
        names: Mapping[str, str] | None = None,
        namespace: str = topics.ROOT,
    ) -> None:
        """Open the bag; ``flight`` says what was flown and is stored with it.

        A file of the bag that has ``split_size`` bytes is followed by another (0: never).
        ``names``: full name of each topic, by its own; None: that in the ``namespace``.
        """
        self._flight, self._excused = dict(flight), topics_with_allowed_gaps(flight)
        own = {topic.name: topic.in_namespace(namespace) for topic in topics.RECORDED}
        names = own | dict(names or {})
        self._written = {
            t.name: t.carries or t._replace(name=names[t.name]) for t in topics.RECORDED
        }
        """Topics by their names in the bag."""
        remapped = {
            names[topic.name]: topic.full_name
            for topic in topics.ALL
            if names[topic.name] != own[topic.name]
        }
        description = {FLIGHT_KEY: json.dumps(self._flight)}
        if remapped:
            description[TOPICS_KEY] = json.dumps(remapped)
        self._writer = BagWriter(path, self._written.values(), description, compression, split_size)
        self._chunk_bytes = min(CHUNK_BYTES, split_size or CHUNK_BYTES)
        self._most_bytes = min(MOST_CHUNKS * CHUNK_BYTES, split_size or MOST_CHUNKS * CHUNK_BYTES)
        self._timebase = timebase
        self.accounting = {topic.full_name: MessageAccounting(topic) for topic in topics.RECORDED}
        self._sequences = {topic.full_name: SequenceCount() for topic in topics.RECORDED}
        self.failure = ""
        """Reason why writing has stopped; empty without failure."""
        self.kept_tick = -1
        """The last tick whose state is in the file for good; -1: none."""
        self._kept = 0
        self._flush_at = time.monotonic() + CHUNK_AGE_S
        self._closed = False

    def record(self, topic: topics.Topic, data: bytes, sent_ns: int = 0, sequence: int = 0) -> None:
        """Add one serialized message.

        ``sent_ns``: when, by the sender's clock; ``sequence``: the publisher's number of it, from 1
        on; 0: not known.
        """
        name = topic.full_name
        self._sequences[name].take(sequence)
        counted = self.accounting[name]
        data = unwrap(data) if topic.carries else data
        try:
            tick = message_tick(topic.carries or topic, data, self._timebase)
            is_new = counted.take(tick)
        except MessageError:
            tick, is_new = counted.last, True
            counted.invalid_stamps += 1
        if not is_new or self.failure:
            return
        # one whose stamp cannot be right is kept at the time of the last good one
        log_ns = self._timebase.stamp_ns(max(0, min(tick, counted.last)))
        try:
            self._writer.write(self._written[topic.name], log_ns, sent_ns or log_ns, tick, data)
        except OSError as error:
            self._fail(error)
        else:
            if self._writer.open_bytes > self._most_bytes:  # no time to flush so far
                self.flush()

    def describe(self, flown: Any) -> None:
        """Add the plant's description, a mapping, unless the flight's has the robot already."""
        if not isinstance(flown, dict) or ROBOT_KEY in self._flight:
            return
        self._flight = flown | self._flight
        self._excused = topics_with_allowed_gaps(self._flight)
        if not self.failure:
            try:
                self._writer.describe({FLIGHT_KEY: json.dumps(self._flight)})
            except OSError as error:
                self._fail(error)

    def note_sent(self, topic_name: str, count: int) -> None:
        """Take the number of messages that a node reports to have sent on a recorded topic."""
        if sequences := self._sequences.get(topic_name):
            sequences.note_sent(count)

    @property
    def is_behind(self) -> bool:
        """True if a node has sent more messages than have arrived."""
        return any(sequences.awaited for sequences in self._sequences.values())

    def pause(self) -> None:
        """Exclude on purpose all messages until the next recorded one."""
        for name, sequences in self._sequences.items():
            sequences.pause()
            self.accounting[name].pause()

    def flush(self) -> None:
        """End the open chunk: what was recorded is with the kernel and survives this process."""
        if not self.failure and not self._closed:
            try:
                self._writer.flush()
            except OSError as error:
                self._fail(error)
            else:
                self._kept = self.received
                self.kept_tick = min(
                    self.accounting[topic.full_name].last
                    for topic in (topics.JOINT_STATES, topics.BASE_STATE)
                )
        self._flush_at = time.monotonic() + CHUNK_AGE_S

    def flush_if_due(self) -> bool:
        """`flush` if the open chunk is full, or may be older than `CHUNK_AGE_S`; whether it was so.

        To be called often.
        """
        is_full = self._writer.open_bytes > self._chunk_bytes and not self.failure
        is_due = is_full or time.monotonic() >= self._flush_at
        if is_due:
            self.flush()
        return is_due

    @property
    def received(self) -> int:
        """Messages recorded, repeated ones left out."""
        return sum(counted.kept for counted in self.accounting.values())

    @property
    def unkept(self) -> int:
        """Messages that came but are not in the bag, because it could not be written."""
        return self.received - self._kept if self.failure else 0

    @property
    def lost(self) -> dict[str, int]:
        """Messages a topic that were sent and never came, so far.

        By their publishers' own counts; by the ticks, if no publisher counts. What was sent again
        and has come then is not lost.
        """
        if not any(sequences.is_counted for sequences in self._sequences.values()):
            return lost_messages(self.accounting, self._excused)
        return {name: self._lost(name) for name in self._sequences}

    def _lost(self, name: str) -> int:
        sequences, counted = self._sequences[name], self.accounting[name]
        holes = sequences.holes
        return sequences.tail + (holes if counted.topic.is_event else min(holes, counted.gaps))

    def close(self) -> None:
        """Close the bag, with the flight's description and the counts in its metadata.

        A second call does nothing.

        Raises:
            FlightError: the bag could not be written to its end.
        """
        if self._closed:
            return
        self.flush()
        self._closed = True
        if not self.failure:
            try:
                self._finish()
            except OSError as error:
                self._fail(error)
        if self.failure:
            kept = f"tick {self.kept_tick} (t = {self.kept_tick * self._timebase.period:.4f} s)"
            raise FlightError(
                f"{self._writer.path}: could not be written to the end ({self.failure}): "
                f"last tick kept: {kept if self.kept_tick >= 0 else 'none'}, "
                f"messages not kept: {self.unkept}"
            )

    def _finish(self) -> None:
        counts = {
            c.topic.recorded.full_name: {
                "expected": c.received + lost,
                "received": c.received,
                "missing": lost,
                "repeated": c.repeated,
                "invalid_stamps": c.invalid_stamps,
                "while_inactive": self._sequences[name].passed_over,
            }
            for (name, c), lost in zip(self.accounting.items(), self.lost.values(), strict=True)
        }
        self._writer.close({ACCOUNTS_KEY: json.dumps(counts)})

    def _fail(self, error: OSError) -> None:
        self.failure = error.strerror or str(error)
        if isinstance(error, FileNotFoundError):  # what was kept went with the file
            self._kept, self.kept_tick = 0, -1
        self._writer.abandon()
