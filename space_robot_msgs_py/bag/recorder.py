"""The recorder: every message of a flight into a bag, with the proof that none is missing."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from .. import topics
from ..samples import Timebase
from .coverage import Coverage, lost_messages, message_tick
from .writer import BagWriter

FLIGHT_KEY = "space_robot.flight"
COVERAGE_KEY = "space_robot.coverage"


class BagRecorder:
    """Takes serialized messages in any order between topics. Knows no ROS.

    The log time of a message is its simulated stamp. A message that came before (a plant that
    asked again, a mission that started anew) is counted and left out.
    """

    def __init__(self, path: Path, flight: Mapping[str, Any], timebase: Timebase) -> None:
        """Open the bag; ``flight`` says what was flown and is stored with it.

        Raises:
            InputError: the bag exists already, or cannot be written.
        """
        self._writer = BagWriter(path, topics.ALL)
        self._flight = dict(flight)
        self._timebase = timebase
        self.coverages = {topic.name: Coverage(topic) for topic in topics.ALL}

    def record(self, topic: topics.Topic, data: bytes) -> None:
        """Add one serialized message."""
        tick = message_tick(topic, data, self._timebase)
        if self.coverages[topic.name].take(tick):
            self._writer.write(topic, self._timebase.stamp_ns(tick), data, tick)

    @property
    def lost(self) -> dict[str, int]:
        """Missing messages a topic, so far."""
        return lost_messages(self.coverages, bool(self._flight.get("realtime")))

    def close(self) -> None:
        """Make the bag whole, with the flight's description and the counts in its metadata."""
        counts = {
            name: {"received": c.received, "missing": lost, "repeated": c.repeated}
            for (name, c), lost in zip(self.coverages.items(), self.lost.values(), strict=True)
        }
        self._writer.close({FLIGHT_KEY: json.dumps(self._flight), COVERAGE_KEY: json.dumps(counts)})
