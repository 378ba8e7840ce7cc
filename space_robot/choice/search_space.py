"""Search space of a law's gains: factors on a tuned set, most of them a bandwidth's.

A law has three to a dozen gains on each axis, which are not searched one by one: gains of one
bandwidth move together, as in ``k_p = W^2``, ``k_d = 2 W``, and the tuned set has the ratios of the
axes by their inertia. A coordinate is the logarithm of one such factor, for the base and for the
joints each, or for all axes.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from space_robot_control.laws import ControlLaw

Array = NDArray[np.float64]

BASE_AXES = 3


class Factor(NamedTuple):
    """A factor on gains of a law."""

    name: str
    powers: Mapping[str, float]
    """Power of the factor with which each gain is multiplied."""
    lowest: float
    highest: float
    is_common: bool = False
    """One factor for all axes; else the base has one, and the joints have another."""


def bandwidth(**powers: float) -> Factor:
    """Return the factor on a bandwidth W, of which gains are powers."""
    return Factor("bandwidth", powers, 0.05, 50.0)


DAMPING = Factor("damping", {"k_d": 1.0}, 0.4, 2.5, is_common=True)
H_BAR = Factor("inertia of the estimate", {"h_bar": 1.0}, 0.05, 20.0)
FILTER = "low-pass of the estimate"
"""The one factor on a number of the set instead of a law's: its corner frequency."""
SLOWEST_HZ, FASTEST_HZ = 2.0, 900.0
"""Corner frequencies of that low-pass between which is searched."""
KNOWN: Mapping[str, Sequence[Factor]] = {
    "pd": [bandwidth(k_p=2, k_d=1), DAMPING],
    "pd_feedforward": [bandwidth(k_p=2, k_d=1), DAMPING],
    "ctc": [bandwidth(k_p=2, k_d=1), DAMPING],
    "ctc_smc": [
        bandwidth(lambda_=1, delta=-1),
        Factor("switching", {"g": 1.0, "delta": 1.0}, 0.02, 20.0),
        Factor("boundary layer", {"delta": 1.0}, 0.03, 30.0, is_common=True),
    ],
    "slotine_li": [
        bandwidth(lambda_=1, k_d=1),
        DAMPING,
        Factor("adaptation", {"gamma": 1.0}, 1e-3, 1e3, is_common=True),
    ],
    "indi": [bandwidth(k_p=2, k_d=1), DAMPING],
    "dob": [
        Factor("inertia", {"inertia": 1.0}, 0.05, 20.0),
        Factor("observer", {"bandwidth": 1.0}, 0.02, 20.0),
        bandwidth(k_p=2, k_d=1),
    ],
    "adrc": [
        Factor("inertia", {"inertia": 1.0}, 0.05, 20.0),
        Factor("observer", {"omega_o": 1.0}, 0.05, 20.0),
        bandwidth(omega_c=1),
    ],
    "tde_smc": [H_BAR, bandwidth(lambda_=1), Factor("switching", {"g": 1.0}, 1e-3, 30.0)],
    "tde_tsmc": [
        H_BAR,
        bandwidth(k_p=2, k_d=1),
        Factor("reaching", {"k_1": 1.0}, 1e-2, 30.0, is_common=True),
    ],
    "tde_stc": [
        H_BAR,
        bandwidth(lambda_=1, k_1=0.5, k_2=1),
        Factor("switching", {"k_1": 0.5, "k_2": 1.0}, 1e-3, 1e2, is_common=True),
    ],
}
"""Factors of the project's laws."""
OWN_RANGE = 30.0
"""Factor by which each gain of a user's law is searched up and down, where it declares none."""


class Coordinate(NamedTuple):
    """One number of a search: the logarithm of a factor on some axes."""

    label: str
    powers: Mapping[str, float]
    axes: slice
    lowest: float
    highest: float


@dataclass(frozen=True)
class GainPoint:
    """Gains of a law, and the low-pass of its estimate."""

    gains: Mapping[str, Array]
    """By name, (m,) each."""
    corner_hz: float
    """0: none."""


class SearchSpace:
    """Factors on the gains of one law, each between 0 and 1 in a point (d,) of the search."""

    def __init__(
        self, law: type[ControlLaw], start: GainPoint, controls_base: bool, has_low_pass: bool
    ) -> None:
        """Lay out the coordinates.

        Args:
            law: class of the law.
            start: from which the factors count.
            controls_base: whether the base has actuators; else its gains are not searched.
            has_low_pass: whether the law has an estimate behind the low-pass of the set.
        """
        self.start = start
        factors = KNOWN.get(law.name) or _of_each_gain(start.gains)
        parts = {"base ": slice(0, BASE_AXES)} if controls_base else {}
        parts |= {"joints ": slice(BASE_AXES, None)}
        self.coordinates: list[Coordinate] = []
        for factor in factors:
            powers = {name.rstrip("_"): power for name, power in factor.powers.items()}
            if not any(start.gains[name].any() for name in powers):  # h_bar of the nominal model
                continue
            of_parts = {"": slice(None)} if factor.is_common else parts
            self.coordinates += [
                Coordinate(part + factor.name, powers, axes, factor.lowest, factor.highest)
                for part, axes in of_parts.items()
            ]
        if has_low_pass:
            corner = start.corner_hz or FASTEST_HZ
            self.coordinates.append(
                Coordinate(FILTER, {}, slice(None), SLOWEST_HZ / corner, FASTEST_HZ / corner)
            )
        self._low, self._high = (
            np.log([getattr(c, end) for c in self.coordinates]) for end in ("lowest", "highest")
        )

    @property
    def dimension(self) -> int:
        """Number of coordinates."""
        return len(self.coordinates)

    @property
    def origin(self) -> Array:
        """The point (d,) of the start."""
        origin: Array = -self._low / (self._high - self._low)
        return np.clip(origin, 0.0, 1.0)

    def at(self, point: Array) -> GainPoint:
        """Return the gains at a point (d,)."""
        gains = {name: values.copy() for name, values in self.start.gains.items()}
        corner = self.start.corner_hz
        factors = np.exp(self._low + np.clip(point, 0.0, 1.0) * (self._high - self._low))
        for (label, powers, axes, _, _), factor in zip(self.coordinates, factors, strict=True):
            if label == FILTER:
                corner = float((self.start.corner_hz or FASTEST_HZ) * factor)
            for name, power in powers.items():
                gains[name][axes] *= factor**power
        return GainPoint(gains, corner)


def _of_each_gain(gains: Mapping[str, Array]) -> list[Factor]:
    return [Factor(name, {name: 1.0}, 1.0 / OWN_RANGE, OWN_RANGE) for name in gains]
