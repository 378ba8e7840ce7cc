"""What data sheets have in common: flat lists, as ROS parameters are, and reading from a file."""

from __future__ import annotations

from typing import Annotated, ClassVar, TypeVar

import numpy as np
from pydantic import BaseModel, Field

from space_robot_msgs_py.config.files import named_file, node_parameters
from space_robot_msgs_py.config.validation import StrictModel, validate
from space_robot_msgs_py.errors import InputError

from ..elementary.matrices import Array, direction_norm, unit_rows

Sheet = TypeVar("Sheet", bound=BaseModel)

NO_VECTORS = [0.0]
"""Value for an empty list, because ROS has no empty list of numbers."""
FEWEST = Field(min_length=1)
Vectors = Annotated[list[Annotated[float, Field(ge=-1e3, le=1e3)]], FEWEST]
Numbers = Annotated[list[Annotated[float, Field(ge=-1e9, le=1e9)]], FEWEST]
Sizes = Annotated[list[Annotated[float, Field(ge=0.0, le=1e9)]], FEWEST]
Positive = Annotated[list[Annotated[float, Field(gt=0.0, le=1e9)]], FEWEST]
PER_AXIS = "one value for all axes, or one per axis: base x, y, z, joints"


def read_sheet(sheet: type[Sheet], folder: str, name: str) -> Sheet:
    """Return what the flight software assumes of hardware: the sheet in a file of the plant's.

    Parameters of the plant that are not in the sheet (a misaligned wheel, a weak thruster) are
    left out.

    Args:
        sheet: class of the sheet.
        folder: of config/, as "sensors".
        name: of a file in it, or a path.
    """
    path = named_file(folder, name)
    tree = node_parameters(path, "plant")
    own = {key: tree[key] for key in sheet.model_fields if key in tree}
    return validate(sheet, own, str(path))


class MountedSheet(StrictModel):
    """Base class of the sheets of several like actuators on the base.

    Its first field has x, y, z of each of them.
    """

    section: ClassVar[str]
    """Name of the section in the actuators' file; without its last letter the name of one."""

    @property
    def count(self) -> int:
        """Number of actuators."""
        return len(vectors(getattr(self, next(iter(type(self).model_fields)))))

    def values(self, name: str) -> Array:
        """Return the values (count,) of the setting ``name``, one per actuator."""
        if not self.count:
            return np.empty(0)
        what = self.section[:-1].replace("_", " ")
        allowed = f"{self.count} are allowed: one per {what}"
        return _spread(getattr(self, name), f"{self.section}.{name}", self.count, allowed)

    def limits(self, name: str) -> Array:
        """Return the `values` of a limit, with infinity for 0 (no limit)."""
        values = self.values(name)
        return np.where(values > 0.0, values, np.inf)


def per_axis(sheet: object, name: str, n: int) -> Array:
    """Return the values (n+3,) of a setting: of base x, y, z, then of ``n`` joints."""
    allowed = f"{n + 3} are allowed: base x, y, z and {n} joints"
    return _spread(getattr(sheet, name), name, n + 3, allowed)


def _spread(numbers: list[float], key: str, count: int, allowed: str) -> Array:
    if len(numbers) not in (1, count):
        raise InputError(f"{key} has {len(numbers)} values, one for all or {allowed}")
    values: Array = np.broadcast_to(np.array(numbers, dtype=np.float64), count)
    return values


def check_vectors(flat: list[float], most: int) -> list[float]:
    """Return ``flat`` if it has x, y, z of at most ``most`` vectors, or none (``[0.0]``).

    Raises:
        ValueError: another number of values.
    """
    if flat != NO_VECTORS and (len(flat) % 3 or len(flat) > 3 * most):
        raise ValueError(
            f"x, y, z of at most {most} vectors were expected, or [0.0] for none: "
            f"{len(flat)} numbers"
        )
    return flat


def check_directions(flat: list[float], most: int) -> list[float]:
    """Return ``flat`` if all its vectors can be scaled to norm 1, see `check_vectors`."""
    for i, vector in enumerate(vectors(check_vectors(flat, most)), 1):
        direction_norm(vector, f"vector {i}")
    return flat


def vectors(flat: list[float]) -> Array:
    """Return the vectors (k, 3) of a flat list."""
    if flat == NO_VECTORS:
        return np.empty((0, 3))
    return np.array(flat, dtype=np.float64).reshape(-1, 3)


def directions(flat: list[float]) -> Array:
    """Return the vectors (k, 3) of a flat list, normalised."""
    return unit_rows(vectors(flat))
