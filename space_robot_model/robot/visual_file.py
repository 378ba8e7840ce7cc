"""Schema of the visuals in a robot's YAML file."""

from __future__ import annotations

from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator
from typing_extensions import Self

from space_robot_msgs_py.config.validation import StrictModel

from ..elementary.rotations import rotation_of_rpy
from .link_file import BASE, OriginFile
from .tree import Visual

Array = NDArray[np.float64]

SIZES = {"box": 3, "cylinder": 2, "sphere": 1, "mesh": 3}
"""Count of the sizes of each shape."""


class ShapeFile(StrictModel):
    """A drawn shape without its place: its sizes in m (of a mesh its scale), and its colour.

    Edges x, y, z of a box; radius and length of a cylinder, which lies along z; radius of a sphere.
    """

    shape: Literal["box", "cylinder", "sphere", "mesh"]
    size: list[float]
    mesh: str = ""
    """Absolute path or URL of a mesh's file."""
    colour: Annotated[list[float], Field(min_length=4, max_length=4)] | None = None
    """Red, green, blue, alpha, from 0 to 1."""

    @model_validator(mode="after")
    def _is_whole(self) -> Self:
        is_mesh = self.shape == "mesh"
        if len(self.size) != SIZES[self.shape] or not (is_mesh or min(self.size) > 0.0):
            what = "numbers" if is_mesh else "numbers above 0"
            raise ValueError(f"size of a {self.shape}: {SIZES[self.shape]} {what} were expected")
        is_place = self.mesh.startswith("/") or "://" in self.mesh
        if is_mesh != bool(self.mesh) or is_mesh != is_place:
            raise ValueError("mesh: an absolute path or a URL was expected, of a mesh only")
        return self

    def at(self, rotation: Array, position: Array) -> Visual:
        """Return the shape with its axes (3, 3) and position (3,), m, on a body, for the tree."""
        colour = None
        if self.colour:
            red, green, blue, alpha = self.colour
            colour = red, green, blue, alpha
        return Visual(self.shape, tuple(self.size), rotation, position, self.mesh, colour)


def shape_of(visual: Visual) -> dict[str, Any]:
    """Return the mapping of a `ShapeFile` for a visual."""
    return {
        "shape": visual.shape,
        "size": [float(size) for size in visual.size],
        **({"mesh": visual.mesh} if visual.mesh else {}),
        **({"colour": [float(part) for part in visual.colour]} if visual.colour else {}),
    }


class VisualFile(ShapeFile):
    """One entry of ``robot.visuals``: a drawn shape in the frame of a link."""

    link: Annotated[str, Field(min_length=1)] = BASE
    origin: OriginFile = OriginFile()

    @property
    def visual(self) -> Visual:
        """Return the same for the tree."""
        rotation = rotation_of_rpy(np.radians(self.origin.rpy_deg))
        return self.at(rotation, np.array(self.origin.xyz))
