"""What a gain set is tuned for: requirements, robot, mission, noise."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from .demand import ForceDemand
from .noise import Noise
from .postures import Posture
from .spectrum import eigenvalues

Array = NDArray[np.float64]

CONSTANT, NOMINAL, AUTO = "constant", "nominal", "auto"
"""Inertia of the laws with time-delay estimation: see `TuningOptions`."""
SEPARATION = 4.0
"""Ratio of the estimate's pole to the poles of the loop; see step 4 of `method`."""
MOST_BY_MODEL = 0.25
"""Largest bandwidth times period times eigenvalue of ``H_S^-1`` with the model's inertia, rad."""
MOST_PER_TICK = 0.05
"""Largest bandwidth times period, rad: K_D then removes a tenth of a rate error per tick."""


@dataclass(frozen=True)
class TuningOptions:
    """Requirements on a gain set."""

    margin: float
    """Share by which the reported torque may exceed the commanded one."""
    mass_uncertainty: float
    """Share by which every mass and inertia may be wrong."""
    bandwidth: float | None = None
    """Bandwidth of all laws, rad/s; None: the largest that lag and ripple allow each law."""
    ripple: float = 0.1
    """Allowed RMS force by noise, as a share of the largest force of an axis."""
    h_bar: str = CONSTANT
    """Inertia of the laws with time-delay estimation: `CONSTANT`, `NOMINAL`, or `AUTO`, the nominal
    one where no diagonal matrix will do."""
    noise_ripple: float | None = None
    """If set, every law has this ripple in place of at most ``ripple``, see `equal_ripple`."""

    @property
    def allowed_ripple(self) -> float:
        """``noise_ripple``, else ``ripple``."""
        return self.noise_ripple or self.ripple


@dataclass(frozen=True)
class TuningTask:
    """Inputs of the method."""

    inertia: Array
    """(L, m, m) H_S in all configurations, with all payloads; L is a multiple of K."""
    postures: Sequence[Posture]
    """(K,) of the nominal robot in the same configurations."""
    asked: ForceDemand
    """Forces of the mission, on all axes."""
    wishes: TuningOptions
    period: float
    """s."""
    noise: Noise | None
    """Of sensors and navigation, with its lag; None: no noise, no lag."""
    has_gears: bool = False
    """True if some configurations are those of `flexible.fast_inertia`."""

    @cached_property
    def shape(self) -> Array:
        """(m,) d of step 1, kg m2."""
        return axis_inertia(self.inertia)

    @cached_property
    def nominal(self) -> Array:
        """(L, m, m) H_S of the nominal robot, kg m2."""
        own = np.array([posture.inertia for posture in self.postures])
        return np.tile(own, (len(self.inertia) // len(own), 1, 1))

    @cached_property
    def most_per_tick(self) -> float:
        """Largest bandwidth times period of the laws with a model, rad.

        The inertia of a motor before its gear, or of joints beside free hinges, may be much smaller
        than that of the model: K_D then removes more of a rate error per tick.
        """
        largest = float(eigenvalues(self.inertia, self.nominal).max())
        return min(MOST_PER_TICK, MOST_BY_MODEL / largest)

    @property
    def allowed(self) -> Array:
        """(m,) RMS force that noise may cause, N m."""
        return self.wishes.allowed_ripple * self.asked.peak

    @property
    def lag(self) -> float:
        """Of the navigation, s."""
        return self.noise.lag if self.noise else 0.0


@dataclass(frozen=True)
class TunedLaw:
    """Gains of one law."""

    gains: Mapping[str, Array]
    """By name, (m,) each."""
    bandwidth: float
    """W, rad/s."""
    remarks: Sequence[str] = ()
    """On these gains, for their file."""


def axis_inertia(inertia: Array) -> Array:
    """Return d_i (m,), the smallest ``1 / (H_S^-1)_ii`` of ``inertia`` (K, m, m), kg m2."""
    free = 1.0 / np.diagonal(np.linalg.inv(inertia), axis1=1, axis2=2)
    smallest: Array = free.min(axis=0)
    return smallest


def critical(bandwidth: float, axes: int) -> dict[str, Array]:
    """Return K_P and K_D (m,) with both poles of each axis at ``bandwidth``, rad/s."""
    return {"k_p": np.full(axes, bandwidth**2), "k_d": np.full(axes, 2.0 * bandwidth)}
