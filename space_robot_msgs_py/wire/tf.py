"""/tf and /tf_static: the pose of every frame on the one that it moves against."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .. import topics
from ..samples import Timebase
from .cdr import BODY, STAMP, MessageLayout
from .message import body

Array = NDArray[np.float64]

POSE = 7
"""Numbers of a pose: translation, m, and rotation x, y, z, w to the parent's axes."""


class Frame(NamedTuple):
    """A frame and its parent, by their names."""

    parent: str
    child: str


class TransformsCodec:
    """Poses of always the same frames as a tf2_msgs/TFMessage."""

    def __init__(self, frames: Sequence[Frame], timebase: Timebase) -> None:
        """``frames``: in the order of the poses."""
        self._timebase = timebase
        content = [{"header": {"frame_id": f.parent}, "child_frame_id": f.child} for f in frames]
        layout = MessageLayout(topics.TF.type, {"transforms": content})
        self._wire = np.zeros(BODY + layout.pattern.shape[1], np.uint8)[BODY:]
        self._wire[:] = layout.pattern[0]
        self._body = body(self._wire)
        starts = [
            (layout.slots[f"transforms[{i}].transform.translation"].offset - BODY) // 8
            for i in range(len(frames))
        ]
        self._at = np.add.outer(starts, np.arange(POSE)).astype(np.intp)
        self._stamps = layout.stamps

    def encode(self, tick: int, poses: Array) -> bytes:
        """Return the message of a tick, from the frames' poses (M, 7)."""
        self._body[self._at] = poses
        stamp = divmod(self._timebase.stamp_ns(tick), 1_000_000_000)
        for place in self._stamps:
            STAMP.pack_into(self._wire.data, place, *stamp)
        return self._wire.tobytes()
