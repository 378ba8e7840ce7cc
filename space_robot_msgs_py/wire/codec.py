"""Conversion of messages to flat arrays and back by NumPy, for nodes without compiled code."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .cdr import BODY, STAMP, header_stamp_ns
from .message import MessageDescription, Numbers, body

Array = NDArray[np.float64]


class Codec:
    """Writes and reads the messages of a topic.

    A message with the layout of the last one is read by copying its numbers; a new layout is
    decoded in general form once.
    """

    def __init__(self, description: MessageDescription) -> None:
        self._description = description
        self._width = sum(column.length for column in description.columns)
        self._write_like(description.own())

    def _write_like(self, own: Numbers) -> None:
        room = np.zeros(BODY + own.layout.pattern.shape[1], np.uint8)
        self._wire = room[BODY:]  # aligns the float64 in memory
        self._wire[:] = own.layout.pattern[0]
        self._body = body(self._wire)
        self._to = own.words
        self._read_like(own)

    def _read_like(self, known: Numbers) -> None:
        self._pattern = known.layout.pattern
        self._from = known.words

    def encode(self, stamp_ns: int | None, values: Array) -> bytes:
        """Return the serialized message of some numbers.

        Args:
            stamp_ns: its stamp (None: without stamp).
            values: all rows, flattened.
        """
        if values.size != self._to.size:
            self._write_like(self._description.own(values.size // self._width))
        self._body[self._to] = values
        if stamp_ns is not None:
            STAMP.pack_into(self._wire.data, BODY, *divmod(stamp_ns, 1_000_000_000))
        return self._wire.tobytes()

    def decode(self, data: bytes) -> tuple[int, Array]:
        """Return the stamp, ns, and the numbers of all rows, flattened, of a message of the topic.

        Raises:
            MessageError: the bytes are not a message of this topic and robot.
        """
        layout, constant = self._pattern
        if len(data) >= len(layout):  # other writers may append bytes
            message = np.frombuffer(data, np.uint8, len(layout))
            if not np.any((message ^ layout) & constant):
                return header_stamp_ns(data), body(message)[self._from]
        known = self._description.learn(data)
        self._read_like(known)
        return header_stamp_ns(known.layout.data), known.values
