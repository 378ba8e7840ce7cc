"""Plates of a robot for drag and sunlight: those of its file, or made from its shapes."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..elementary.matrices import product
from .parts import Plate, Visual
from .robot import Robot
from .shapes import drawn_shapes

Array = NDArray[np.float64]

SIDES = 6
"""Plates around a cylinder."""
COSINES = (1.0, 0.5, -0.5, -1.0, -0.5, 0.5)
SINES = (0.0, np.sqrt(0.75), np.sqrt(0.75), 0.0, -np.sqrt(0.75), -np.sqrt(0.75))
"""Of their directions."""


def plates_of(robot: Robot) -> tuple[Plate, ...]:
    """Return the plates of the robot's file, or if it has none those of its shapes.

    A box has six, a cylinder six around it and two ends, a sphere is a box; together they have the
    surface of the shape. Meshes are replaced by the shapes that kinematics and masses give
    (`space_robot_model.robot.shapes`).
    """
    if robot.plates:
        return robot.plates
    shapes = robot.visuals
    if not shapes or any(shape.shape == "mesh" for shape in shapes):
        shapes = tuple(drawn_shapes(robot))
    return tuple(plate for shape in shapes for plate in _plates(shape))


def _plates(shape: Visual) -> Iterator[Plate]:
    """Yield the plates of a shape that is not a mesh."""
    if shape.shape == "cylinder":
        plates = _of_cylinder(*shape.size)
    elif shape.shape == "sphere":
        edge = np.sqrt(2.0 * np.pi / 3.0) * shape.size[0]  # 6 edge^2 = 4 pi radius^2
        plates = _of_box((edge, edge, edge))
    else:
        plates = _of_box(shape.size)
    for plate in plates:
        yield replace(
            plate,
            normal=product(shape.rotation, plate.normal),
            centre=shape.position + product(shape.rotation, plate.centre),
            body=shape.body,
        )


def _of_box(edges: tuple[float, ...]) -> Iterator[Plate]:
    for axis, edge in enumerate(edges):
        area = edges[axis - 1] * edges[axis - 2]
        for side in (1.0, -1.0):
            normal = side * np.eye(3)[axis]
            yield Plate(area, normal, 0.5 * edge * normal)


def _of_cylinder(radius: float, length: float) -> Iterator[Plate]:
    for side in (1.0, -1.0):
        end = np.array([0.0, 0.0, side])
        yield Plate(np.pi * radius**2, end, 0.5 * length * end)
    for cosine, sine in zip(COSINES, SINES, strict=True):
        normal = np.array([cosine, sine, 0.0])
        yield Plate(2.0 * np.pi * radius * length / SIDES, normal, radius * normal)
