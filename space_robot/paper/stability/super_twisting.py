"""Conditions on the super-twisting gains of a law, for each axis.

All are sufficient conditions: if one fails, neither stability nor instability is proven.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from .check import Check, checks
from .circle_criterion import largest_tolerated_beta, peak_gain
from .lyapunov import Certificate, certify, paper_m, residual
from .reaching import Reaching

Array = NDArray[np.float64]


@dataclass(frozen=True)
class SuperTwisting:
    """Conditions of Sections III-B, III-C and Appendix B for a law with K_1 and K_2, per axis."""

    k_1: Array
    k_2: Array
    beta: Array
    """(m,) measured bound of |epsdot|."""
    initial_error: float
    reaching: Reaching
    reaching_beta: Array
    """(m,) bound of |epsdot| in the flight from the initial error."""

    @property
    def gains(self) -> list[tuple[float, float]]:
        """K_1 and K_2 of each axis."""
        return list(zip(self.k_1.tolist(), self.k_2.tolist(), strict=True))

    @property
    def k_2_above_beta(self) -> tuple[Check, ...]:
        """``beta < K_2``."""
        return checks(self.beta, self.k_2)

    @property
    def k_1_squared_above_4_k_2(self) -> tuple[Check, ...]:
        """``4 K_2 < K_1^2``."""
        return checks(4.0 * self.k_2, self.k_1**2)

    @property
    def circle_criterion(self) -> tuple[Check, ...]:
        """(73): ``max |G(j omega)| < 1 / beta``."""
        limits = np.divide(1.0, self.beta, out=np.full_like(self.beta, np.inf), where=self.beta > 0)
        return checks((peak_gain(*gains) for gains in self.gains), limits)

    @property
    def tolerated_beta(self) -> Array:
        """(m,) largest beta for which (73) and (51) hold."""
        return np.array([largest_tolerated_beta(*gains) for gains in self.gains])

    @property
    def paper_m_residual(self) -> tuple[Check, ...]:
        """(51) with M of (48), gamma = 0 and beta = 0, the weakest condition: below 0."""
        values = [residual(paper_m(*gains), *gains, beta=0.0, gamma=0.0) for gains in self.gains]
        return checks(values, np.zeros(len(values)))

    @property
    def paper_m_eigenvalues(self) -> Array:
        """(m, 2) eigenvalues of the M of (48)."""
        return np.array([np.linalg.eigvalsh(paper_m(*gains)) for gains in self.gains])

    @cached_property
    def measured_certificates(self) -> tuple[Certificate | None, ...]:
        """Solutions of (51) for the measured beta; None where it is too large."""
        return self._certified(self.beta)

    @cached_property
    def assumed_certificates(self) -> tuple[Certificate | None, ...]:
        """Solutions of (51) for half of the tolerated beta: K_2 / 2 if ``K_1^2 >= 4 K_2``."""
        return self._certified(0.5 * self.tolerated_beta)

    def _certified(self, beta: Array) -> tuple[Certificate | None, ...]:
        return tuple(certify(*gains, b) for gains, b in zip(self.gains, beta.tolist(), strict=True))

    @cached_property
    def certificates(self) -> tuple[Certificate | None, ...]:
        """Solutions for the measured beta, or for the assumed one where there is none."""
        pairs = zip(self.measured_certificates, self.assumed_certificates, strict=True)
        return tuple(measured or assumed for measured, assumed in pairs)

    @property
    def initial_values(self) -> Array:
        """(m,) V(0) of the flight from the initial error; NaN without a solution M."""
        pairs = zip(self.certificates, self.reaching.eta[0], strict=True)
        return np.array([float(c.value(eta)) if c else np.nan for c, eta in pairs])

    @property
    def reaching_time(self) -> tuple[Check, ...]:
        """(56): the measured reaching time is below its bound; unknown if the flight is too short.

        The bound assumes ``|epsdot| <= beta`` and is not applicable where the flight exceeds it.
        """
        pairs = zip(self.certificates, self.initial_values, strict=True)
        bounds = [c.reaching_time(value) if c else np.nan for c, value in pairs]
        flown = self.reaching.time[-1]
        missed = np.isnan(self.reaching.measured) & (flown >= np.array(bounds))
        measured = np.where(missed, np.inf, self.reaching.measured)
        kept = [
            c is not None and bool(beta <= c.beta)
            for c, beta in zip(self.certificates, self.reaching_beta, strict=True)
        ]
        return tuple(
            check._replace(applies=applies)
            for check, applies in zip(checks(measured, bounds), kept, strict=True)
        )
