"""Messages with poses of a constant set of frames or shapes, all with one stamp."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..samples import Timebase
from .cdr import BODY, STAMP, MessageLayout
from .message import body

Array = NDArray[np.float64]

POSE = 7
"""Numbers of a pose: translation, m, and quaternion x, y, z, w, relative to the parent frame."""


class PosesCodec:
    """Writes poses and stamps into a message that is otherwise constant."""

    def __init__(
        self, type_name: str, content: Mapping[str, Any], paths: Sequence[str], timebase: Timebase
    ) -> None:
        """Compute the layout of the message.

        Args:
            type_name: type of the message.
            content: its fields without poses and stamps.
            paths: start of each pose, such as ``transforms[0].transform.translation``.
            timebase: conversion between ticks and stamps.
        """
        self._timebase = timebase
        layout = MessageLayout(type_name, content)
        self._wire = np.zeros(BODY + layout.pattern.shape[1], np.uint8)[BODY:]
        self._wire[:] = layout.pattern[0]
        self._body = body(self._wire)
        starts = [(layout.slots[path].offset - BODY) // 8 for path in paths]
        self._at = np.add.outer(starts, np.arange(POSE)).astype(np.intp)
        self._stamps = layout.stamps

    def encode(self, tick: int, poses: Array) -> bytes:
        """Return the message of a tick, from the poses (M, 7) in the order of their paths."""
        self._body[self._at] = poses
        stamp = divmod(self._timebase.stamp_ns(tick), 1_000_000_000)
        for place in self._stamps:
            STAMP.pack_into(self._wire.data, place, *stamp)
        return self._wire.tobytes()
