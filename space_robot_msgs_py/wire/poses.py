"""Messages whose numbers alone change, all with one stamp: poses of frames or shapes, the base."""

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


class NumbersCodec:
    """Writes numbers and stamps into a message that is otherwise constant."""

    def __init__(
        self,
        type_name: str,
        content: Mapping[str, Any],
        runs: Sequence[tuple[str, int]],
        timebase: Timebase,
    ) -> None:
        """Compute the layout of the message.

        Args:
            type_name: type of the message.
            content: its constant fields.
            runs: path of the first of some consecutive numbers, such as ``pose.position``, and how
                many they are.
            timebase: conversion between ticks and stamps.
        """
        self._timebase = timebase
        layout = MessageLayout(type_name, content)
        self._wire = np.zeros(BODY + layout.pattern.shape[1], np.uint8)[BODY:]
        self._wire[:] = layout.pattern[0]
        self._body = body(self._wire)
        starts = [((layout.slots[path].offset - BODY) // 8, count) for path, count in runs]
        self._at = np.array([start + k for start, count in starts for k in range(count)], np.intp)
        self._stamps = layout.stamps

    def encode(self, tick: int, numbers: Array) -> bytes:
        """Return the message of a tick, from its numbers in the order of the runs."""
        self._body[self._at] = numbers.reshape(-1)
        stamp = divmod(self._timebase.stamp_ns(tick), 1_000_000_000)
        for place in self._stamps:
            STAMP.pack_into(self._wire.data, place, *stamp)
        return self._wire.tobytes()


class PosesCodec(NumbersCodec):
    """Writes poses (M, 7), in the order of their paths."""

    def __init__(
        self, type_name: str, content: Mapping[str, Any], paths: Sequence[str], timebase: Timebase
    ) -> None:
        """``paths``: start of each pose, such as ``transforms[0].transform.translation``."""
        super().__init__(type_name, content, [(path, POSE) for path in paths], timebase)
