"""Numbers in lanes as rows of plain numbers, for logs and observations."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .kernels import subroutine
from .lanes import WIDTH, lane_of

Array = NDArray[np.float64]


@subroutine
def spread(values: Array, rows: Array) -> None:
    """Write the first c ``values``, in lanes, into ``rows`` (8, c), one of each flight."""
    for i in range(rows.shape[1]):
        value = values[i]
        for lane in range(WIDTH):
            rows[lane, i] = lane_of(value, lane)
