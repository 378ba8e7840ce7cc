"""/markers: a robot's shapes in the inertial frame, for viewers without transforms."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from .. import topics
from ..samples import Timebase
from .cdr import MessageLayout
from .poses import PosesCodec

CUBE, SPHERE, CYLINDER, MESH = 1, 2, 3, 10
"""Types of visualization_msgs/Marker."""
DELETE_ALL = 3
"""One of its actions; to add is 0."""


class Marker(NamedTuple):
    """A shape that moves about; its name and number tell it from all others."""

    name: str
    number: int
    kind: int
    """`CUBE`, `SPHERE`, `CYLINDER` or `MESH`."""
    scale: tuple[float, float, float]
    """m: the size along x, y, z; of a mesh the factors of its own."""
    colour: tuple[float, float, float, float]
    """Red, green, blue, alpha, from 0 to 1."""
    mesh: str = ""
    """Address of a mesh."""
    has_own_colours: bool = False
    """Whether those of the mesh are shown, times ``colour``."""


class MarkersCodec(PosesCodec):
    """Poses of always the same markers in the inertial frame, as a MarkerArray."""

    def __init__(self, markers: Sequence[Marker], timebase: Timebase) -> None:
        """``markers``: in the order of the poses."""
        content = {"markers": [*map(_content, markers)]}
        paths = [f"markers[{i}].pose.position" for i in range(len(markers))]
        super().__init__(topics.MARKERS.type, content, paths, timebase)


def no_markers() -> bytes:
    """Return the message that takes all markers away: those of a flight before."""
    marker = {"header": {"frame_id": topics.INERTIAL_FRAME}, "action": DELETE_ALL}
    return MessageLayout(topics.MARKERS.type, {"markers": [marker]}).data


def _content(marker: Marker) -> Mapping[str, Any]:
    """Return its fields; without a lifetime it stays in sight when a flight is paused or over."""
    red, green, blue, alpha = marker.colour
    return {
        "header": {"frame_id": topics.INERTIAL_FRAME},
        "ns": marker.name,
        "id": marker.number,
        "type": marker.kind,
        "scale": dict(zip("xyz", marker.scale, strict=True)),
        "color": {"r": red, "g": green, "b": blue, "a": alpha},
        "mesh_resource": marker.mesh,
        "mesh_use_embedded_materials": marker.has_own_colours,
    }
