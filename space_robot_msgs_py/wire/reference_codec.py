"""Conversion of the desired motion to /reference/joints and /reference/base, and back."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ..samples import ReferenceChunk, Timebase
from .codec import Codec
from .reference_base import ReferenceBase
from .reference_joints import ReferenceJoints

Array = NDArray[np.float64]


class ReferenceCodec:
    """Converts `ReferenceChunk` to its two messages and back.

    The length of messages may vary; a constant length is fastest.
    """

    def __init__(self, joint_names: Sequence[str], timebase: Timebase) -> None:
        self._n, self._timebase = len(joint_names), timebase
        self._joints = Codec(ReferenceJoints(joint_names, timebase))
        self._base = Codec(ReferenceBase(joint_names, timebase))

    def encode(self, chunk: ReferenceChunk) -> tuple[bytes, bytes]:
        """Return the bytes of /reference/joints and /reference/base."""
        stamp_ns = self._timebase.stamp_ns(chunk.start)
        joints, base = chunk.joints.reshape(-1), chunk.base.reshape(-1)
        return self._joints.encode(stamp_ns, joints), self._base.encode(stamp_ns, base)

    def decode_joints(self, data: bytes) -> tuple[int, Array]:
        """Return first tick and rows (k, 3, n) of a /reference/joints.

        Raises:
            MessageError: other joints than expected, or points not one tick apart.
        """
        stamp_ns, values = self._joints.decode(data)
        return self._timebase.tick(stamp_ns), values.reshape(-1, 3, self._n)

    def decode_base(self, data: bytes) -> tuple[int, Array]:
        """Return first tick and rows (k, 10) of a /reference/base.

        Raises:
            MessageError: points not one tick apart.
        """
        stamp_ns, values = self._base.decode(data)
        return self._timebase.tick(stamp_ns), values.reshape(-1, 10)
