"""The robot's shapes as markers, with poses in the inertial frame at each tick."""

from __future__ import annotations

import numpy as np

from space_robot_msgs_py.samples import Timebase
from space_robot_msgs_py.wire.viewers import CUBE, CYLINDER, MESH, SPHERE, Marker, MarkersCodec

from ..elementary.matrices import Array
from ..elementary.rotations import quaternion_of_rotation
from .parts import Visual
from .placements import frame_names
from .robot import Robot
from .shapes import LINK_COLOUR, shapes_of
from .urdf_text import mesh_address

Pose = tuple[float, float, float, float, float, float, float]
"""Position x, y, z, m, and quaternion x, y, z, w."""

WHITE = (1.0, 1.0, 1.0, 1.0)
"""Colour that leaves a mesh's own colours unchanged."""
KINDS = {"box": CUBE, "cylinder": CYLINDER, "sphere": SPHERE, "mesh": MESH}


class RobotMarkers:
    """A marker for each shape of `shapes_of`, identified by its body's frame and a number."""

    def __init__(self, robot: Robot, timebase: Timebase, prefix: str = "") -> None:
        """Create the markers.

        Args:
            robot: with its shapes.
            timebase: conversion between ticks and stamps.
            prefix: of the frame names, such as ``sat1/``.
        """
        shapes, names = shapes_of(robot), frame_names(robot).bodies
        bodies = [shape.body for shape in shapes]
        self._codec = MarkersCodec(
            [
                _marker(shape, prefix + names[shape.body], bodies[:i].count(shape.body))
                for i, shape in enumerate(shapes)
            ],
            timebase,
        )
        row = {0: 0} | {joint + 1: i + 1 for i, joint in enumerate(robot.order)}
        self._parents = [row[int(robot.parent[joint])] for joint in robot.order]
        self._shapes = [(row[shape.body], _pose(shape)) for shape in shapes]

    def encode(self, tick: int, poses: Array) -> bytes:
        """Return the message of a tick for poses of `RobotPoses`."""
        return self._codec.encode(tick, self.poses(poses))

    def poses(self, poses: Array) -> Array:
        """Return positions, m, and quaternions x, y, z, w, (K, 7), in the inertial frame.

        Args:
            poses: (M, 7) of the base, then of each body relative to its parent.
        """
        base, *bodies = poses.tolist()
        placed = [base]
        for parent, pose in zip(self._parents, bodies, strict=True):
            placed.append(_on(placed[parent], pose))
        return np.array([_on(placed[row], pose) for row, pose in self._shapes])


def _on(outer: Pose, inner: Pose) -> Pose:
    """Return the composition of two poses: ``inner`` is relative to ``outer``."""
    x, y, z, a, b, c, w = outer
    u, v, s, d, e, f, g = inner
    # p + 2 w (q x r) + 2 q x (q x r)
    k, m, n = 2.0 * (b * s - c * v), 2.0 * (c * u - a * s), 2.0 * (a * v - b * u)
    return (
        x + u + w * k + b * n - c * m,
        y + v + w * m + c * k - a * n,
        z + s + w * n + a * m - b * k,
        w * d + a * g + b * f - c * e,
        w * e + b * g + c * d - a * f,
        w * f + c * g + a * e - b * d,
        w * g - a * d - b * e - c * f,
    )


def _pose(shape: Visual) -> Pose:
    x, y, z = map(float, shape.position)
    w, a, b, c = map(float, quaternion_of_rotation(shape.rotation))
    return x, y, z, a, b, c, w


def _marker(shape: Visual, name: str, number: int) -> Marker:
    colour = shape.colour or LINK_COLOUR
    if shape.shape == "mesh":
        x, y, z = shape.size
        is_plain = shape.colour is None
        return Marker(
            name,
            number,
            MESH,
            (x, y, z),
            WHITE if is_plain else colour,
            mesh_address(shape.mesh),
            has_own_colours=is_plain,
        )
    if shape.shape == "cylinder":
        radius, length = shape.size
        scale = (2.0 * radius, 2.0 * radius, length)
    elif shape.shape == "sphere":
        scale = (2.0 * shape.size[0],) * 3
    else:
        x, y, z = shape.size
        scale = (x, y, z)
    return Marker(name, number, KINDS[shape.shape], scale, colour)
