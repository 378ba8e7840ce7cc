"""Planned swaps of laws, as text: ``T:LAW``, T in simulated seconds."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable
from typing import NamedTuple

from space_robot_msgs_py.config.validation import short
from space_robot_msgs_py.errors import InputError
from space_robot_msgs_py.simulated_time import check_time, tick_from


class Swap(NamedTuple):
    """Swap to the law ``name`` at ``tick``."""

    tick: int
    name: str


def parse_swaps(texts: Iterable[str], period: float) -> list[Swap]:
    """Parse swaps and sort them by tick; empty texts are ignored.

    Raises:
        InputError: a text is not ``T:LAW``, or two swaps have the same tick.
    """
    swaps = sorted(_parse(text, period) for text in texts if text.strip())
    for one, other in itertools.pairwise(swaps):
        if one.tick == other.tick:
            raise InputError(f"swaps to {one.name} and to {other.name} fall on tick {one.tick}")
    return swaps


def _parse(text: str, period: float) -> Swap:
    seconds, _, name = text.partition(":")
    try:
        time = float(seconds)
    except ValueError:
        time = math.nan
    where = f"swap {short(text)}"
    if math.isnan(time) or not name.strip():
        raise InputError(f"{where}: T:LAW expected, T in simulated seconds, as in 5:tde_smc")
    try:
        check_time(time)
    except InputError as error:
        raise InputError(f"{where}: {error}") from None
    return Swap(int(tick_from(time, period)), name.strip())
