"""/tf and /tf_static: the pose of every frame relative to its parent."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from .. import topics
from ..samples import Timebase
from .poses import PosesCodec


class Frame(NamedTuple):
    """Names of a frame and of its parent."""

    parent: str
    child: str


class TransformsCodec(PosesCodec):
    """Encodes poses of a constant set of frames relative to their parents as tf2_msgs/TFMessage."""

    def __init__(self, frames: Sequence[Frame], timebase: Timebase) -> None:
        """Create the codec for ``frames``, in the order of the poses."""
        content = [{"header": {"frame_id": f.parent}, "child_frame_id": f.child} for f in frames]
        paths = [f"transforms[{i}].transform.translation" for i in range(len(frames))]
        super().__init__(topics.TF.type, {"transforms": content}, paths, timebase)
