"""Axis labels with a scale: no number is too long to read and no exponent floats beside an axis."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

PLAIN = (0.1, 1000.0)
"""Sizes that read well without a power of ten."""
NOTHING = 1e-30
"""Below it all is zero."""

_SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


class Quantity(NamedTuple):
    """What an axis shows, and the power of ten that its numbers leave out."""

    name: str
    unit: str = ""
    """Empty if it has none."""
    exponent: int = 0

    @classmethod
    def of(cls, values: Array, name: str, unit: str = "") -> Quantity:
        """A quantity with the exponent, a multiple of three, that suits its values."""
        largest = float(np.max(np.abs(values), initial=0.0, where=np.isfinite(values)))
        if PLAIN[0] <= largest < PLAIN[1] or largest < NOTHING:
            return cls(name, unit)
        return cls(name, unit, 3 * math.floor(math.log10(largest) / 3.0))

    def scaled(self, values: Array) -> Array:
        """The numbers to draw; NaN for what is not finite."""
        finite: Array = np.where(np.isfinite(values), values, np.nan)
        return finite / 10.0**self.exponent

    @property
    def label(self) -> str:
        """As in ``joint error (10⁻⁶ rad)``."""
        parts = [power_of_ten(self.exponent) if self.exponent else "", self.unit]
        inside = " ".join(filter(None, parts))
        return f"{self.name} ({inside})" if inside else self.name


def power_of_ten(exponent: int) -> str:
    """As in ``10⁻⁹``."""
    return "10" + str(exponent).translate(_SUPERSCRIPTS)
