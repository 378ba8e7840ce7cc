"""The messages of a bag into the rows of a `FlightLog`, batch by batch."""

from __future__ import annotations

from collections import Counter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .. import topics
from ..errors import MessageError
from ..samples import STATE_FIELDS, LawInForce, Timebase, in_order
from ..wire.plain_codecs import LawCodec
from .batch import Batch
from .flight_log import REFERENCE, FlightLog
from .kernels import NO_STAMP, read_stamps
from .layouts import (
    Describe,
    FieldReader,
    base_state,
    base_trajectory,
    first_number,
    joint_states,
    joint_trajectory,
)
from .message_accounting import LONGEST_JUMP, MessageAccounting

Array = NDArray[np.float64]

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

    def __init__(self, joint_names: tuple[str, ...], timebase: Timebase, origin_ns: int) -> None:
        """Begin with no tick.

        Args:
            joint_names: in the order of the columns.
            timebase: of the stamps.
            origin_ns: stamp of tick 0.
        """
        n = len(joint_names)
        self.log = FlightLog.allocate(0, joint_names, timebase)
        self.log.commanded_torque = np.empty((0, n + 3))
        self.coverages: dict[str, MessageAccounting] = {}
        self.counts: Counter[str] = Counter()
        """Messages a topic, of every kind."""
        self._origin_ns = origin_ns
        self._sent_ns = {name: np.empty(0, np.int64) for name in ("state", "command")}
        self._wall_clock = False
        self._rows = self._believed = 0
        arrays = ("position", "velocity", "effort")
        axes = (*topics.BASE_AXES, *joint_names)
        describe: dict[topics.Topic, Describe] = {
            topics.JOINT_STATES: joint_states(topics.JOINT_STATES, joint_names, arrays),
            topics.BASE_STATE: base_state,
            topics.COMMAND: joint_states(topics.COMMAND, axes, ("effort",)),
            topics.REFERENCE_JOINTS: joint_trajectory(joint_names, timebase),
            topics.REFERENCE_BASE: base_trajectory(timebase),
            topics.TELEMETRY: first_number,
        }
        self._numbers = {topic: FieldReader(topic.type, d) for topic, d in describe.items()}
        self._laws: list[LawInForce] = []
        self._law_faults: list[str] = []

    def oddities(self, excused: bool) -> list[str]:
        """Messages that could not be used; strange stamps are no news if ``excused``."""
        found = [
            f"{numbers.misfits} messages on {topic.name} do not fit ({numbers.fault})"
            for topic, numbers in self._numbers.items()
            if numbers.misfits
        ]
        if faults := self._law_faults:
            found.append(f"{len(faults)} messages on {topics.LAW.name} do not fit ({faults[0]})")
        for name, coverage in self.coverages.items():
            if coverage.strange and not excused:
                found.append(
                    f"{coverage.strange} messages on {name} whose stamp is no whole tick "
                    "or out of all order"
                )
        return found

    def take(self, topic: topics.Topic, batch: Batch) -> None:
        """Count the messages of a topic and put what they say into their ticks' rows."""
        coverage = self.coverages.setdefault(topic.name, MessageAccounting(topic))
        self.counts[topic.name] += len(batch)
        ticks, known = self._ticks(topic, batch)
        places = np.flatnonzero(known)
        coverage.strange += len(batch) - len(places)
        fresh = places[coverage.take_all(ticks[places])]
        if len(fresh) < len(batch):
            batch, ticks = batch.select(fresh), ticks[fresh]
        self._believed += _TICKS_A_MESSAGE * len(batch)
        if topic is topics.LAW:
            self._note_laws(batch, ticks)
            return
        self._grow(coverage.last + 1)
        if topic in (topics.REFERENCE_JOINTS, topics.REFERENCE_BASE):
            for which, values in self._numbers[topic].read(batch):
                self._put_references(topic, ticks[which], values)
        elif topic in (topics.JOINT_STATES, topics.BASE_STATE, topics.COMMAND):
            near = ticks < self._rows
            if not near.all():
                batch, ticks = batch.select(near), ticks[near]
            for which, values in self._numbers[topic].read(batch):
                self._put(topic, ticks[which], values)
                self._note_sending(topic, batch, which, ticks[which])

    def finish(self, ticks: int) -> FlightLog:
        """The log, cut to ``ticks`` rows."""
        log = self.log
        log.laws = in_order(law for law in self._laws if law.tick < ticks)
        for column in self._columns():
            column.resize((ticks, *column.shape[1:]), refcheck=False)
        if topics.COMMAND.name not in self.coverages:
            log.commanded_torque = None
        sent, answered = self._sent_ns["state"], self._sent_ns["command"]
        if self._wall_clock and topics.COMMAND.name in self.coverages:
            both = (answered != _NEVER) & (sent != _NEVER)
            log.latency_s = np.where(both, answered - sent, np.nan) * 1e-9
        return log

    def _ticks(
        self, topic: topics.Topic, batch: Batch
    ) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
        """(M,) ticks, and of which messages they are to be had."""
        if topic is topics.TELEMETRY:
            numbers, known = np.zeros(len(batch)), np.zeros(len(batch), np.bool_)
            for which, values in self._numbers[topic].read(batch):
                numbers[which], known[which] = values[:, 0], np.abs(values[:, 0]) < LAST_TICK
            return np.where(known, numbers, 0.0).astype(np.int64), known
        stamps = stamps_of(batch)
        known = stamps != NO_STAMP
        ticks, rest = np.divmod(stamps - self._origin_ns, self.log.timebase.period_ns)
        known &= rest == 0
        if topic.per_tick or topic.is_event:
            known &= ticks >= 0
        return ticks, known

    def _put_references(self, topic: topics.Topic, ticks: NDArray[np.int64], values: Array) -> None:
        log, joints = self.log, topic is topics.REFERENCE_JOINTS
        column = log.reference_joints if joints else log.reference_base
        points = values.reshape(len(values), -1, *column.shape[1:])
        length = points.shape[1]
        self._believed += length * len(points)
        self._grow(int(ticks.max()) + length)
        for first, rows in zip(ticks.tolist(), points, strict=True):
            start, stop = max(first, 0), min(first + length, self._rows)
            if start < stop:
                column[start:stop] = rows[start - first : stop - first]

    def _put(self, topic: topics.Topic, ticks: NDArray[np.int64], values: Array) -> None:
        log, n = self.log, len(self.log.joint_names)
        if topic is topics.JOINT_STATES:
            log.joint_positions[ticks] = values[:, :n]
            log.joint_velocities[ticks] = values[:, n : 2 * n]
            log.applied_torque[ticks, 3:] = values[:, 2 * n :]
        elif topic is topics.BASE_STATE:
            log.base_position[ticks] = values[:, :3]
            log.quaternion[ticks] = values[:, 3:7]
            log.base_velocity[ticks] = values[:, 7:10]
            log.omega_base[ticks] = values[:, 10:13]
            log.applied_torque[ticks, :3] = values[:, 13:]
        elif log.commanded_torque is not None:
            log.commanded_torque[ticks] = values

    def _note_sending(
        self, topic: topics.Topic, batch: Batch, which: NDArray[np.intp], ticks: NDArray[np.int64]
    ) -> None:
        if topic is topics.JOINT_STATES:
            return
        sent_ns = batch.publish_ns[which]
        self._sent_ns["state" if topic is topics.BASE_STATE else "command"][ticks] = sent_ns
        self._wall_clock = self._wall_clock or bool(np.any(sent_ns != batch.log_ns[which]))

    def _note_laws(self, batch: Batch, ticks: NDArray[np.int64]) -> None:
        for i, tick in enumerate(ticks.tolist()):
            try:
                self._laws.append(LawCodec.decode(batch.message(i), tick))
            except MessageError as error:
                self._law_faults.append(str(error))

    def _columns(self) -> list[NDArray[Any]]:
        return [
            *(getattr(self.log, name) for name in (*STATE_FIELDS, *REFERENCE, "commanded_torque")),
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
