"""How derived shapes of a spacecraft look: foil on the base, solar cells on flat bodies and plates.

They fill the boxes that masses and inertias give, to the same size. What a robot's file draws is
not changed.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from space_robot_model.robot import Robot
from space_robot_model.robot.parts import Colour, Plate, Visual
from space_robot_model.robot.shapes import BASE_COLOUR, PANEL_COLOUR

from .mesh import Mesh
from .solids import foil, frame, panel

Array = NDArray[np.float64]

FRAME = 0.022
"""Width of the frame's struts relative to the shortest edge of the box."""
INSET = 0.12
"""Depth of the foil below the frame relative to the struts' width."""
FLAT = 0.2
"""A box is a panel if its shortest edge is below this share of the next one."""
THICKNESS = 0.02
"""Thickness of a plate of the robot's file, m."""
ABSORBED = 0.5
"""Smallest absorbed share of the light of plates that are drawn with solar cells."""
TARGET_COLOUR: Colour = (0.85, 0.38, 0.22, 1.0)
FRAME_COLOUR: Colour = (0.36, 0.38, 0.42, 1.0)
BACK_COLOUR: Colour = (0.70, 0.71, 0.74, 1.0)
CELL_COLOUR: Colour = (0.06, 0.12, 0.34, 1.0)


class ShapePart(NamedTuple):
    """A mesh of one colour, in the axes of its shape."""

    name: str
    mesh: Mesh
    colour: Colour


def parts_of(shape: Visual) -> list[ShapePart]:
    """Return what a box in one of the colours of derived shapes is drawn as; empty: as it is."""
    if shape.shape != "box" or shape.colour is None:
        return []
    size = np.array(shape.size)
    if shape.colour in (BASE_COLOUR, TARGET_COLOUR):
        width = FRAME * float(size.min())
        inner = size - 2.0 * INSET * width
        return [
            ShapePart("foil", foil(inner), shape.colour),
            ShapePart("frame", frame(size, width), FRAME_COLOUR),
        ]
    thinnest, next_one, _ = np.sort(size)
    if shape.colour == PANEL_COLOUR and thinnest < FLAT * next_one:
        back, cells = panel(size)
        return [ShapePart("back", back, BACK_COLOUR), ShapePart("cells", cells, CELL_COLOUR)]
    return []


def panels_of_plates(robot: Robot, boxes: Sequence[Visual]) -> Iterator[Visual]:
    """Yield panels for the plates of a robot's file that its derived boxes do not have.

    A file gives the area of a plate and not its outline: it is drawn as a square. Two plates back
    to back are one panel; plates in a box of their body are its own surface.

    Args:
        robot: without visuals.
        boxes: derived shapes of its bodies.
    """
    drawn: list[Plate] = []
    for plate in robot.plates:
        if any(_is_in(plate, box) for box in boxes if box.body == plate.body):
            continue
        if any(_are_one(plate, other) for other in drawn):
            continue
        drawn.append(plate)
        edge = float(np.sqrt(plate.area))
        absorbed = 1.0 - plate.specular - plate.diffuse
        yield Visual(
            "box",
            (edge, edge, THICKNESS),
            _axes_with_z(plate.normal),
            plate.centre,
            colour=PANEL_COLOUR if absorbed >= ABSORBED - 1e-9 else BACK_COLOUR,
            body=plate.body,
        )


def _is_in(plate: Plate, box: Visual) -> bool:
    place = box.rotation.T @ (plate.centre - box.position)
    return box.shape == "box" and bool((np.abs(place) <= 0.51 * np.array(box.size)).all())


def _are_one(plate: Plate, other: Plate) -> bool:
    return (
        plate.body == other.body
        and bool(plate.normal @ other.normal < -0.999)
        and bool(np.linalg.norm(plate.centre - other.centre) < 2.0 * THICKNESS)
    )


def _axes_with_z(z: Array) -> Array:
    x = np.cross(np.eye(3)[np.argmin(np.abs(z))], z)
    x /= np.linalg.norm(x)
    return np.column_stack((x, np.cross(z, x), z))
