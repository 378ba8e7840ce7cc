"""The robot's shapes as markers: where each of them is in the inertial frame, tick by tick."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from space_robot_msgs_py.samples import RobotState, Timebase
from space_robot_msgs_py.wire.markers import (
    CUBE,
    CYLINDER,
    MESH,
    POSE,
    SPHERE,
    Marker,
    MarkersCodec,
)

from .base_axes import base_axes
from .frame_names import frame_names
from .frames import body_frames
from .robot import Robot
from .shapes import LINK_COLOUR, shapes_of
from .tree import Visual
from .urdf_text import mesh_address

Array = NDArray[np.float64]

WHITE = (1.0, 1.0, 1.0, 1.0)
"""With this a mesh shows its own colours as they are."""
KINDS = {"box": CUBE, "cylinder": CYLINDER, "sphere": SPHERE, "mesh": MESH}


class RobotMarkers:
    """A marker for each shape of `shapes_of`, named after its body's frame and numbered on it."""

    def __init__(self, robot: Robot, timebase: Timebase, prefix: str = "") -> None:
        """``prefix``: before the names, as ``sat1/``."""
        self._robot, shapes = robot, shapes_of(robot)
        names = [prefix + name for name in frame_names(robot).bodies]
        self._bodies = np.array([shape.body for shape in shapes])
        self._turns = np.array([shape.rotation for shape in shapes])
        self._places = np.array([shape.position for shape in shapes])[..., np.newaxis]
        numbers = [int(np.sum(self._bodies[:i] == body)) for i, body in enumerate(self._bodies)]
        markers = [
            _marker(shape, names[shape.body], number)
            for shape, number in zip(shapes, numbers, strict=True)
        ]
        self._codec = MarkersCodec(markers, timebase)

    def encode(self, state: RobotState) -> bytes:
        """Return the message of a state."""
        return self._codec.encode(state.tick, self.poses(state))

    def poses(self, state: RobotState) -> Array:
        """Return (M, 7) position, m, and orientation x, y, z, w of all in the inertial frame."""
        robot = self._robot
        x, y, z = base_axes(state.quaternion[:, np.newaxis])
        joints = np.append(state.joint_positions, state.passive_positions)[: robot.joint_count]
        axes, origins = np.empty((2, robot.joint_count + 1, 3, 3))
        for frame in body_frames(robot, (x, y, z), joints[:, np.newaxis]):
            axes[frame.body] = np.hstack((frame.x, frame.y, frame.z))
            origins[frame.body] = frame.origin
        axes, origins = axes[self._bodies], origins[self._bodies, :, :1]
        poses = np.empty((len(axes), POSE))
        poses[:, :3] = state.base_position + (origins + axes @ self._places)[..., 0]
        poses[:, 3:] = Rotation.from_matrix(axes @ self._turns).as_quat()
        return poses


def _marker(shape: Visual, name: str, number: int) -> Marker:
    colour = shape.colour or LINK_COLOUR
    if shape.shape == "mesh":
        x, y, z = shape.size
        is_plain = shape.colour is None
        return Marker(
            name, number, MESH, (x, y, z), WHITE if is_plain else colour, mesh_address(shape.mesh),
            has_own_colours=is_plain,
        )  # fmt: skip
    if shape.shape == "cylinder":
        radius, length = shape.size
        scale = (2.0 * radius, 2.0 * radius, length)
    elif shape.shape == "sphere":
        scale = (2.0 * shape.size[0],) * 3
    else:
        x, y, z = shape.size
        scale = (x, y, z)
    return Marker(name, number, KINDS[shape.shape], scale, colour)
