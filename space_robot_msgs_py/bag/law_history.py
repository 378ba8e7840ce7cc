"""History of the laws of a flight, and their changes."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np

from ..samples import LawInForce, Timebase
from .flight_log import FlightLog

MOST_LISTED = 3
"""Largest number of changes listed one by one in a short text."""


class LawChange(NamedTuple):
    """Change to another law, or to other gains of the same law."""

    before: LawInForce | None
    """None: the controller begins."""
    law: LawInForce

    def __str__(self) -> str:
        before, law = self
        if before is None:
            return law.name
        if before.name != law.name:
            return f"{before.name} -> {law.name}"
        changed = [gain for gain in law.gains if before.gains.get(gain) != law.gains[gain]]
        return f"{law.name}: other {', '.join(changed)}"


def same(one: LawInForce, other: LawInForce) -> bool:
    """Return True if two laws are the same with the same gains, to the last bit."""
    # compared as integers, NaN is itself, and -0.0 is not 0.0
    return (
        one.name == other.name
        and one.gains.keys() == other.gains.keys()
        and all(
            np.array_equal(
                np.array(values).view(np.int64), np.array(other.gains[gain]).view(np.int64)
            )
            for gain, values in one.gains.items()
        )
    )


def within(laws: Iterable[LawInForce], start: int, stop: float) -> tuple[LawInForce, ...]:
    """Return the laws in force from ``start`` to before ``stop``, by increasing tick."""
    laws = tuple(laws)
    begun = [law for law in laws if law.tick <= start]
    return (*begun[-1:], *(law for law in laws if start < law.tick < stop))


def laws_of(log: FlightLog) -> tuple[LawInForce, ...]:
    """Return the laws in force in the rows of ``log``."""
    return within(log.laws, log.first_tick, log.first_tick + log.ticks)


def as_data(laws: Iterable[LawInForce], timebase: Timebase) -> list[dict[str, Any]]:
    """Return the laws for JSON: tick, time, name and gains of each."""
    return [
        {
            "tick": law.tick,
            "t_s": timebase.stamp_ns(law.tick) / 1e9,
            "controller": law.name,
            "gains": {gain: list(values) for gain, values in law.gains.items()},
        }
        for law in laws
    ]


def in_words(laws: Sequence[dict[str, Any]]) -> str:
    """Describe laws in one line, as ``tde_stc -> tde_tsmc at 1.2345 s (other k_1 at 2.0000 s)``."""
    if not laws:
        return ""
    words, flown = str(laws[0]["controller"]), [laws[0]]
    for law in laws[1 : 1 + MOST_LISTED]:
        last_of_name = [known for known in flown if known["controller"] == law["controller"]][-1:]
        others = [
            k
            for known in last_of_name
            for k, v in law["gains"].items()
            if known["gains"].get(k) != v
        ]
        other, when = f"other {', '.join(others)}", f"at {law['t_s']:.4f} s"
        if law["controller"] != flown[-1]["controller"]:
            words += f" -> {law['controller']} {when}" + (f" ({other})" if others else "")
        elif others:
            words += f" ({other} {when})"
        else:
            words += f" (begun again {when})"
        flown.append(law)
    left = len(laws) - 1 - MOST_LISTED
    return words + (f" and {left} more" if left > 0 else "")
