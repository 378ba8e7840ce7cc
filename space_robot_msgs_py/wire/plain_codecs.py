"""Codecs that need no compiled code: a node that has no other starts half a second sooner."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from .. import topics
from ..errors import MessageError
from ..samples import LawInForce, Timebase
from .cdr import CdrBuilder, Slot
from .definitions import decode

Array = NDArray[np.float64]


class TelemetryCodec:
    """s, u, N_hat and e as a labelled Float64MultiArray; the padding before holds the tick."""

    ROWS = ("s", "u", "n_hat", "e")

    def __init__(self, axis_names: Sequence[str]) -> None:
        rows, columns = len(self.ROWS), len(axis_names)
        builder = CdrBuilder()
        builder.uint32(2)
        for label, size, stride in (
            ("signal: " + ", ".join(self.ROWS), rows, rows * columns),
            ("axis: " + ", ".join(axis_names), columns, columns),
        ):
            builder.string(label)
            builder.uint32(size)
            builder.uint32(stride)
        builder.uint32(1)  # data_offset: data[0] is the tick
        slot = builder.float64_sequence_slot(1 + rows * columns)
        self._message = builder.build()
        data = self._message.float64(slot)
        self._tick, self._values = data[:1], data[1:].reshape(rows, columns)

    def encode(self, tick: int, rows: Sequence[Array]) -> bytes:
        """The bytes of /controller/telemetry for the rows named by ``ROWS``."""
        self._tick[0] = tick
        for target, row in zip(self._values, rows, strict=True):
            target[:] = row
        return self._message.to_bytes()

    @staticmethod
    def decode(data: bytes) -> tuple[int, Array]:
        """Tick and (4, n+3) rows.

        Raises:
            MessageError: the message does not fit.
        """
        message = decode(data, topics.TELEMETRY.type)
        offset, shape = message.layout.data_offset, [dim.size for dim in message.layout.dim]
        try:
            return int(message.data[0]), message.data[offset:].reshape(shape)
        except (IndexError, ValueError, OverflowError) as error:
            raise MessageError(f"{topics.TELEMETRY.name}: {error}") from None


class ClockCodec:
    """/clock."""

    def __init__(self) -> None:
        builder = CdrBuilder()
        self._stamp = builder.stamp_slot()
        self._message = builder.build()

    def encode(self, stamp_ns: int) -> bytes:
        """The bytes of /clock."""
        self._message.set_stamp(self._stamp, stamp_ns)
        return self._message.to_bytes()


class LawCodec:
    """`LawInForce` as /controller/law: the parameters ``controller`` and ``<law>.<gain>``.

    They are ``new_parameters`` of the law a controller begins with, ``changed_parameters`` of
    every other. A change is rare, so each message is laid out anew.
    """

    NODE = "/controller_node"
    CONTROLLER = "controller"
    STRING, DOUBLE_ARRAY = 4, 8  # of rcl_interfaces/ParameterType

    def __init__(self, timebase: Timebase) -> None:
        self._timebase = timebase

    def encode(self, law: LawInForce) -> bytes:
        """The bytes of /controller/law."""
        builder = CdrBuilder()
        stamp = builder.stamp_slot()
        builder.string(self.NODE)
        if not law.is_first:
            builder.uint32(0)  # new parameters
        builder.uint32(1 + len(law.gains))
        self._parameter(builder, self.CONTROLLER, self.STRING, law.name)
        slots = [
            self._parameter(builder, f"{law.name}.{gain}", self.DOUBLE_ARRAY, size=len(values))
            for gain, values in law.gains.items()
        ]
        if law.is_first:
            builder.uint32(0)  # changed parameters
        builder.uint32(0)  # deleted parameters
        message = builder.build()
        message.set_stamp(stamp, self._timebase.stamp_ns(law.tick))
        for slot, values in zip(slots, law.gains.values(), strict=True):
            message.float64(slot)[:] = values
        return message.to_bytes()

    @staticmethod
    def decode(data: bytes, tick: int) -> LawInForce:
        """The law of a message stamped with ``tick``.

        Raises:
            MessageError: the message names no law, or a gain of it is no list of numbers.
        """
        message = decode(data, topics.LAW.type)
        given = {p.name: p.value for p in (*message.new_parameters, *message.changed_parameters)}
        law = given.get(LawCodec.CONTROLLER)
        if law is None or law.type != LawCodec.STRING:
            raise MessageError(f"{topics.LAW.name}: no parameter {LawCodec.CONTROLLER!r}")
        name, gains = law.string_value, {}
        for key, value in given.items():
            if key.startswith(f"{name}."):
                if value.type != LawCodec.DOUBLE_ARRAY:
                    raise MessageError(f"{topics.LAW.name}: {key} is no list of numbers")
                gains[key.removeprefix(f"{name}.")] = tuple(value.double_array_value.tolist())
        is_first = any(p.name == LawCodec.CONTROLLER for p in message.new_parameters)
        return LawInForce(tick, name, gains, is_first)

    @staticmethod
    def _parameter(
        builder: CdrBuilder, name: str, kind: int, text: str = "", size: int = 0
    ) -> Slot:
        """A Parameter with one of its values set: where the numbers of a list stand."""
        builder.string(name)
        builder.uint8(kind)
        builder.uint8(False)  # bool_value
        builder.float64_slot(2)  # integer_value, double_value
        builder.string(text)
        for _ in range(3):
            builder.uint32(0)  # byte, bool, integer array
        slot = builder.float64_sequence_slot(size)
        builder.uint32(0)  # string array
        return slot
