"""Messages of true states, many ticks in one, to reduce their cost."""

from __future__ import annotations

from collections.abc import Collection, Iterable

import numpy as np

from .. import topics
from ..samples import RobotNames, RobotState, State, Timebase
from .codec import Codec
from .message import MessageDescription
from .truth_base import TruthBase
from .truth_joints import TruthJoints
from .truth_orbit import TruthOrbit

CHUNK_TICKS = 20
"""Ticks per message, hence the maximum number of ticks lost with a killed plant."""

Messages = Iterable[tuple[topics.Topic, bytes]]


PARTS: tuple[type[MessageDescription], ...] = (TruthJoints, TruthBase, TruthOrbit)


class TruthWriter:
    """Collects the true state of every tick for the topics of the truth."""

    def __init__(
        self, names: RobotNames, timebase: Timebase, wanted: Collection[topics.Topic]
    ) -> None:
        """``wanted``: topics whose messages are to be written."""
        descriptions = [part.of_robot(names, timebase) for part in PARTS if part.topic in wanted]
        self._codecs = [(describe, Codec(describe)) for describe in descriptions]
        self._timebase = timebase
        self._rows = np.empty(CHUNK_TICKS, State.dtype(len(names.joints)))
        self._numbers = self._rows.view(np.float64).reshape(CHUNK_TICKS, -1)
        self._start = self._count = 0

    def add(self, truth: RobotState) -> Messages:
        """Add the state of the next tick; return complete messages."""
        if not self._count:
            self._start = truth.tick
        self._numbers[self._count] = truth.numbers
        self._count += 1
        return self.flush() if self._count == CHUNK_TICKS else ()

    def flush(self) -> Messages:
        """Return messages of the remaining states."""
        rows, self._count = self._rows[: self._count], 0
        if not len(rows):
            return ()
        stamp_ns = self._timebase.stamp_ns(self._start)
        messages = []
        for describe, codec in self._codecs:
            columns = [rows[c.name][:, c.first : c.first + c.length] for c in describe.columns]
            values = np.concatenate(columns, axis=1).reshape(-1)
            messages.append((describe.topic, codec.encode(stamp_ns, values)))
        return messages
