"""/tf and /tf_static: the pose of every frame on the one that it moves against."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from .. import topics
from ..samples import Timebase
from .poses import PosesCodec


class Frame(NamedTuple):
    """A frame and its parent, by their names."""

    parent: str
    child: str


class TransformsCodec(PosesCodec):
    """Poses of always the same frames on their parents, as a tf2_msgs/TFMessage."""

    def __init__(self, frames: Sequence[Frame], timebase: Timebase) -> None:
        """``frames``: in the order of the poses."""
        content = [{"header": {"frame_id": f.parent}, "child_frame_id": f.child} for f in frames]
        paths = [f"transforms[{i}].transform.translation" for i in range(len(frames))]
        super().__init__(topics.TF.type, {"transforms": content}, paths, timebase)
