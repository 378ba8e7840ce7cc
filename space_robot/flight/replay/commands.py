"""Commands as they come, kept as arrays: tick, torque, and whatever else a message says."""

from __future__ import annotations

import struct
from array import array
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py import topics
from space_robot_msgs_py.errors import MessageError
from space_robot_msgs_py.samples import Timebase
from space_robot_msgs_py.wire.cdr import header_stamp_ns
from space_robot_msgs_py.wire.codecs import FOREIGN, CompiledCodec
from space_robot_msgs_py.wire.definitions import decode
from space_robot_msgs_py.wire.messages import describe, name_order

Array = NDArray[np.float64]
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
    form: NDArray[np.intp]
    """(N,) index into ``forms``."""
    forms: list[Form]
    unreadable: int
    """Messages that were no command at all, or not of a whole tick."""

    def within(self, start: int, stop: float) -> ReplayedCommands:
        """Those of the ticks from ``start`` to before ``stop``."""
        inside = (self.ticks >= start) & (self.ticks < stop)
        return self._replace(
            ticks=self.ticks[inside], torque=self.torque[inside], form=self.form[inside]
        )


class CommandList:
    """List of serialized /command messages, about 90 bytes each. Independent of ROS."""

    def __init__(self, axis_names: tuple[str, ...], timebase: Timebase) -> None:
        self._names, self._timebase = axis_names, timebase
        self._usual = CompiledCodec(describe(topics.COMMAND, axis_names, timebase))
        self._torque = np.zeros(len(axis_names))
        usual = Form(topics.BASE_FRAME, str(list(axis_names)))
        self._forms: dict[Form, int] = {usual: 0}
        self._ticks, self._torques, self._form = array("q"), array("d"), array("I")
        self._unreadable = 0

    def add(self, data: bytes) -> int | None:
        """Take a message; the tick it answers, or None if it is not readable."""
        form = 0
        try:
            if (stamp_ns := self._usual.read(data, self._torque)) == FOREIGN:
                stamp_ns, form = self._read_foreign(data)
            tick = self._timebase.tick(stamp_ns)
        except MessageError:
            self._unreadable += 1
            return None
        self._ticks.append(tick)
        self._torques.frombytes(self._torque.tobytes())
        self._form.append(form)
        return tick

    def _read_foreign(self, data: bytes) -> tuple[int, int]:
        """Stamp, ns, and form of a message in another layout; its torques into ``_torque``."""
        message = decode(data, topics.COMMAND.type)
        efforts, names = message.effort, list(message.name)
        form = Form(
            message.header.frame_id, str(names), _text(message.position), _text(message.velocity)
        )
        try:
            order = name_order(names, self._names, topics.COMMAND.full_name)
            self._torque[:] = efforts[order]
        except (MessageError, IndexError):
            self._torque[:] = np.nan
            form = form._replace(effort=_text(efforts))
        return header_stamp_ns(data), self._forms.setdefault(form, len(self._forms))

    def commands(self) -> ReplayedCommands:
        """Return what has come; of several commands of one tick the first."""
        ticks, first = np.unique(np.frombuffer(self._ticks, np.int64), return_index=True)
        torques = np.frombuffer(self._torques, np.float64).reshape(-1, len(self._names))
        form = np.frombuffer(self._form, np.uint32).astype(np.intp)
        return ReplayedCommands(
            ticks, torques[first], form[first], list(self._forms), self._unreadable
        )


def number(value: float) -> float | str:
    """A number to show: a NaN, of which there are many, by its bits."""
    (bits,) = struct.unpack("<Q", struct.pack("<d", value))
    return float(value) if value == value else f"nan 0x{bits:016x}"


def _text(values: Any) -> str:
    return str([number(value) for value in np.asarray(values, np.float64)])
