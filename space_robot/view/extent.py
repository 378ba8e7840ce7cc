"""Where the surfaces of a robot are, for what is drawn on them and what they hide."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from space_robot_model.robot import Robot
from space_robot_model.robot.parts import Visual
from space_robot_model.robot.placements import base_axes, body_frames
from space_robot_model.robot.shapes import BASE_COLOUR

from .shapes import Mesh, shown_shapes

Array = NDArray[np.float64]

SMALLEST = 0.1
"""Size of a base without shapes, m."""
CORNERS = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], dtype=float)


def extent(robot: Robot, position: Array, quaternion: Array, joint_positions: Array) -> Array:
    """Return the corners of a robot's shapes in some poses, (K, 3) m, inertial frame.

    Args:
        robot: with its visuals.
        position: (T, 3) of the base, m.
        quaternion: (T, 4) of the base.
        joint_positions: (T, N) of all joints, rad or m.
    """
    axes = base_axes(quaternion.T)
    frames = {f.body: f for f in body_frames(robot, axes, joint_positions.T)}
    corners = []
    for shape, own in _shape_corners(robot):
        frame = frames[shape.body]
        for corner in shape.position + own @ shape.rotation.T:
            corners.append(position + (frame.origin + frame.on_outer_axes(corner)).T)
    return np.concatenate(corners)


def base_reach(robot: Robot) -> float:
    """Return the largest distance, m, of the base's shapes from its frame's origin; 0 without."""
    corners = [s.position + c @ s.rotation.T for s, c in _shape_corners(robot) if s.body == 0]
    return float(np.linalg.norm(np.concatenate(corners), axis=1).max()) if corners else 0.0


def _shape_corners(robot: Robot) -> list[tuple[Visual, Array]]:
    """Return the drawn shapes with the corners of their bounding boxes, (8, 3) m, on their axes."""
    drawn = shown_shapes(robot)
    return [(shape, _corners(shape, drawn.meshes.get(shape.mesh))) for shape in drawn.shapes]


def _corners(shape: Visual, mesh: Mesh | None) -> Array:
    size = np.array(shape.size)
    middle = np.zeros(3)
    if mesh is not None:
        low, high = mesh.vertices.min(axis=0) * size, mesh.vertices.max(axis=0) * size
        middle, half = 0.5 * (low + high), 0.5 * (high - low)
    elif shape.shape == "box":
        half = 0.5 * size
    elif shape.shape == "cylinder":
        half = np.array([size[0], size[0], 0.5 * size[1]])
    else:
        half = np.full(3, size[0])
    corners: Array = middle + CORNERS * half
    return corners


class BaseSurface:
    """Boxes around the shapes of a robot's base, base frame."""

    def __init__(self, robot: Robot) -> None:
        self._boxes: list[tuple[Array, Array, Array]] = []
        """Axes (3, 3), middle (3,) and half edges (3,), m."""
        for shape, corners in _shape_corners(robot):
            if shape.body or not (robot.visuals or shape.colour == BASE_COLOUR):
                continue  # derived tubes and panels are on the base
            low, high = corners.min(axis=0), corners.max(axis=0)
            middle = shape.position + shape.rotation @ (0.5 * (low + high))
            self._boxes.append((shape.rotation, middle, 0.5 * (high - low)))

    @property
    def size(self) -> float:
        """Mean edge of the largest box, m."""
        return max((float(np.mean(2.0 * half)) for _, _, half in self._boxes), default=SMALLEST)

    def distance(self, start: Array, direction: Array) -> float:
        """Return how far it is from a point to where a ray leaves the last box, m.

        Args:
            start: (3,) m.
            direction: (3,) unit vector.
        """
        farthest = 0.0
        for rotation, middle, half in self._boxes:
            place, along = rotation.T @ (start - middle), rotation.T @ direction
            with np.errstate(divide="ignore", invalid="ignore"):
                sides = np.array([(-half - place) / along, (half - place) / along])
            # along a side the ray is between its planes, or never inside
            still = along == 0.0
            if (np.abs(place) > half)[still].any():
                continue
            entry = float(sides.min(axis=0)[~still].max())
            leaving = float(sides.max(axis=0)[~still].min())
            if leaving >= max(entry, 0.0):
                farthest = max(farthest, leaving)
        return farthest

    def nearest(self, place: Array) -> Array:
        """Return the nearest point to a place, (3,) m; a place in a box, or without one, itself."""
        points = [
            middle + rotation @ np.clip(rotation.T @ (place - middle), -half, half)
            for rotation, middle, half in self._boxes
        ]
        return min(points, key=lambda p: float(np.linalg.norm(p - place)), default=place)
