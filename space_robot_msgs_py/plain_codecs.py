"""Codecs that need no compiled code: a node that has no other starts half a second sooner."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from . import topics
from .cdr import CdrBuilder
from .definitions import decode
from .errors import MessageError

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
