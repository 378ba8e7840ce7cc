"""The recorder: every message of a flight into a bag, with the proof that none is missing."""

from __future__ import annotations

import json
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from .. import topics
from ..errors import FlightError, MessageError
from ..samples import Timebase
from .coverage import Coverage, excused_topics, lost_messages, message_tick
from .mcap_file import Compression
from .writer import BagWriter

FLIGHT_KEY = "space_robot.flight"
COVERAGE_KEY = "space_robot.coverage"
CHUNK_BYTES = 1 << 20
CHUNK_AGE_S = 0.25
"""A killed recorder loses the open chunk, so none stays open for longer."""


class BagRecorder:
    """Takes serialized messages in any order between topics. Knows no ROS.

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
    ) -> None:
        """Open the bag; ``flight`` says what was flown and is stored with it.

        A file of the bag that has ``split_size`` bytes is followed by another (0: never).

        Raises:
            InputError: the bag exists already, or cannot be written.
        """
        self._excused = excused_topics(flight)
        self._writer = BagWriter(
            path, topics.ALL, {FLIGHT_KEY: json.dumps(dict(flight))}, compression, split_size
        )
        self._chunk_bytes = min(CHUNK_BYTES, split_size or CHUNK_BYTES)
        self._timebase = timebase
        self.coverages = {topic.name: Coverage(topic) for topic in topics.ALL}
        self.failure = ""
        """Why nothing is written any more (empty: all is well)."""
        self.kept_tick = -1
        """The last tick whose state is in the file for good; -1: none."""
        self._kept = 0
        self._flush_at = time.monotonic() + CHUNK_AGE_S
        self._closed = False

    def record(self, topic: topics.Topic, data: bytes, sent_ns: int = 0) -> None:
        """Add one serialized message, sent at ``sent_ns`` by the sender's clock (0: not known).

        One whose stamp cannot be right is kept at the time of the last good one.
        """
        coverage = self.coverages[topic.name]
        try:
            tick = message_tick(topic, data, self._timebase)
            is_new = coverage.take(tick)
        except MessageError:
            tick, is_new = coverage.last, True
            coverage.strange += 1
        if not is_new or self.failure:
            return
        log_ns = self._timebase.stamp_ns(max(0, min(tick, coverage.last)))
        if self._writer.write(topic, log_ns, sent_ns or log_ns, tick, data) > self._chunk_bytes:
            self.flush()

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
                    self.coverages[topic.name].last
                    for topic in (topics.JOINT_STATES, topics.BASE_STATE)
                )
        self._flush_at = time.monotonic() + CHUNK_AGE_S

    def flush_if_due(self) -> None:
        """`flush` if the open chunk may be older than `CHUNK_AGE_S`; call it often."""
        if time.monotonic() >= self._flush_at:
            self.flush()

    @property
    def received(self) -> int:
        """Messages recorded, repeated ones left out."""
        return sum(coverage.kept for coverage in self.coverages.values())

    @property
    def unkept(self) -> int:
        """Messages that came but are not in the bag, because it could not be written."""
        return self.received - self._kept if self.failure else 0

    @property
    def lost(self) -> dict[str, int]:
        """Messages a topic that never came, so far."""
        return lost_messages(self.coverages, self._excused)

    def close(self) -> None:
        """Make the bag whole, with the flight's description and the counts in its metadata.

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
            name: {
                "expected": c.received + lost,
                "received": c.received,
                "missing": lost,
                "repeated": c.repeated,
                "strange": c.strange,
            }
            for (name, c), lost in zip(self.coverages.items(), self.lost.values(), strict=True)
        }
        self._writer.close({COVERAGE_KEY: json.dumps(counts)})

    def _fail(self, error: OSError) -> None:
        self.failure = error.strerror or str(error)
        if isinstance(error, FileNotFoundError):  # what was kept went with the file
            self._kept, self.kept_tick = 0, -1
        self._writer.abandon()
