"""Comparison of recorded and replayed commands, bit by bit."""

from __future__ import annotations

import struct
from array import array
from collections.abc import Collection, Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from space_robot_model.elementary.matrices import Array
from space_robot_msgs_py import topics
from space_robot_msgs_py.errors import MessageError
from space_robot_msgs_py.samples import Timebase
from space_robot_msgs_py.wire.cdr import header_stamp_ns
from space_robot_msgs_py.wire.codecs import FOREIGN, CompiledCodec
from space_robot_msgs_py.wire.definitions import decode
from space_robot_msgs_py.wire.messages import describe, name_order

Ticks = NDArray[np.int64]


class Form(NamedTuple):
    """All of a command but its stamp and its torques; the lists as text."""

    frame_id: str
    name: str
    position: str = "[]"
    velocity: str = "[]"
    effort: str = ""
    """Only where the torques do not fit the robot's axes."""


class ReplayedCommands(NamedTuple):
    """One command a tick, by rising tick."""

    ticks: Ticks
    """(N,)"""
    torque: Array
    """(N, m) N m, in the order of the robot's axes; NaN where a message has others."""
    forms: Mapping[int, Form]
    """By tick, of those whose form is not that of this project."""
    unreadable: int = 0
    """Messages that were no command at all, or not of a whole tick."""

    def within(self, start: int, stop: float) -> ReplayedCommands:
        """Those of the ticks from ``start`` to before ``stop``."""
        inside = (self.ticks >= start) & (self.ticks < stop)
        return self._replace(ticks=self.ticks[inside], torque=self.torque[inside])


class CommandList:
    """Serialized /command messages, kept as arrays of about 80 bytes each."""

    def __init__(self, axis_names: tuple[str, ...], timebase: Timebase) -> None:
        self._names, self._timebase = axis_names, timebase
        self._usual = CompiledCodec(describe(topics.COMMAND, axis_names, timebase))
        self._torque = np.zeros(len(axis_names))
        self._ticks, self._torques = array("q"), array("d")
        self._forms: dict[int, Form] = {}
        self._unreadable = 0

    def add(self, data: bytes) -> None:
        """Add a message."""
        try:
            form = None
            if (stamp_ns := self._usual.read(data, self._torque)) == FOREIGN:
                stamp_ns, form = header_stamp_ns(data), self._read_foreign(data)
            tick = self._timebase.tick(stamp_ns)
        except MessageError:
            self._unreadable += 1
            return
        if form:
            self._forms[len(self._ticks)] = form
        self._ticks.append(tick)
        self._torques.frombytes(self._torque.tobytes())

    def _read_foreign(self, data: bytes) -> Form:
        message = decode(data, topics.COMMAND.type)
        efforts, names = message.effort, list(message.name)
        texts = _text(message.position), _text(message.velocity)
        form = Form(message.header.frame_id, str(names), *texts)
        try:
            order = name_order(names, self._names, topics.COMMAND.full_name)
            self._torque[:] = efforts[order]
        except (MessageError, IndexError):
            self._torque[:] = np.nan
            return form._replace(effort=_text(efforts))
        return form

    def commands(self) -> ReplayedCommands:
        """Return the commands; of several for one tick the first."""
        ticks, first = np.unique(np.frombuffer(self._ticks, np.int64), return_index=True)
        torques = np.frombuffer(self._torques, np.float64).reshape(-1, len(self._names))
        kept = set(first.tolist()) & self._forms.keys()
        forms = {self._ticks[i]: self._forms[i] for i in kept}
        return ReplayedCommands(ticks, torques[first], forms, self._unreadable)


def number(value: float) -> float | str:
    """A number to show: a NaN, of which there are many, by its bits."""
    (bits,) = struct.unpack("<Q", struct.pack("<d", value))
    return float(value) if value == value else f"nan 0x{bits:016x}"


def _text(values: Any) -> str:
    return str([number(value) for value in np.asarray(values, np.float64)])


class Difference(NamedTuple):
    """A field that differs between recording and replay."""

    field: str
    recorded: float | str
    replayed: float | str

    @property
    def amount(self) -> float | None:
        """Replayed less recorded; None for fields without a difference."""
        if isinstance(self.recorded, str) or isinstance(self.replayed, str):
            return None
        return self.replayed - self.recorded


class Stretch(NamedTuple):
    """A stretch of consecutive ticks that were compared."""

    first: int
    last: int
    equal: int
    """Ticks whose commands are equal to the last bit."""


class Comparison:
    """Commands of the ticks that were played."""

    def __init__(
        self,
        axis_names: tuple[str, ...],
        played: Ticks,
        recorded: ReplayedCommands,
        replayed: ReplayedCommands,
        forces: Collection[str] = (),
        dipoles: Collection[str] = (),
    ) -> None:
        """Compare the commands of the ticks ``played``, whose state was sent to the controller.

        ``forces``: names of prismatic joints and thrusters, in N; ``dipoles``: of magnetic
        torquers, in A m2.
        """
        self.axis_names = axis_names
        units = {**dict.fromkeys(forces, "N"), **dict.fromkeys(dipoles, "A m2")}
        self.units = tuple(units.get(name, "N m") for name in axis_names)
        """Of each axis."""
        self._recorded, self._replayed = recorded, replayed
        self._played = np.unique(played)
        is_played = np.isin(recorded.ticks, self._played)
        self.without_state = int(np.count_nonzero(~is_played))
        """Number of commands recorded without the state that they answer."""
        self.ticks, at, again = np.intersect1d(
            recorded.ticks[is_played], replayed.ticks, assume_unique=True, return_indices=True
        )
        """(K,) Ticks with both commands."""
        self.recorded: Array = recorded.torque[is_played][at]
        """(K, m) in `units`."""
        self.replayed: Array = replayed.torque[again]
        """(K, m) in `units`."""
        self.unanswered: Ticks = np.setdiff1d(recorded.ticks[is_played], replayed.ticks)
        """Ticks with a recorded command that have none now."""
        self.unrecorded: Ticks = np.setdiff1d(replayed.ticks, recorded.ticks)
        """Ticks with a command now that have none in the bag."""
        self._same_torque = _bits(self.recorded) == _bits(self.replayed)
        other = [
            tick
            for tick in {*recorded.forms, *replayed.forms}
            if recorded.forms.get(tick) != replayed.forms.get(tick)
        ]
        self.equal: NDArray[np.bool_] = self._same_torque.all(axis=1) & ~np.isin(self.ticks, other)
        """(K,) whether every field is the same, to the last bit."""

    @property
    def is_identical(self) -> bool:
        """True if all are equal and none is missing on either side."""
        missing = len(self.unanswered) + len(self.unrecorded) + self.without_state
        unreadable = self._recorded.unreadable + self._replayed.unreadable
        return bool(len(self.ticks) and self.equal.all() and not missing and not unreadable)

    @property
    def stretches(self) -> list[Stretch]:
        """The ticks compared, cut where one or more were not."""
        if not len(self.ticks):
            return []
        cuts = np.flatnonzero(np.diff(self.ticks) > 1) + 1
        parts = zip(np.split(self.ticks, cuts), np.split(self.equal, cuts), strict=True)
        return [
            Stretch(int(ticks[0]), int(ticks[-1]), int(np.count_nonzero(equal)))
            for ticks, equal in parts
        ]

    @property
    def difference(self) -> Array:
        """(K, m) N m, replayed less recorded."""
        with np.errstate(invalid="ignore"):  # infinite ones
            difference: Array = self.replayed - self.recorded
        return difference

    def first_difference(self) -> tuple[int, list[Difference]] | None:
        """The first tick that is not equal, and its fields that are not."""
        if self.equal.all():
            return None
        k = int(np.argmin(self.equal))
        tick = int(self.ticks[k])
        usual = Form(topics.BASE_FRAME, str(list(self.axis_names)))
        one, other = (c.forms.get(tick, usual) for c in (self._recorded, self._replayed))
        differences = [
            Difference(field, a, b)
            for field, a, b in zip(usual._fields, one, other, strict=True)
            if a != b
        ]
        differences += [
            Difference(
                f"effort[{self.axis_names[i]}]",
                number(self.recorded[k, i]),
                number(self.replayed[k, i]),
            )
            for i in np.flatnonzero(~self._same_torque[k])
        ]
        return tick, differences

    def report(self, period: float) -> dict[str, Any]:
        """The numbers, for JSON and the table; ``period``: of a tick, s."""
        first, difference = self.first_difference(), self.difference
        return {
            "played": len(self._played),
            "compared": len(self.ticks),
            "equal": int(np.count_nonzero(self.equal)),
            "unanswered": len(self.unanswered),
            "unrecorded": len(self.unrecorded),
            "without_state": self.without_state,
            "unreadable": {
                "recorded": self._recorded.unreadable,
                "replayed": self._replayed.unreadable,
            },
            "identical": self.is_identical,
            "stretches": [
                {
                    "from_s": round(stretch.first * period, 9),
                    "to_s": round(stretch.last * period, 9),
                    "compared": stretch.last - stretch.first + 1,
                    "equal": stretch.equal,
                }
                for stretch in self.stretches
            ],
            "first_difference": first
            and {
                "tick": first[0],
                "time_s": round(first[0] * period, 9),
                "fields": [{**d._asdict(), "difference": d.amount} for d in first[1]],
            },
            "axes": {
                name: {
                    "unit": self.units[i],
                    "recorded_rms": _rms(self.recorded[:, i]),
                    "replayed_rms": _rms(self._replayed_torque[:, i]),
                    "difference_rms": _rms(difference[:, i]),
                    "difference_max": _largest(difference[:, i]),
                }
                for i, name in enumerate(self.axis_names)
            },
        }

    @property
    def _replayed_torque(self) -> Array:
        return self.replayed if len(self._recorded.ticks) else self._replayed.torque

    def table(self) -> tuple[Ticks, Array, Array]:
        """Every tick with a command in either, and both torques; NaN where there is none."""
        ticks = np.union1d(self._replayed.ticks, self.unanswered)
        recorded, replayed = (np.full((len(ticks), len(self.axis_names)), np.nan) for _ in range(2))
        for commands, torque in ((self._recorded, recorded), (self._replayed, replayed)):
            _, there, place = np.intersect1d(
                commands.ticks, ticks, assume_unique=True, return_indices=True
            )
            torque[place] = commands.torque[there]
        return ticks, recorded, replayed


def _bits(values: Array) -> NDArray[np.int64]:
    return np.ascontiguousarray(values).view(np.int64)


def _rms(values: Array) -> float | None:
    finite = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(finite**2))) if len(finite) else None


def _largest(values: Array) -> float | None:
    finite = values[np.isfinite(values)]
    return float(np.abs(finite).max()) if len(finite) else None
