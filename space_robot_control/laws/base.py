"""What every control law is: gains, a memory, and one equation."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(slots=True)
class Signals:
    """What a law sees at a tick, in the coordinates ``rho = [eps, theta]``, m = n+3 axes."""

    error: Array
    """(m,) ``e = rho_d - rho``."""
    error_rate: Array
    """(m,) ``edot``."""
    acceleration_desired: Array
    """(m,) ``rhodd_d``."""
    n_hat: Array
    """(m,) time-delay estimate N_hat of (35), (36); zero for laws without ``h_bar``."""
    inertia: Array
    """(m, m) nominal ``H_S``; filled only for laws with ``uses_model``."""
    bias: Array
    """(m,) nominal ``c_S``; filled only for laws with ``uses_model``."""


class ControlLaw(ABC):
    """One control law on m = n+3 axes at a fixed period.

    A new law is a subclass with a ``name``, its gains, and `force`. A law with a gain ``h_bar``
    is given the time-delay estimate for it; one with ``uses_model`` the nominal model (never the
    payload, friction or disturbance).
    """

    name: ClassVar[str]
    gain_descriptions: ClassVar[dict[str, str]]
    """What each gain is, by name; one value an axis."""
    uses_model: ClassVar[bool] = False

    def __init__(self, gains: Mapping[str, Array], period: float) -> None:
        """``gains``: an (m,) array for each of ``gain_descriptions``; ``period`` in s."""
        self.gains = {name: np.ascontiguousarray(gains[name]) for name in self.gain_descriptions}
        self.period = period
        axes = len(next(iter(self.gains.values())))
        self.sliding_surface = np.zeros(axes)
        """s of the last tick; stays zero for a law without one."""
        self.pseudo_acceleration = np.zeros(axes)
        """u of the last tick, rad/s2 (eps: 1/s2)."""
        self._force = np.zeros(axes)
        self.reset()

    @classmethod
    def uses_time_delay_estimate(cls) -> bool:
        """Whether the law adds N_hat."""
        return "h_bar" in cls.gain_descriptions

    def reset(self) -> None:  # noqa: B027  (a law without memory has nothing to do)
        """Forget the past (integrals, last errors): called when the law is switched on."""

    @abstractmethod
    def force(self, signals: Signals) -> Array:
        """The generalised force F_S (m,), valid until the next call."""
