"""The messages of a bag into the rows of a `FlightLog`, batch by batch."""

from __future__ import annotations

import math
from collections import Counter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .. import topics
from ..errors import MessageError
from ..samples import LawInForce, RobotNames, Timebase, in_order
from ..wire.messages import TELEMETRY_ROWS, describe
from ..wire.telemetry import LawCodec
from .actuators import ACTUATOR_COLUMNS, MOST_ACTUATORS, described, names_in
from .batch import Batch
from .field_reader import Array, FieldReader, Places
from .flight_log import FlightLog, MeasuredStates
from .kernels import NO_STAMP, read_stamps
from .message_accounting import LONGEST_JUMP, MessageAccounting

_GROWTH = 1.25
_TICKS_A_MESSAGE = 20
"""A tick further away than so many ticks a message is not believed: it would cost memory."""
LAST_TICK = 2**53
"""A tick in a float64 is exact below."""
_NEVER = np.iinfo(np.int64).min


def stamps_of(batch: Batch) -> NDArray[np.int64]:
    """(M,) stamps, ns; `NO_STAMP` of messages without."""
    stamps = np.empty(len(batch), np.int64)
    read_stamps(batch.data, batch.starts, batch.lengths, stamps)
    return stamps


class Rows:
    """Takes batches in their order; the log grows with its ticks."""

    def __init__(self, names: RobotNames, timebase: Timebase, origin_ns: int) -> None:
        """Begin with no tick.

        Args:
            names: of the joints, in the order of the columns.
            timebase: of the stamps.
            origin_ns: stamp of tick 0.
        """
        self.log = FlightLog.allocate(0, names, timebase)
        self.log.commanded_torque = np.empty((0, len(names.axes)))
        self.accounting: dict[str, MessageAccounting] = {}
        self.counts: Counter[str] = Counter()
        """Messages a topic, of every kind."""
        self._origin_ns = origin_ns
        self._sent_ns = {
            topic: np.empty(0, np.int64) for topic in (topics.BASE_STATE, topics.COMMAND)
        }
        """The times when a state was whole and when its answer was sent, by tick."""
        self._wall_clock = False
        self._rows = self._believed = 0
        self._readers = {
            topic: FieldReader(describe(topic, names, timebase))
            for topic in topics.ALL  # /truth/orbit has the same numbers as /magnetometer
            if topic not in (topics.LAW, topics.MAGNETOMETER)
        }
        self._unnamed = set(MOST_ACTUATORS)
        """Topics whose actuators' names are still unknown."""
        self._apart: MeasuredStates | None = None
        """True states, once one has arrived; after `split_truth` the measured states."""
        self._errors: list[tuple[NDArray[np.int64], Array]] = []
        """Ticks and e of the telemetry."""
        self._laws: list[LawInForce] = []
        self._law_faults: list[str] = []

    def anomalies(self, excused: bool) -> list[str]:
        """Messages that could not be used; invalid stamps are no news if ``excused``."""
        anomalies = [
            f"{reader.misfits} messages on {topic.full_name} do not fit ({reader.fault})"
            for topic, reader in self._readers.items()
            if reader.misfits
        ]
        if faults := self._law_faults:
            anomalies.append(
                f"{len(faults)} messages on {topics.LAW.full_name} do not fit ({faults[0]})"
            )
        for name, counted in self.accounting.items():
            if counted.invalid_stamps and not excused:
                anomalies.append(
                    f"{counted.invalid_stamps} messages on {name} whose stamp is no whole tick "
                    "or out of all order"
                )
        return anomalies

    def take(self, topic: topics.Topic, batch: Batch) -> None:
        """Count the messages of a topic and put what they say into their ticks' rows."""
        counted = self.accounting.setdefault(topic.full_name, MessageAccounting(topic))
        self.counts[topic.full_name] += len(batch)
        ticks, known = self._ticks(topic, batch)
        places = np.flatnonzero(known)
        counted.invalid_stamps += len(batch) - len(places)
        fresh = places[counted.take_all(ticks[places])]
        if len(fresh) < len(batch):
            batch, ticks = batch.select(fresh), ticks[fresh]
        self._believed += _TICKS_A_MESSAGE * len(batch)
        if topic is topics.LAW:
            self._note_laws(batch, ticks)
            return
        self._grow(counted.last + 1)
        if topic in self._unnamed:
            self._learn_actuators(topic, batch)
        if topic is topics.TRUTH_ORBIT and not self.log.orbit_position.shape[1]:
            for name, _, width in self._readers[topic].columns:
                setattr(self.log, name, np.full((self._rows, width), np.nan))
        reader = self._readers.get(topic)
        if reader and reader.columns:
            if topic.per_tick:
                near = ticks < self._rows
                if not near.all():
                    batch, ticks = batch.select(near), ticks[near]
            for which, values in reader.read(batch):
                self._put(topic, ticks[which], values)
                self._note_sending(topic, batch, which, ticks[which])

    def _learn_actuators(self, topic: topics.Topic, batch: Batch) -> None:
        """Make room for the base's actuators that the first message names, if it has any."""
        log = self.log
        if (names := names_in(topic, batch, log.joint_names)) is None:
            return
        self._unnamed.remove(topic)
        if (description := described(topic, names, log.joint_names, log.timebase)) is None:
            return
        self._readers[topic] = FieldReader(description)
        if topic is topics.MOTORS_STATE:
            log.geared_names = names
        for name, _, width in description.columns:
            if name in ACTUATOR_COLUMNS:
                setattr(log, name, np.full((self._rows, width), np.nan))

    def split_truth(self) -> None:
        """Make the true states those of the log, if both their halves came; call it at the end."""
        if not all(self.counts[topic.full_name] for topic in topics.TRUTH):
            self._apart = None
        if self._apart is None:
            return
        measured = MeasuredStates.of(self.log)
        for name, column in self._apart.columns.items():
            setattr(self.log, name, column)
        self.log.measured = self._apart = measured

    def finish(self, ticks: int) -> FlightLog:
        """The log, cut to ``ticks`` rows."""
        log = self.log
        log.laws = in_order(law for law in self._laws if law.tick < ticks)
        for column in self._columns():
            column.resize((ticks, *column.shape[1:]), refcheck=False)
        if topics.COMMAND.full_name not in self.accounting:
            log.commanded_torque = None
        if log.measured is not None:
            log.assumed_error = np.full((ticks, log.axes), np.nan)
            for at, error in self._errors:
                there = (at >= 0) & (at < ticks)
                log.assumed_error[at[there]] = error[there]
        sent, answered = self._sent_ns[topics.BASE_STATE], self._sent_ns[topics.COMMAND]
        if self._wall_clock and topics.COMMAND.full_name in self.accounting:
            both = (answered != _NEVER) & (sent != _NEVER)
            log.latency_s = np.where(both, answered - sent, np.nan) * 1e-9
        return log

    def _ticks(
        self, topic: topics.Topic, batch: Batch
    ) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
        """(M,) ticks, and of which messages they are to be had."""
        if not topic.has_stamp:
            numbers, known = np.zeros(len(batch)), np.zeros(len(batch), np.bool_)
            for which, values in self._readers[topic].read(batch):
                numbers[which], known[which] = values[:, 0], np.abs(values[:, 0]) < LAST_TICK
                self._note_errors(values[known[which]])
            return np.where(known, numbers, 0.0).astype(np.int64), known
        stamps = stamps_of(batch)
        known = stamps != NO_STAMP
        ticks, rest = np.divmod(stamps - self._origin_ns, self.log.timebase.period_ns)
        known &= rest == 0
        if topic.per_tick or topic.is_event:
            known &= ticks >= 0
        return ticks, known

    def _put(self, topic: topics.Topic, ticks: NDArray[np.int64], values: Array) -> None:
        """Put messages' rows, of which the first belongs to the tick, where the columns say."""
        columns = self._readers[topic].columns
        rows: Array = values.reshape(len(ticks), -1, sum(column.length for column in columns))
        length = rows.shape[1]
        if not topic.per_tick:
            self._believed += length * len(ticks)
            self._grow(int(ticks.max()) + length)
        places, rows = _by_place(ticks, rows, self._rows)
        target: FlightLog | MeasuredStates = self.log
        if topic in topics.TRUTH:
            target = self._apart = self._apart or MeasuredStates.unknown(self.log)
        start = 0
        for name, first, length in columns:
            column = getattr(target, name)
            flat = column.reshape(len(column), math.prod(column.shape[1:]))
            flat[places, first : first + length] = rows[:, start : start + length]
            start += length

    def _note_sending(
        self, topic: topics.Topic, batch: Batch, which: Places, ticks: NDArray[np.int64]
    ) -> None:
        if topic not in self._sent_ns:
            return
        sent_ns = batch.publish_ns[which]
        self._sent_ns[topic][ticks] = sent_ns
        self._wall_clock = self._wall_clock or bool(np.any(sent_ns != batch.log_ns[which]))

    def _note_errors(self, values: Array) -> None:
        """``values``: (M, ...) the tick, then s, u, N_hat and e of each message, if it is ours."""
        axes = self.log.axes
        if values.shape[1] == 1 + len(TELEMETRY_ROWS) * axes:
            first = 1 + TELEMETRY_ROWS.index("e") * axes
            error = values[:, first : first + axes].copy()
            self._errors.append((values[:, 0].astype(np.int64), error))

    def _note_laws(self, batch: Batch, ticks: NDArray[np.int64]) -> None:
        for i, tick in enumerate(ticks.tolist()):
            try:
                self._laws.append(LawCodec.decode(batch.message(i), tick))
            except MessageError as error:
                self._law_faults.append(str(error))

    def _columns(self) -> list[NDArray[Any]]:
        return [
            *self.log.columns.values(),
            *(self._apart.columns.values() if self._apart is not None else ()),
            *self._sent_ns.values(),
        ]

    def _grow(self, ticks: int) -> None:
        """Make room, within what can be believed; memory that is not touched costs nothing."""
        before = self._rows
        ticks = min(ticks, LONGEST_JUMP + self._believed)
        if ticks <= before:
            return
        self._rows = max(ticks, int(_GROWTH * before))
        for column in self._columns():
            column.resize((self._rows, *column.shape[1:]), refcheck=False)
            column[before:] = _NEVER if column.dtype == np.int64 else np.nan


def _by_place(
    ticks: NDArray[np.int64], rows: Array, stop: int
) -> tuple[slice | NDArray[np.int64], Array]:
    """Find where (M, k, width) rows of messages go in a log of ``stop`` rows, and those that do.

    Of several for one place the last one stays.
    """
    length = rows.shape[1]
    places: NDArray[np.int64] = (ticks[:, None] + np.arange(length)).reshape(-1)
    rows = rows.reshape(len(places), -1)
    inside = (places >= 0) & (places < stop)
    if not inside.all():
        places, rows = places[inside], rows[inside]
    if len(places) and np.all(np.diff(places) == 1):
        return slice(int(places[0]), int(places[-1]) + 1), rows
    return places, rows
