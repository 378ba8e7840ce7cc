"""How a law declares its gains, and where a search looks for each."""

from __future__ import annotations

import math
from dataclasses import KW_ONLY, dataclass
from typing import Any, Literal, NamedTuple

from space_robot_msgs_py.compiled.records import Field, Record


class GainRange(NamedTuple):
    """Where a search looks for a gain."""

    lower: float
    upper: float
    scale: Literal["log", "linear"]
    unit: str
    """That of the gain."""
    per_inertia: bool
    """True: the bounds are for the gain divided by the inertia of its axis, kg m2."""
    is_optional: bool
    """True: the gain may also be zero, which is what it is unless it is given."""


@dataclass(frozen=True)
class AxisField(Field):
    """Declaration of a number per axis, which may be a gain."""

    _: KW_ONLY
    range: GainRange | None = None
    is_optional: bool = False


def per_axis(
    description: str,
    unit: str = "",
    *,
    search: tuple[float, float] | None = None,
    scale: Literal["log", "linear"] = "log",
    per_inertia: bool = False,
    is_optional: bool = False,
) -> Any:
    """Declare a gain, or a field of a law's memory, with one value per axis: (m,).

    Args:
        description: its meaning.
        unit: its unit.
        search: least and largest value in a search of gains, see `ControlLaw.gain_ranges`.
        scale: of the search; ``"log"`` needs bounds above 0.
        per_inertia: the bounds are for the gain divided by the inertia of its axis.
        is_optional: a gain set may lack it; it is zero then.

    Raises:
        ValueError: there is no such range.
    """
    span = None
    if search is not None:
        lower, upper = search
        if scale not in ("log", "linear") or not 0.0 <= lower < upper < math.inf:
            raise ValueError(f"{description}: no range to search, {search}, {scale!r}")
        if scale == "log" and lower == 0.0:
            raise ValueError(f"{description}: a logarithmic search begins above 0, got {search}")
        span = GainRange(lower, upper, scale, unit, per_inertia, is_optional)
    text = ", ".join(filter(None, (description, unit)))
    return AxisField(lambda n: (n + 3,), text, range=span, is_optional=is_optional)


class LawGains(Record):
    """Base class of a law's gains, each `per_axis`; users write ``lambda`` for ``lambda_``."""
