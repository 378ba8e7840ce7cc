"""Where the surface of a robot's base is, for what is drawn on it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from space_robot_model.robot import Robot
from space_robot_model.robot.shapes import BASE_COLOUR

from .meshes import shown_shapes
from .stage import shape_corners

Array = NDArray[np.float64]

SMALLEST = 0.1
"""Size of a base without shapes, m."""


def base_size(robot: Robot) -> float:
    """Return the mean edge, m, of the box around the base's largest shape."""
    boxes = _boxes(robot)
    return max((float(np.mean(2.0 * half)) for _, _, half in boxes), default=SMALLEST)


def distance_to_surface(robot: Robot, start: Array, direction: Array) -> float:
    """Return how far it is from a point to where a ray leaves the last box of the base, m.

    Args:
        robot: with the base.
        start: (3,) m, base frame.
        direction: (3,) unit vector, base frame.
    """
    farthest = 0.0
    for rotation, middle, half in _boxes(robot):
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


def nearest_on_surface(robot: Robot, place: Array) -> Array:
    """Return the point of the base's boxes that is nearest to a place, (3,) m, base frame.

    It is the place itself if it is inside of one, or if the base has no shapes.
    """
    nearest, least = place, np.inf
    for rotation, middle, half in _boxes(robot):
        inside = rotation.T @ (place - middle)
        point = middle + rotation @ np.clip(inside, -half, half)
        if (distance := float(np.linalg.norm(point - place))) < least:
            nearest, least = point, distance
    return nearest


def _boxes(robot: Robot) -> list[tuple[Array, Array, Array]]:
    """Return axes, middle and half edges of the boxes around the base's shapes, base frame."""
    drawn = shown_shapes(robot)
    boxes = []
    for shape in drawn.shapes:
        if shape.body or not (robot.visuals or shape.colour == BASE_COLOUR):
            continue  # derived tubes and panels are on the base
        corners = shape_corners(shape, drawn.meshes.get(shape.mesh))
        low, high = corners.min(axis=0), corners.max(axis=0)
        middle = shape.position + shape.rotation @ (0.5 * (low + high))
        boxes.append((shape.rotation, middle, 0.5 * (high - low)))
    return boxes
