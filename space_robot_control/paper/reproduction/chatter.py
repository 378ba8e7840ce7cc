"""The chatter of the laws beside one another: the flights of case 1, with printed friction."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from .flights import Result

COLUMNS = ("base_torque", "torque_1_3", "torque_4_6")


class Chatter(NamedTuple):
    """One flight's chatter, by the keys of ``COLUMNS``."""

    controller: str
    gains: str
    total_variation_per_s: dict[str, float]
    """N m/s, mean of the axes."""
    power_above_100_hz: dict[str, float]
    """Share of the power, mean of the axes."""

    def texts(self) -> list[str]:
        """For a table."""
        return [
            self.controller, self.gains,
            *(f"{self.total_variation_per_s[column]:.3g}" for column in COLUMNS),
            *(f"{self.power_above_100_hz[column]:.1e}" for column in COLUMNS),
        ]  # fmt: skip


HEADINGS = [
    "controller", "gains",
    *(f"{name}: variation, N m/s" for name in ("base", "joints 1-3", "joints 4-6")),
    *(f"{name}: power > 100 Hz" for name in ("base", "joints 1-3", "joints 4-6")),
]  # fmt: skip


def chatter(results: Sequence[Result]) -> list[Chatter]:
    """Of every flight of case 1 with friction that did not diverge."""
    return [
        Chatter(r.row.controller, r.variant.gains, **_merits(r.chatter))
        for r in results
        if r.chatter is not None
    ]


def _merits(chatter: dict[str, dict[str, float]]) -> dict[str, dict[str, float]]:
    return {
        name: {column: values[column] for column in COLUMNS} for name, values in chatter.items()
    }
