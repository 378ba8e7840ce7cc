"""No law: every torque comes from elsewhere, as on the bench."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from ..laws import ControlLaw, LawGains, LawMemory, Signals, per_axis

Array = NDArray[np.float64]


class _Gains(LawGains):
    unused: Array = per_axis("nothing")


class NoLaw(ControlLaw):
    """Commands no torque."""

    name: ClassVar[str] = "none"
    gains_type: ClassVar[type[LawGains]] = _Gains
    memory_type: ClassVar[type[LawMemory]] = LawMemory

    def __init__(self, axes: int, period: float) -> None:
        """For m = ``axes`` axes and ticks of ``period`` s."""
        super().__init__({"unused": np.zeros(axes)}, period)

    def force(self, signals: Signals) -> Array:
        """Zero (m,)."""
        force: Array = self.memory.force
        return force
