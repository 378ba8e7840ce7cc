"""Settings with one number for all axes of a robot, or one for each."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from space_robot_msgs_py.errors import InputError

Array = NDArray[np.float64]
FEWEST, LEAST, MOST = Field(min_length=1), Field(ge=0.0, le=1e9), Field(ge=-1e9, le=1e9)
Numbers = Annotated[list[Annotated[float, MOST]], FEWEST]
Sizes = Annotated[list[Annotated[float, LEAST]], FEWEST]
PER_AXIS = "one value for all axes, or one per axis: base x, y, z, joints"


def per_axis(settings: object, name: str, n: int) -> Array:
    """Return (n+3,) values of a setting: of base x, y, z, then of ``n`` joints.

    Raises:
        InputError: it is neither one value nor one an axis.
    """
    numbers = getattr(settings, name)
    if len(numbers) not in (1, n + 3):
        raise InputError(
            f"{name} has {len(numbers)} values, one for all or {n + 3} are allowed: base x, y, z "
            f"and {n} joints"
        )
    values: Array = np.broadcast_to(np.array(numbers, dtype=np.float64), n + 3)
    return values
