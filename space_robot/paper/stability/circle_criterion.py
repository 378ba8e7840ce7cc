"""The circle criterion of Appendix B: G must stay within the circle of radius 1 / beta.

The text under (71) says radius beta; (73) is correct. The second case of (77) is misprinted (its
terms have different units); the one here follows from (75) and (76).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]


def transfer_function(k_1: float, k_2: float, omega: Array) -> ComplexArray:
    """(74): ``G(j omega) = 1 / (2 s^2 + K_1 s + K_2)``, at ``omega`` in rad/s; s3/rad."""
    s = 1j * omega
    return np.asarray(1.0 / (2.0 * s**2 + k_1 * s + k_2))


def peak_gain(k_1: float, k_2: float) -> float:
    """(77), corrected: ``max |G(j omega)|``, infinite if G is not asymptotically stable.

    Its square is ``1 / K_2^2`` at omega = 0 if ``K_1^2 >= 4 K_2``, else
    ``16 / (8 K_2 K_1^2 - K_1^4)`` at ``omega^2 = K_2 / 2 - K_1^2 / 8``.
    """
    tolerated = largest_tolerated_beta(k_1, k_2)
    return 1.0 / tolerated if tolerated > 0.0 else np.inf


def largest_tolerated_beta(k_1: float, k_2: float) -> float:
    """Return the largest beta for (73), ``1 / max |G|``, which is K_2 if ``K_1^2 >= 4 K_2``."""
    if k_1 <= 0.0 or k_2 <= 0.0:
        return 0.0
    if k_1**2 >= 4.0 * k_2:
        return k_2
    return k_1 / 4.0 * float(np.sqrt(8.0 * k_2 - k_1**2))
