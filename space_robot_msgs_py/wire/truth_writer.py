"""True states as messages, many ticks in one: as rare as the reference's, they cost as little."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from .. import topics
from ..samples import RobotNames, RobotState, State, Timebase
from .codec import Codec
from .message import MessageDescription
from .truth_base import TruthBase
from .truth_joints import TruthJoints

CHUNK_TICKS = 20
"""Ticks in a message: so many at most are lost with a plant that is killed."""

Messages = Iterable[tuple[topics.Topic, bytes]]


class TruthWriter:
    """Collects the true state of every tick; gives /truth/joints and /truth/base now and then."""

    def __init__(self, names: RobotNames, timebase: Timebase) -> None:
        descriptions: tuple[MessageDescription, ...] = (
            TruthJoints.of_robot(names, timebase),
            TruthBase.of_robot(names, timebase),
        )
        self._codecs = [(describe, Codec(describe)) for describe in descriptions]
        self._timebase = timebase
        self._rows = np.empty(CHUNK_TICKS, State.dtype(len(names.joints)))
        self._numbers = self._rows.view(np.float64).reshape(CHUNK_TICKS, -1)
        self._start = self._count = 0

    def add(self, truth: RobotState) -> Messages:
        """Take the state of a tick, one after the other; return messages that are complete."""
        if not self._count:
            self._start = truth.tick
        self._numbers[self._count] = truth.numbers
        self._count += 1
        return self.flush() if self._count == CHUNK_TICKS else ()

    def flush(self) -> Messages:
        """Return the messages of what has been taken and not given out."""
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
