"""/clock: the time of the flight."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from .. import topics
from ..samples import Timebase
from .codec import Codec
from .message import MessageDescription, Run


class Clock(MessageDescription):
    """A rosgraph_msgs/Clock, which has only a stamp."""

    topic = topics.CLOCK

    def content(self, rows: int = 1) -> Mapping[str, Any]:
        """Return no fields: the stamp is written separately."""
        return {}

    def runs(self, message: Any) -> Iterable[Run]:
        """Return no numbers."""
        return ()


class ClockCodec:
    """Encodes /clock."""

    def __init__(self) -> None:
        self._codec = Codec(Clock((), Timebase(1)))
        self._nothing = np.empty(0)

    def encode(self, stamp_ns: int) -> bytes:
        """Return the bytes of /clock."""
        return self._codec.encode(stamp_ns, self._nothing)
