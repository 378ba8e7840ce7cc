"""A quantity of a flight that is plotted beside its scene."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

AXES = "xyz"


class PlottedQuantity(NamedTuple):
    """Values with a common unit over the ticks of a flight."""

    kind: str
    """One of `PLOT_KINDS`."""
    title: str
    unit: str
    labels: Sequence[str]
    values: Array
    """(N, len(labels))."""
    is_error: bool = False
    are_pulses: bool = False
    """True for duty cycles per tick, from 0 to 1."""
    is_shown: bool = True
    """False if it is only plotted where it is chosen."""
