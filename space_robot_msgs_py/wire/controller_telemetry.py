"""/controller/telemetry: internal signals of the control law."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .. import topics
from ..errors import MessageError
from ..samples import Timebase
from .codec import Codec
from .definitions import decode
from .message import MessageDescription, Run

Array = NDArray[np.float64]

SIGNALS = ("s", "u", "n_hat", "e")


class Telemetry(MessageDescription):
    """A std_msgs/Float64MultiArray with one labelled row per signal, and the tick as padding."""

    topic = topics.TELEMETRY

    def content(self, rows: int = 1) -> Mapping[str, Any]:
        """Return the fields; the rows belong to one tick."""
        axes = self.names
        size = len(SIGNALS) * len(axes)
        dimensions = (
            ("signal: " + ", ".join(SIGNALS), len(SIGNALS), size),
            ("axis: " + ", ".join(axes), len(axes), len(axes)),
        )
        return {
            "layout": {
                "dim": [
                    {"label": label, "size": count, "stride": stride}
                    for label, count, stride in dimensions
                ],
                "data_offset": 1,
            },
            "data": [0.0] * (1 + size),
        }

    def runs(self, message: Any) -> Iterable[Run]:
        """Yield the tick, then the signals."""
        if not len(message.data):
            raise MessageError(f"{self.topic.full_name}: no tick")
        return (Run("data", range(len(message.data))),)


class TelemetryCodec:
    """Converts s, u, N_hat and e of a tick to a message and back."""

    def __init__(self, axis_names: Sequence[str]) -> None:
        self._codec = Codec(Telemetry(axis_names, Timebase(1)))
        self._numbers = np.zeros(1 + len(SIGNALS) * len(axis_names))
        self._rows = self._numbers[1:].reshape(len(SIGNALS), -1)

    def encode(self, tick: int, rows: Sequence[Array]) -> bytes:
        """Return the bytes of /controller/telemetry for the rows of `SIGNALS`."""
        self._numbers[0] = tick
        for target, row in zip(self._rows, rows, strict=True):
            target[:] = row
        return self._codec.encode(None, self._numbers)

    @staticmethod
    def decode(data: bytes) -> tuple[int, Array]:
        """Return tick and rows (4, n+3).

        Raises:
            MessageError: the message does not fit.
        """
        message = decode(data, topics.TELEMETRY.type)
        offset, shape = message.layout.data_offset, [dim.size for dim in message.layout.dim]
        try:
            return int(message.data[0]), message.data[offset:].reshape(shape)
        except (IndexError, ValueError, OverflowError) as error:
            raise MessageError(f"{topics.TELEMETRY.full_name}: {error}") from None
