"""/markers: shapes of a robot in the inertial frame, for viewers without tf."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from .. import topics
from ..samples import Timebase
from .cdr import MessageLayout
from .poses import PosesCodec

CUBE, SPHERE, CYLINDER, MESH = 1, 2, 3, 10
"""Marker types of visualization_msgs/Marker."""
DELETE_ALL = 3
"""Action of visualization_msgs/Marker that deletes all; adding is 0."""


class Marker(NamedTuple):
    """A moving shape, identified by its name and number."""

    name: str
    number: int
    kind: int
    """`CUBE`, `SPHERE`, `CYLINDER` or `MESH`."""
    scale: tuple[float, float, float]
    """Size along x, y, z, m; for a mesh the scale factors."""
    colour: tuple[float, float, float, float]
    """Red, green, blue, alpha, from 0 to 1."""
    mesh: str = ""
    """URL of a mesh."""
    has_own_colours: bool = False
    """True to use the mesh's materials, multiplied by ``colour``."""


class MarkersCodec(PosesCodec):
    """Encodes poses of a constant set of markers in the inertial frame as a MarkerArray."""

    def __init__(self, markers: Sequence[Marker], timebase: Timebase) -> None:
        """Create the codec for ``markers``, in the order of the poses."""
        content = {"markers": [*map(_content, markers)]}
        paths = [f"markers[{i}].pose.position" for i in range(len(markers))]
        super().__init__(topics.MARKERS.type, content, paths, timebase)


def no_markers() -> bytes:
    """Return the message that deletes all markers, for example of an earlier flight."""
    marker = {"header": {"frame_id": topics.INERTIAL_FRAME}, "action": DELETE_ALL}
    return MessageLayout(topics.MARKERS.type, {"markers": [marker]}).data


def _content(marker: Marker) -> Mapping[str, Any]:
    """Return the fields; without lifetime, so that markers stay visible after the flight."""
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
