"""Schema of the plates in a robot's YAML file."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from pydantic import Field, model_validator
from typing_extensions import Self

from space_robot_msgs_py.config.validation import StrictModel

from ..elementary.matrices import norm
from .link_file import BASE, Direction, Vector
from .tree import Plate

MOST_PLATES = 128
"""Maximum number of plates of a robot."""


class PlateFile(StrictModel):
    """One entry of ``robot.plates``: a flat surface on a link, for drag and sunlight.

    Area in m2, centre in m, both vectors in the link's frame; a panel has one plate a side.
    """

    link: Annotated[str, Field(min_length=1)] = BASE
    area: Annotated[float, Field(gt=0.0, le=1e6)]
    normal: Direction
    centre: Vector = Field([0.0, 0.0, 0.0])
    drag_coefficient: Annotated[float, Field(ge=0.0, le=10.0)] = 2.2
    specular: Annotated[float, Field(ge=0.0, le=1.0)] = 0.2
    diffuse: Annotated[float, Field(ge=0.0, le=1.0)] = 0.3

    @model_validator(mode="after")
    def _reflects_what_comes(self) -> Self:
        if self.specular + self.diffuse > 1.0:
            raise ValueError(
                "specular and diffuse are shares of the same light: their sum must be at most 1, "
                f"it is {self.specular + self.diffuse:g}"
            )
        return self

    @property
    def plate(self) -> Plate:
        """Return the same for the tree."""
        return Plate(
            self.area,
            np.array(self.normal) / norm(self.normal),
            np.array(self.centre),
            self.drag_coefficient,
            self.specular,
            self.diffuse,
        )


Plates = Annotated[list[PlateFile], Field(max_length=MOST_PLATES)]
