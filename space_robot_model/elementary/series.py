"""Sine and cosine in plain Python, without compilation.

In compiled code and for arrays it is ``@kernel`` of `sine`: the same lines, the same bits.
"""

from __future__ import annotations

import math

import numpy as np

TURNS = 2.0 / math.pi
"""Quarter turns a radian."""
QUARTER = (1.5707963267341256, 6.077100506303966e-11, 2.0222662487111665e-21, 8.4784276603689e-32)
"""Parts of a quarter turn, rad: three of 33 bits, so that a multiple by 20 bits is exact."""
EXACT_LIMIT = 1.6e6
"""Up to this angle, rad, a multiple of a quarter turn has no more than 20 bits."""
(S3, S5, S7, S9, S11, S13, S15, S17) = (
    (-1.0) ** k / math.factorial(2 * k + 1) for k in range(1, 9)
)
(C4, C6, C8, C10, C12, C14, C16) = ((-1.0) ** k / math.factorial(2 * k) for k in range(2, 9))


def plain_sin_cos(angle: float) -> tuple[float, float]:
    """Return sine and cosine of ``angle``, rad; NaN of an angle that is not finite.

    Their error is below 0.8 units in the last place up to 1.6 million radians. Beyond, they are
    those of an angle that is nearer to ``angle`` than its neighbours among the floats.
    """
    if abs(angle) > EXACT_LIMIT:
        if not math.isfinite(angle):
            return math.nan, math.nan
        angle = np.fmod(angle, 2.0 * math.pi)  # exact, by IEEE 754
    x, rest, quarter = angle, 0.0, 0.0
    if abs(angle) > 0.25 * math.pi:
        # minus quarter turns, part by part; what rounding takes is exact, too (Knuth's two-sum)
        turns = np.floor(angle * TURNS + 0.5)
        a, b = angle - turns * QUARTER[0], turns * QUARTER[1]
        x = a - b
        other = x - a
        rest = (a - (x - other)) - (b + other)
        a, b = x, turns * QUARTER[2]
        x = a - b
        other = x - a
        rest = rest + ((a - (x - other)) - (b + other)) - turns * QUARTER[3]
        x, rest = x + rest, (x - (x + rest)) + rest
        quarter = turns - 4.0 * np.floor(0.25 * turns)
    z = x * x  # Taylor's series up to an eighth of a turn
    series = S5 + z * (S7 + z * (S9 + z * (S11 + z * (S13 + z * (S15 + z * S17)))))
    sine = x + (z * x * (S3 + z * series) + rest * (1.0 - 0.5 * z))
    half = 0.5 * z
    large = 1.0 - half
    series = z * z * (C4 + z * (C6 + z * (C8 + z * (C10 + z * (C12 + z * (C14 + z * C16))))))
    cosine = large + (((1.0 - large) - half) + (series - x * rest))
    if quarter == 0.0:
        return sine, cosine
    if quarter == 1.0:
        return cosine, -sine
    if quarter == 2.0:
        return -sine, -cosine
    return -cosine, sine
