"""Sine and cosine in plain Python, without compilation.

For compiled code and arrays, `sine` compiles the same function as a ``@kernel``: the same bits.
"""

from __future__ import annotations

import math

import numpy as np

from space_robot_msgs_py.compiled.lanes import any_lane, where

TURNS = 2.0 / math.pi
"""Quarter turns per radian."""
QUARTER = (1.5707963267341256, 6.077100506303966e-11, 2.0222662487111665e-21, 8.4784276603689e-32)
"""Parts of a quarter turn, rad: three of 33 bits, so that products with 20 bits are exact."""
EXACT_LIMIT = 1.6e6
"""Largest angle, rad, with at most 20 bits in its number of quarter turns."""
(S3, S5, S7, S9, S11, S13, S15, S17) = (
    (-1.0) ** k / math.factorial(2 * k + 1) for k in range(1, 9)
)
(C4, C6, C8, C10, C12, C14, C16) = ((-1.0) ** k / math.factorial(2 * k) for k in range(2, 9))


def plain_sin_cos(angle: float) -> tuple[float, float]:
    """Return sine and cosine of ``angle``, rad; NaN if the angle is not finite.

    The error is below 0.8 units in the last place up to 1.6 million radians. Beyond, they are
    exact for an angle that differs from ``angle`` by less than the spacing of floats.
    """
    if any_lane(abs(angle) > EXACT_LIMIT):  # exact, by IEEE 754
        nearest = np.fmod(where(np.isfinite(angle), angle, 0.0), 2.0 * math.pi)
        nearest = where(np.isfinite(angle), nearest, math.nan)
        angle = where(abs(angle) > EXACT_LIMIT, nearest, angle)
    x, rest, quarter = angle, 0.0, 0.0
    is_large = abs(angle) > 0.25 * math.pi
    if any_lane(is_large):
        # subtract quarter turns, part by part, with exact rounding errors (Knuth's two-sum)
        turns = where(is_large, np.floor(angle * TURNS + 0.5), 0.0)
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
    is_odd = (quarter == 1.0) | (quarter == 3.0)
    first, second = where(is_odd, cosine, sine), where(is_odd, sine, cosine)
    is_behind = (quarter == 1.0) | (quarter == 2.0)
    return where(quarter >= 2.0, -first, first), where(is_behind, -second, second)
