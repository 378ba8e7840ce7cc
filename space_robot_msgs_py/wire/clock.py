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
    """A rosgraph_msgs/Clock: nothing but a stamp."""

    topic = topics.CLOCK

    def content(self, rows: int = 1) -> Mapping[str, Any]:
        """Its stamp is no field of ours."""
        return {}

    def runs(self, message: Any) -> Iterable[Run]:
        """There are none."""
        return ()


class ClockCodec:
    """/clock."""

    def __init__(self) -> None:
        self._codec = Codec(Clock((), Timebase(1)))
        self._nothing = np.empty(0)

    def encode(self, stamp_ns: int) -> bytes:
        """The bytes of /clock."""
        return self._codec.encode(stamp_ns, self._nothing)
