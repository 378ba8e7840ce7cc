"""Where the surface of a robot's base is: for what is drawn on it, and what it hides."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from space_robot_model.robot import Robot
from space_robot_model.robot.placements import base_axes, body_frames
from space_robot_model.robot.shapes import BASE_COLOUR

from .horizon import Horizon
from .meshes import shown_shapes
from .stage import SIDES, camera_direction, shape_corners

Array = NDArray[np.float64]
Box = tuple[Array, Array, Array]
"""Axes (3, 3), middle (3,) and half edges (3,) of a box, m, base frame."""

SMALLEST = 0.1
"""Size of a base without shapes, m."""
MOST_HIDDEN = 0.25
"""Share of the arms that the base may hide from the initial camera."""


def clearest_side(
    flights: Sequence[tuple[Robot, Array, Array]], horizon: Horizon | None = None
) -> Array:
    """Return the first of `SIDES` where the base hides at most `MOST_HIDDEN` of the arms.

    Or, if there is none, the one where it hides least.

    Args:
        flights: robots with the attitudes (T, 4) of their bases and the positions (T, N) of all
            their joints, rad or m.
        horizon: of a scene in orbit.
    """
    shares = []
    for side in SIDES:
        direction = camera_direction(side, horizon)
        shares.append(float(np.mean([_hidden_share(*flight, direction) for flight in flights])))
        if shares[-1] <= MOST_HIDDEN:
            break
    return np.asarray(SIDES[int(np.argmin(shares))])


def _hidden_share(
    robot: Robot, quaternion: Array, joint_positions: Array, direction: Array
) -> float:
    """Return the share of actuated joints and tools that are behind the base.

    Args:
        robot: with the base.
        quaternion: (T, 4) of the base.
        joint_positions: (T, N) of all joints, rad or m.
        direction: (3,) unit vector to a camera far away, inertial axes.
    """
    boxes, still = _boxes(robot), np.eye(3)[:, :, np.newaxis]
    frames = {f.body: f for f in body_frames(robot, still, joint_positions.T)}
    points = [frames[joint + 1].origin for joint in range(robot.n)]
    points += [
        frames[tool.body].origin + frames[tool.body].on_outer_axes(tool.position)
        for tool in robot.tools
    ]
    hidden = [
        _distance_to_surface(boxes, point[:, k], axes @ direction) > 1e-3
        for k, axes in enumerate(np.moveaxis(base_axes(quaternion.T), 2, 0))
        for point in (np.broadcast_to(p, (3, len(quaternion))) for p in points)
    ]
    return float(np.mean(hidden))


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
    return _distance_to_surface(_boxes(robot), start, direction)


def _distance_to_surface(boxes: Sequence[Box], start: Array, direction: Array) -> float:
    farthest = 0.0
    for rotation, middle, half in boxes:
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


def _boxes(robot: Robot) -> list[Box]:
    """Return the boxes around the base's shapes."""
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
