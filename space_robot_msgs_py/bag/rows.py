"""The messages of a bag into the rows of a `FlightLog`, batch by batch."""

from __future__ import annotations

import math
import tempfile
from collections import Counter
from collections.abc import Iterator
from types import SimpleNamespace
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from .. import topics
from ..errors import MessageError
from ..samples import (
    PASSIVE_FIELDS,
    STATE_FIELDS,
    CommandSignals,
    LawInForce,
    RobotNames,
    StateSignals,
    Timebase,
    in_order,
)
from ..signals import Each, carried_by
from ..wire.definitions import decode
from ..wire.messages import TELEMETRY_ROWS, describe
from ..wire.telemetry import LawCodec
from .batch import NO_STAMP, Array, Batch, FieldReader, Integers, Places
from .flight_log import MEASURED_APART, FlightLog, MeasuredStates
from .message_accounting import LONGEST_JUMP, MessageAccounting

_GROWTH = 1.25
_TICKS_A_MESSAGE = 20
"""A tick further away than so many ticks a message is not believed: it would cost memory."""
FILES_FROM = 2**29
"""Bytes from which on the columns lie in files, which have no names and go with them."""
LAST_TICK = 2**53
"""A tick in a float64 is exact below."""
_NEVER = np.iinfo(np.int64).min
NOT_READ = (topics.LAW,)
"""Topics without columns."""
NAMING = (topics.WHEELS_STATE, topics.THRUSTERS_STATE, topics.MOTORS_STATE, topics.COMMAND)
"""Topics whose messages tell which actuators and gears the robot has."""


class Rows:
    """Takes batches in their order; the log grows with its ticks."""

    def __init__(self, names: RobotNames, timebase: Timebase, origin_ns: int) -> None:
        """Begin with no tick; ``origin_ns`` is the stamp of tick 0."""
        self.log = FlightLog.allocate(0, names, timebase)
        self.log.commanded_torque = np.empty((0, len(names.axes)))
        self.accounting: dict[str, MessageAccounting] = {}
        self.counts: Counter[str] = Counter()
        """Messages a topic, of every kind."""
        self._names, self._origin_ns = names, origin_ns
        self._sent_ns = {
            topic: np.empty(0, np.int64) for topic in (topics.BASE_STATE, topics.COMMAND)
        }
        """The times when a state was whole and when its answer was sent, by tick."""
        self._is_wall_clock = False
        self._rows = self._believed = 0
        self._readers = {
            topic: FieldReader(describe(topic, names, timebase))
            for topic in topics.ALL
            if topic not in NOT_READ
        }
        self._unnamed = set(NAMING)
        self._true: MeasuredStates | None = None
        """True states, once one has arrived; after `split_truth` the measured states."""
        self._apart = SimpleNamespace(**{name: np.empty((0, 0)) for name in MEASURED_APART})
        """What sensors with a topic of their own measured; the true columns are in the log."""
        self._errors: list[tuple[Integers, Array]] = []
        """Ticks and e of telemetry that is not yet in its rows."""
        self._files: dict[tuple[int, str], IO[bytes]] = {}  # by the column's table and name
        self._laws: list[LawInForce] = []
        self._law_faults: list[str] = []

    def anomalies(self, excused: bool) -> list[str]:
        """Describe messages that could not be used; invalid stamps are no news if ``excused``."""
        misfits = [(topic, r.misfits, r.fault) for topic, r in self._readers.items() if r.misfits]
        if faults := self._law_faults:
            misfits.append((topics.LAW, len(faults), faults[0]))
        invalid = {name: c.invalid_stamps for name, c in self.accounting.items()}
        return [
            f"{count} messages on {topic.full_name} do not fit ({fault})"
            for topic, count, fault in misfits
        ] + [
            f"{count} messages on {name} whose stamp is no whole tick or out of all order"
            for name, count in invalid.items()
            if count and not excused
        ]

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
        for at, error in self._errors:
            if self.log.assumed_error is None:
                self.log.assumed_error = np.full((self._rows, self.log.axes), np.nan)
            inside = (at >= 0) & (at < self._rows)
            self.log.assumed_error[at[inside]] = error[inside]
        self._errors.clear()
        if topic in self._unnamed:
            self._learn_names(topic, batch)
        reader = self._readers.get(topic)
        if not reader or not reader.description.columns:
            return
        target = self._apart if topic in MEASURED_APART.values() else self.log
        for name, first, length in reader.description.columns:
            column = getattr(target, name)
            # the first message of wheels, gears or an orbit shows that the robot has them
            if column.ndim == 2 and column.shape[1] < first + length:
                setattr(target, name, np.full((self._rows, first + length), np.nan))
        if topic.per_tick:
            near = ticks < self._rows
            if not near.all():
                batch, ticks = batch.select(near), ticks[near]
        for which, values in reader.read(batch):
            self._put(topic, ticks[which], values)
            if topic in self._sent_ns:
                sent_ns = batch.publish_ns[which]
                self._sent_ns[topic][ticks[which]] = sent_ns
                self._is_wall_clock |= bool(np.any(sent_ns != batch.log_ns[which]))

    def _learn_names(self, topic: topics.Topic, batch: Batch) -> None:
        log, axes = self.log, self._names.axes
        for i in range(len(batch)):
            try:
                names = tuple(decode(batch.message(i), topic.type).name)
            except MessageError:
                continue
            if topic is not topics.COMMAND:
                break
            if set(axes) <= set(names):
                names = tuple(name for name in names if name not in axes)
                break
        else:
            return
        self._unnamed.remove(topic)
        *_, (_, declared, _) = carried_by(topic, StateSignals, CommandSignals)
        assert isinstance(declared.size, Each)
        if not 0 < len(names) <= declared.size.room(len(self._names.joints)):
            return
        if topic is topics.MOTORS_STATE:
            if not set(names) <= set(log.joint_names):
                return
            log.geared_names = names
        # A command names all actuators: who tells them apart does not matter to their columns.
        named: dict[str, Any] = {"wheels" if topic is topics.COMMAND else topic.of: names}
        robot = self._names._replace(**named)
        self._readers[topic] = FieldReader(describe(topic, robot, log.timebase))

    def split_truth(self) -> None:
        """Make the true states those of the log, if both their halves came; call it at the end."""
        if not all(self.counts[topic.full_name] for topic in topics.TRUTH):
            self._true = None
        if self._true is None:
            return
        measured = MeasuredStates.of(self.log)
        for name, column in vars(self._apart).items():
            setattr(measured, name, column)
        for name in STATE_FIELDS + PASSIVE_FIELDS:
            setattr(self.log, name, getattr(self._true, name))
        self.log.measured = self._true = measured

    def finish(self, ticks: int) -> FlightLog:
        """Return the log, cut to ``ticks`` rows."""
        log = self.log
        log.laws = in_order(law for law in self._laws if law.tick < ticks)
        for table, name, column in self._columns():
            if isinstance(column, np.memmap):
                table[name] = column[:ticks]
            else:
                column.resize((ticks, *column.shape[1:]), refcheck=False)
        if topics.COMMAND.full_name not in self.accounting:
            log.commanded_torque = None
        if log.measured is None:
            log.assumed_error = None
        elif log.assumed_error is None:
            log.assumed_error = np.full((ticks, log.axes), np.nan)
        sent, answered = self._sent_ns[topics.BASE_STATE], self._sent_ns[topics.COMMAND]
        if self._is_wall_clock and topics.COMMAND.full_name in self.accounting:
            both = (answered != _NEVER) & (sent != _NEVER)
            log.latency_s = np.where(both, answered - sent, np.nan) * 1e-9
        return log

    def _ticks(self, topic: topics.Topic, batch: Batch) -> tuple[Integers, NDArray[np.bool_]]:
        if not topic.has_stamp:
            numbers, known = np.zeros(len(batch)), np.zeros(len(batch), np.bool_)
            for which, values in self._readers[topic].read(batch):
                numbers[which], known[which] = values[:, 0], np.abs(values[:, 0]) < LAST_TICK
                self._note_errors(values[known[which]])
            return np.where(known, numbers, 0.0).astype(np.int64), known
        stamps = batch.stamps
        ticks, rest = np.divmod(stamps - self._origin_ns, self.log.timebase.period_ns)
        known = (stamps != NO_STAMP) & (rest == 0)
        if topic.per_tick or topic.is_event:
            known &= ticks >= 0
        return ticks, known

    def _put(self, topic: topics.Topic, ticks: Integers, values: Array) -> None:
        description = self._readers[topic].description
        rows: Array = values.reshape(len(ticks), -1, description.width)
        length = rows.shape[1]
        if not topic.per_tick:
            self._believed += length * len(ticks)
            self._grow(int(ticks.max()) + length)
        places, rows = _by_place(ticks, rows, self._rows)
        target: Any = self._apart if topic in MEASURED_APART.values() else self.log
        if topic in topics.TRUTH:
            target = self._true = self._true or MeasuredStates.unknown(self.log)
        start = 0
        for name, first, length in description.columns:
            column = getattr(target, name)
            flat = column.reshape(len(column), math.prod(column.shape[1:]))
            flat[places, first : first + length] = rows[:, start : start + length]
            start += length

    def _note_errors(self, values: Array) -> None:
        axes = self.log.axes
        if values.shape[1] == 1 + len(TELEMETRY_ROWS) * axes:
            first = 1 + TELEMETRY_ROWS.index("e") * axes
            error = values[:, first : first + axes].copy()
            self._errors.append((values[:, 0].astype(np.int64), error))

    def _note_laws(self, batch: Batch, ticks: Integers) -> None:
        for i, tick in enumerate(ticks.tolist()):
            try:
                self._laws.append(LawCodec.decode(batch.message(i), tick))
            except MessageError as error:
                self._law_faults.append(str(error))

    def _columns(self) -> Iterator[tuple[dict[Any, Any], Any, NDArray[Any]]]:
        true = {} if self._true is None else vars(self._true)
        tables: list[dict[Any, Any]] = [vars(self.log), true, vars(self._apart), self._sent_ns]
        for table in tables:
            columns = [item for item in table.items() if isinstance(item[1], np.ndarray)]
            yield from ((table, name, column) for name, column in columns)

    def _grow(self, ticks: int) -> None:
        # memory that is not touched costs nothing, but a wrong stamp must not cost gigabytes
        before = self._rows
        ticks = min(ticks, LONGEST_JUMP + self._believed)
        if ticks <= before:
            return
        self._rows = max(ticks, int(_GROWTH * before))
        row_bytes = sum(8 * math.prod(column.shape[1:]) for _, _, column in self._columns())
        for table, name, column in self._columns():
            shape, key = (self._rows, *column.shape[1:]), (id(table), str(name))
            if self._rows * row_bytes < FILES_FROM or not math.prod(shape):
                column.resize(shape, refcheck=False)
                continue
            if not isinstance(column, np.memmap):
                self._files[key] = tempfile.TemporaryFile()  # noqa: SIM115 - it lasts as the log
                column.tofile(self._files[key])
            self._files[key].truncate(8 * math.prod(shape))
            table[name] = np.memmap(self._files[key], column.dtype, "r+", shape=shape)
        for _, _, column in self._columns():
            column[before:] = _NEVER if column.dtype == np.int64 else np.nan


def _by_place(ticks: Integers, rows: Array, stop: int) -> tuple[slice | Places, Array]:
    """Find where (M, k, width) rows of messages go in a log of ``stop`` rows; the last stays."""
    length = rows.shape[1]
    places: Places = (ticks[:, None] + np.arange(length)).reshape(-1)
    rows = rows.reshape(len(places), -1)
    inside = (places >= 0) & (places < stop)
    if not inside.all():
        places, rows = places[inside], rows[inside]
    if len(places) and np.all(np.diff(places) == 1):
        return slice(int(places[0]), int(places[-1]) + 1), rows
    return places, rows
