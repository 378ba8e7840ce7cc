"""Messages for viewers and other nodes: frames, shapes, the base, the robot's URDF."""

from __future__ import annotations

import struct
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .. import topics
from ..samples import Timebase
from ..topics import Topic
from .cdr import ENCAPSULATION, MessageLayout
from .messages import Numbers, WritableMessage

Array = NDArray[np.float64]

POSE = 7
"""Numbers of a pose: translation, m, and quaternion x, y, z, w, relative to the parent frame."""
CUBE, SPHERE, CYLINDER, MESH = 1, 2, 3, 10
"""Marker types of visualization_msgs/Marker."""
DELETE_ALL = 3
"""Action of visualization_msgs/Marker that deletes all; adding is 0."""
UNKNOWN = [-1.0, *[0.0] * 8]
"""Covariance of a quantity that a sensor_msgs/Imu lacks."""
_CARRIER = struct.Struct("<4sIII")
"""Encapsulation header, no dimensions, no offset, length of the data."""


class NumbersCodec:
    """Writes numbers and stamps into a message that is otherwise constant."""

    def __init__(
        self,
        type_name: str,
        content: Mapping[str, Any],
        runs: Sequence[tuple[str, int]],
        timebase: Timebase,
    ) -> None:
        """Compute the layout of the message with the constant fields ``content``.

        ``runs``: path of the first of some consecutive numbers, such as ``pose.position``, and how
        many they are.
        """
        self._timebase, layout = timebase, MessageLayout(type_name, content)
        offsets = [layout.slots[path].offset + 8 * k for path, count in runs for k in range(count)]
        numbers = Numbers(layout, np.array(offsets, np.uint64))
        self._message = WritableMessage(numbers, layout.stamps)

    def encode(self, tick: int, numbers: Array) -> bytes:
        """Return the message of a tick, from its numbers in the order of the runs."""
        return self._message.serialized(self._timebase.stamp_ns(tick), numbers.reshape(-1))


class FramePair(NamedTuple):
    """Names of a frame and of its parent."""

    parent: str
    child: str


class TransformsCodec(NumbersCodec):
    """Encodes poses of a constant set of frames relative to their parents as tf2_msgs/TFMessage."""

    def __init__(self, frames: Sequence[FramePair], timebase: Timebase) -> None:
        """Create the codec for ``frames``, in the order of the poses (M, 7)."""
        content = [{"header": {"frame_id": f.parent}, "child_frame_id": f.child} for f in frames]
        runs = [(f"transforms[{i}].transform.translation", POSE) for i in range(len(frames))]
        super().__init__(topics.TF.type, {"transforms": content}, runs, timebase)


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


class MarkersCodec(NumbersCodec):
    """Encodes poses of a constant set of markers in the inertial frame as a MarkerArray."""

    def __init__(self, markers: Sequence[Marker], timebase: Timebase) -> None:
        """Create the codec for ``markers``, in the order of the poses (M, 7)."""
        content = {"markers": [*map(_marker_content, markers)]}
        runs = [(f"markers[{i}].pose.position", POSE) for i in range(len(markers))]
        super().__init__(topics.MARKERS.type, content, runs, timebase)


def _marker_content(marker: Marker) -> Mapping[str, Any]:
    # No lifetime: markers stay visible after the flight.
    return {
        "header": {"frame_id": topics.INERTIAL_FRAME},
        "ns": marker.name,
        "id": marker.number,
        "type": marker.kind,
        "scale": dict(zip("xyz", marker.scale, strict=True)),
        "color": dict(zip("rgba", marker.colour, strict=True)),
        "mesh_resource": marker.mesh,
        "mesh_use_embedded_materials": marker.has_own_colours,
    }


def no_markers() -> bytes:
    """Return the message that deletes all markers, for example of an earlier flight."""
    marker = {"header": {"frame_id": topics.INERTIAL_FRAME}, "action": DELETE_ALL}
    return MessageLayout(topics.MARKERS.type, {"markers": [marker]}).data


class BaseMessages:
    """Encodes the messages of `topics.STANDARD`: the base in messages of one frame each."""

    def __init__(self, timebase: Timebase, prefix: str = "") -> None:
        """``prefix``: of the base's frame, as in /tf (``sat1/``)."""
        frame = f"{prefix}{topics.BASE_FRAME}"
        base = {"header": {"frame_id": frame}}
        inertial = {"header": {"frame_id": topics.INERTIAL_FRAME}, "child_frame_id": frame}
        unknown = {"linear_acceleration_covariance": UNKNOWN}
        pose, twist = ("pose.pose.position", POSE), ("twist.twist.linear", 6)
        motion = [("orientation", 4), ("angular_velocity", 3)]
        self._odometry = NumbersCodec(topics.ODOMETRY.type, inertial, [pose, twist], timebase)
        self._imu = NumbersCodec(topics.IMU.type, base | unknown, motion, timebase)
        self._wrench = NumbersCodec(topics.WRENCH.type, base, [("wrench.force", 6)], timebase)

    def encode(
        self, tick: int, pose: Array, twist: Array, wrench: Array
    ) -> Iterator[tuple[Topic, bytes]]:
        """Yield the messages of a tick.

        Args:
            tick: of their stamps.
            pose: (7,) position, m, and quaternion x, y, z, w of the base in the inertial frame.
            twist: (6,) linear (m/s), then angular (rad/s) velocity on base axes.
            wrench: (6,) force (N), then torque (N m) on base axes, about the base's origin.
        """
        yield topics.ODOMETRY, self._odometry.encode(tick, np.concatenate((pose, twist)))
        yield topics.IMU, self._imu.encode(tick, np.concatenate((pose[3:], twist[3:])))
        yield topics.WRENCH, self._wrench.encode(tick, wrench)


def robot_description(text: str) -> bytes:
    """Return the std_msgs/String of a URDF, padded with newlines to a multiple of the word size.

    Otherwise the middleware would append zeros, and received bytes would differ.
    """
    missing = -(len(text.encode()) + 1) % 4
    return MessageLayout(topics.ROBOT_DESCRIPTION.type, {"data": text + missing * "\n"}).data


def wrap(data: bytes) -> bytes:
    """Return the carrier of a serialized message: a std_msgs/UInt8MultiArray with its bytes.

    Publishers and subscribers need the compiled support of a type, even for serialized bytes. That
    of tf2_msgs is not on any Python index, so the recorder receives /tf in this way.
    """
    return _CARRIER.pack(ENCAPSULATION, 0, 0, len(data)) + data


def unwrap(data: bytes) -> bytes:
    """Return the serialized message in a carrier from `wrap`."""
    return data[_CARRIER.size :]
