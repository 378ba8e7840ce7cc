"""The messages of a bag into the rows of a `FlightLog`, batch by batch."""

from __future__ import annotations

from collections import Counter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .. import topics
from ..errors import MessageError
from ..flight_log import FlightLog
from ..reference_codec import ReferenceCodec
from ..samples import Timebase
from .batch import Batch
from .coverage import LONGEST_JUMP, Coverage
from .kernels import NO_STAMP, read_stamps
from .layouts import BASE_WIDTH, Numbers, base_state, first_number, joint_states

BASE_AXES = ("base_x", "base_y", "base_z")
_GROWTH = 1.25
_TICKS_A_MESSAGE = 20
"""A tick further away than so many ticks a message is not believed: it would cost memory."""
_NEVER = np.iinfo(np.int64).min
_STATE_COLUMNS = (
    "base_position", "quaternion", "base_velocity", "omega_base", "joint_positions",
    "joint_velocities", "applied_torque", "reference_joints", "reference_base",
    "commanded_torque",
)  # fmt: skip


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
        self.coverages: dict[str, Coverage] = {}
        self.counts: Counter[str] = Counter()
        """Messages a topic, of every kind."""
        self.misfits: Counter[str] = Counter()
        """Messages a topic whose content could not be read."""
        self._origin_ns = origin_ns
        self._sent_ns = {name: np.empty(0, np.int64) for name in ("state", "command")}
        self._wall_clock = False
        self._rows = self._believed = 0
        self._references = ReferenceCodec(joint_names, timebase)
        arrays = ("position", "velocity", "effort")
        self._numbers = {
            topic: Numbers(topic.type, width, describe)
            for topic, width, describe in (
                (topics.JOINT_STATES, 3 * n, joint_states(topics.JOINT_STATES, joint_names, arrays)),
                (topics.BASE_STATE, BASE_WIDTH, base_state),
                (topics.COMMAND, n + 3,
                 joint_states(topics.COMMAND, (*BASE_AXES, *joint_names), ("effort",))),
                (topics.TELEMETRY, 1, first_number),
            )
        }  # fmt: skip

    def oddities(self, excused: bool) -> list[str]:
        """Messages that could not be used; strange stamps are no news if ``excused``."""
        faults = {topic.name: numbers.fault for topic, numbers in self._numbers.items()}
        found = [
            f"{count} messages on {name} do not fit ({faults.get(name) or 'a broken trajectory'})"
            for name, count in self.misfits.items()
        ]
        for name, coverage in self.coverages.items():
            if coverage.strange and not excused:
                found.append(
                    f"{coverage.strange} messages on {name} whose stamp is no whole tick "
                    "or out of all order"
                )
        return found

    def take(self, topic: topics.Topic, batch: Batch) -> None:
        """Count the messages of a topic and put what they say into their ticks' rows."""
        coverage = self.coverages.setdefault(topic.name, Coverage(topic))
        self.counts[topic.name] += len(batch)
        ticks, known = self._ticks(topic, batch)
        coverage.strange += int(np.count_nonzero(~known))
        fresh = np.flatnonzero(known)[coverage.take_all(ticks[known])]
        if len(fresh) < len(batch):
            batch, ticks = batch.select(fresh), ticks[fresh]
        self._believed += _TICKS_A_MESSAGE * len(batch)
        if topic in (topics.REFERENCE_JOINTS, topics.REFERENCE_BASE):
            self._take_references(topic, batch, ticks)
        elif topic in (topics.JOINT_STATES, topics.BASE_STATE, topics.COMMAND):
            self._grow(coverage.last + 1)
            near = ticks < self._rows
            if not near.all():
                batch, ticks = batch.select(near), ticks[near]
            values, good = self._numbers[topic].read(batch)
            if not good.all():
                self.misfits[topic.name] += int(np.count_nonzero(~good))
                batch, ticks, values = batch.select(good), ticks[good], values[good]
            self._put(topic, ticks, values)
            self._note_sending(topic, batch, ticks)

    def finish(self, ticks: int) -> FlightLog:
        """The log, cut to ``ticks`` rows."""
        log = self.log
        for column in self._columns():
            column.resize((ticks, *column.shape[1:]), refcheck=False)
        if topics.COMMAND.name not in self.coverages:
            log.commanded_torque = None
        sent, answered = self._sent_ns["state"], self._sent_ns["command"]
        if self._wall_clock and topics.COMMAND.name in self.coverages:
            log.latency_s = (answered - sent) * 1e-9
            log.latency_s[(answered == _NEVER) | (sent == _NEVER)] = np.nan
        return log

    def _ticks(
        self, topic: topics.Topic, batch: Batch
    ) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
        """(M,) ticks, and of which messages they are to be had."""
        if topic is topics.TELEMETRY:
            values, known = self._numbers[topic].read(batch)
            known &= np.abs(values[:, 0]) < 2**53
            return np.where(known, values[:, 0], 0).astype(np.int64), known
        stamps = stamps_of(batch)
        known = stamps != NO_STAMP
        ticks, rest = np.divmod(stamps - self._origin_ns, self.log.timebase.period_ns)
        known &= rest == 0
        if topic.per_tick:
            known &= ticks >= 0
        return ticks, known

    def _take_references(self, topic: topics.Topic, batch: Batch, ticks: NDArray[np.int64]) -> None:
        decode, column = (
            (self._references.decode_joints, self.log.reference_joints)
            if topic is topics.REFERENCE_JOINTS
            else (self._references.decode_base, self.log.reference_base)
        )
        for i, first in enumerate(ticks.tolist()):
            data = batch.message(i)
            try:  # its tick is known: a stamp of 0 is right whatever the origin
                _, rows = decode(data[:4] + bytes(8) + data[12:])
            except MessageError:
                self.misfits[topic.name] += 1
                continue
            self._believed += len(rows)
            self._grow(first + len(rows))
            start, stop = max(first, 0), min(first + len(rows), self._rows)
            if start < stop:
                column[start:stop] = rows[start - first : stop - first]

    def _put(self, topic: topics.Topic, ticks: NDArray[np.int64], values: Any) -> None:
        log, n = self.log, len(self.log.joint_names)
        if topic is topics.JOINT_STATES:
            log.joint_positions[ticks] = values[:, :n]
            log.joint_velocities[ticks] = values[:, n : 2 * n]
            log.applied_torque[ticks, 3:] = values[:, 2 * n :]
        elif topic is topics.BASE_STATE:
            log.base_position[ticks] = values[:, :3]
            log.quaternion[ticks, 1:] = values[:, 3:6]
            log.quaternion[ticks, 0] = values[:, 6]
            log.base_velocity[ticks] = values[:, 7:10]
            log.omega_base[ticks] = values[:, 10:13]
            log.applied_torque[ticks, :3] = values[:, 16:]
        elif log.commanded_torque is not None:
            log.commanded_torque[ticks] = values

    def _note_sending(self, topic: topics.Topic, batch: Batch, ticks: NDArray[np.int64]) -> None:
        if topic is not topics.JOINT_STATES:
            name = "state" if topic is topics.BASE_STATE else "command"
            self._sent_ns[name][ticks] = batch.publish_ns
            if not self._wall_clock:
                self._wall_clock = bool(np.any(batch.publish_ns != batch.log_ns))

    def _columns(self) -> list[NDArray[Any]]:
        return [*(getattr(self.log, name) for name in _STATE_COLUMNS), *self._sent_ns.values()]

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
