"""Times of a flight, in seconds of simulated time."""

from __future__ import annotations

import math

from .errors import InputError

LATEST_S = 1e9
"""Of a fault, an event or a swap, s of simulated time: its tick then fits in 64 bits."""


def check_time(seconds: float, name: str = "T") -> None:
    """Check that a time can be that of something that happens in a flight."""
    if not 0.0 <= seconds <= LATEST_S:
        raise InputError(f"{name} must be from 0 to {LATEST_S:g} s, got {seconds:g}")


def shortest(seconds: float) -> str:
    """Write a time with as few digits as give the same number again."""
    return repr(seconds).removesuffix(".0")


def tick_from(seconds: float, period: float) -> float:
    """Return the first tick at or after a time; a millionth of a tick counts as rounding.

    Of a time with more ticks than a float can count it is infinite.
    """
    ticks = seconds / period - 1e-6
    return math.ceil(ticks) if math.isfinite(ticks) else ticks
