"""Search space of a law's gains: factors on a tuned set, most of them a bandwidth's.

A law has three to a dozen gains on each axis, which are not searched one by one: gains of one
bandwidth move together, as in ``k_p = W^2``, ``k_d = 2 W``, and the tuned set has the ratios of the
axes by their inertia. A coordinate is the logarithm of one such factor, for the base and for the
joints each, or for all axes.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from space_robot_control.laws import ControlLaw
from space_robot_model.elementary.matrices import Array

BASE_AXES = 3
BASE, JOINTS = "base ", "joints "
"""Beginnings of the labels of coordinates on their axes."""
BANDWIDTH = "bandwidth"
"""Name of the factor on the poles of a law."""


class Factor(NamedTuple):
    """A factor on gains of a law."""

    name: str
    powers: Mapping[str, float]
    """Power of the factor with which each gain is multiplied."""
    lowest: float
    highest: float
    is_common: bool = False
    """One factor for all axes; else the base has one, and the joints have another."""
    is_low_pass: bool = False
    """Whether the gain is a low-pass's bandwidth in rad/s: its range is the frequencies'."""
    is_value: bool = False
    """Whether the range is that of the gain, not of the factor."""


def bandwidth(**powers: float) -> Factor:
    """Return the factor on a bandwidth W, of which gains are powers."""
    return Factor(BANDWIDTH, {k.rstrip("_"): power for k, power in powers.items()}, 0.05, 50.0)


SLOWEST_RAD_S, FASTEST_RAD_S = 0.1, 200.0
"""Bandwidths between which is searched, where that of the start is known."""


DAMPING = Factor("damping", {"k_d": 1.0}, 0.4, 2.5, is_common=True)
H_BAR = Factor("inertia of the estimate", {"h_bar": 1.0}, 0.05, 20.0)
INTEGRAL = Factor("integral", {"k_i": 1.0}, 1e-3, 0.5, is_common=True)
"""K_I as a share of that with which the integral is as fast as the loop."""
FRICTION = Factor("friction fed forward", {"viscous": 1.0, "coulomb": 1.0}, 0.01, 1.5, True)
"""Share of the nominal friction."""
DEAD_BAND = Factor("dead band", {"dead_band": 1.0}, 0.01, 100.0, is_common=True)
DEAD_BAND_RATE = 1e-4
"""On which the factor of the dead band counts, rad/s or m/s."""
FILTER = "low-pass of the estimate"
"""The one factor on a number of the set instead of a law's: its corner frequency."""
SLOWEST_HZ, FASTEST_HZ = 1.0, 900.0
"""Corner frequencies of low-passes between which is searched."""
FIRST_HZ = (30.0, 6.0, 1.2)
"""Low-passes with which the search begins."""
FIRST_RAD_S: Sequence[tuple[float, float]] = ((2.0, 2.0), (8.0, 8.0), (32.0, 32.0))
"""Bandwidths of base and joints with which the search begins."""
WITHOUT_LOW_PASS: Sequence[tuple[float, float]] = (
    *((1.0, 1.0), (4.0, 4.0), (16.0, 16.0), (64.0, 64.0)),
    *((1.0, 8.0), (4.0, 32.0), (16.0, 128.0), (64.0, 200.0)),
)
"""Those with which it does for laws without a low-pass."""
AGAINST_FRICTION = (INTEGRAL, FRICTION, DEAD_BAND)
KNOWN: Mapping[str, Sequence[Factor]] = {
    "pd": [bandwidth(k_p=2, k_d=1), DAMPING, *AGAINST_FRICTION],
    "pd_feedforward": [bandwidth(k_p=2, k_d=1), DAMPING, *AGAINST_FRICTION],
    "ctc": [bandwidth(k_p=2, k_d=1), DAMPING, *AGAINST_FRICTION],
    "ctc_smc": [
        bandwidth(lambda_=1, delta=-1),
        Factor("switching", {"g": 1.0, "delta": 1.0}, 0.02, 20.0),
        Factor("boundary layer", {"delta": 1.0}, 0.03, 30.0, is_common=True),
        *AGAINST_FRICTION,
    ],
    "slotine_li": [
        bandwidth(lambda_=1, k_d=1),
        DAMPING,
        Factor("adaptation", {"gamma": 1.0}, 1e-3, 1e3, is_common=True),
        *AGAINST_FRICTION,
    ],
    "indi": [bandwidth(k_p=2, k_d=1), DAMPING],
    "dob": [
        Factor("inertia", {"inertia": 1.0}, 0.05, 20.0),
        Factor("observer", {"bandwidth": 1.0}, 0.0, 0.0, is_low_pass=True),
        bandwidth(k_p=2, k_d=1),
    ],
    "adrc": [
        Factor("inertia", {"inertia": 1.0}, 0.05, 20.0),
        Factor("observer", {"omega_o": 1.0}, 0.0, 0.0, is_low_pass=True),
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
FROZEN = ("damping", "dead band", "boundary layer", "switching", "reaching", "adaptation")
"""Factors that a short search leaves as they begin."""
OWN_RANGE = 30.0
"""Factor by which each gain of a user's law is searched up and down, where it declares none."""


class Coordinate(NamedTuple):
    """One number of a search: the logarithm of a factor on some axes."""

    label: str
    powers: Mapping[str, float]
    axes: slice
    lowest: float
    highest: float
    is_low_pass: bool


@dataclass(frozen=True)
class GainPoint:
    """Gains of a law, and the low-pass of its estimate."""

    gains: Mapping[str, Array]
    """By name, (m,) each."""
    corner_hz: float
    """0: none."""
    bandwidth: float = 0.0
    """W, rad/s; 0: unknown."""


class SearchSpace:
    """Factors on the gains of one law, each between 0 and 1 in a point (d,) of the search."""

    def __init__(
        self,
        law: type[ControlLaw],
        start: GainPoint,
        friction: Array,
        controls_base: bool,
        has_low_pass: bool,
        is_short: bool = False,
        bandwidth: float | None = None,
    ) -> None:
        """Lay out the coordinates.

        Args:
            law: class of the law.
            start: from which the factors count; gains against friction that are zero in it count
                from the friction and from the bandwidth.
            friction: f_C and f_V (n, 2) of the joints as they are known, N m and N m s/rad.
            controls_base: whether the base has actuators; else its gains are not searched.
            has_low_pass: whether the law has an estimate behind the low-pass of the set.
            is_short: whether to search few numbers only, see `FROZEN`.
            bandwidth: if given: of the law, rad/s, which is then not searched.
        """
        count = len(next(iter(start.gains.values())))
        zeros = {name: np.zeros(count) for name in law.gain_descriptions()}
        own = {name: values.copy() for name, values in start.gains.items()}
        self.start = start = replace(start, gains={**zeros, **own})
        self._known = {name: np.zeros(count) for name in ("coulomb", "viscous", "dead_band")}
        self._known["coulomb"][BASE_AXES:], self._known["viscous"][BASE_AXES:] = friction.T
        self._known["dead_band"][BASE_AXES:] = DEAD_BAND_RATE
        self._has_integral = INTEGRAL in KNOWN.get(law.name, ())
        factors = KNOWN.get(law.name) or _factor_per_gain(law, start.gains)
        parts = {BASE: slice(0, BASE_AXES)} if controls_base else {}
        parts |= {JOINTS: slice(BASE_AXES, None)}
        self.coordinates: list[Coordinate] = []
        for factor in factors:
            powers = factor.powers
            if not any(self._reference(name, start.gains).any() for name in powers):
                continue  # h_bar of the nominal model, or no friction
            if factor is DEAD_BAND and not friction[:, 0].any():
                continue
            if is_short and factor.name in FROZEN:
                self._hold(powers, 1.0)
            elif factor.name == BANDWIDTH and start.bandwidth and bandwidth is not None:
                self._hold(powers, bandwidth / start.bandwidth)
            else:
                for part, axes in ({"": slice(None)} if factor.is_common else parts).items():
                    if not any(self._reference(name, start.gains)[axes].any() for name in powers):
                        continue
                    low, high = self._ends(factor, powers, axes)
                    numbers = part + factor.name, powers, axes, low, high, factor.is_low_pass
                    self.coordinates.append(Coordinate(*numbers))
        if has_low_pass:
            corner = start.corner_hz or FASTEST_HZ
            low, high = SLOWEST_HZ / corner, FASTEST_HZ / corner
            self.coordinates.append(Coordinate(FILTER, {}, slice(None), low, high, True))
        self._low, self._high = (
            np.log([getattr(c, end) for c in self.coordinates]) for end in ("lowest", "highest")
        )

    def _hold(self, powers: Mapping[str, float], factor: float) -> None:
        """Leave gains out of the search, with a factor on where they begin."""
        gains = self.start.gains
        for name, power in powers.items():
            gains[name][:] = self._reference(name, gains) * factor**power

    def _ends(
        self, factor: Factor, powers: Mapping[str, float], axes: slice
    ) -> tuple[float, float]:
        """Return the least and the largest factor on some axes."""
        if factor.is_low_pass:
            gains = self.start.gains
            fastest = float(max(np.max(gains[name][axes]) for name in powers))
            return 2.0 * np.pi * SLOWEST_HZ / fastest, 2.0 * np.pi * FASTEST_HZ / fastest
        if factor.is_value:
            values = self.start.gains[factor.name][axes]
            values = values[values != 0.0]
            return min(1.0, factor.lowest / values.min()), max(1.0, factor.highest / values.max())
        if factor.name == BANDWIDTH and self.start.bandwidth:
            slowest, fastest = SLOWEST_RAD_S, FASTEST_RAD_S
            return slowest / self.start.bandwidth, fastest / self.start.bandwidth
        return factor.lowest, factor.highest

    @property
    def dimension(self) -> int:
        """Number of coordinates."""
        return len(self.coordinates)

    @property
    def origin(self) -> Array:
        """The point (d,) of the start, with the known friction fed forward."""
        factors = np.zeros(self.dimension)
        for k, coordinate in enumerate(self.coordinates):
            if self._has_integral and "k_i" in coordinate.powers:
                share = np.mean(self.start.gains["k_i"] / _fast_integral(self.start.gains))
                middle = 0.5 * (self._low[k] + self._high[k])
                factors[k] = math.log(share) if share else middle
        origin: Array = (factors - self._low) / (self._high - self._low)
        return np.clip(origin, 0.0, 1.0)

    @property
    def ladder(self) -> list[Array]:
        """The start with low-passes and bandwidths of all kinds."""
        labels = np.array([coordinate.label for coordinate in self.coordinates], str)
        is_rate = [labels == part + BANDWIDTH for part in (BASE, JOINTS)]
        is_low_pass = np.array([coordinate.is_low_pass for coordinate in self.coordinates])
        has_low_pass = bool(is_low_pass.any())
        corners = _shares(FIRST_HZ, SLOWEST_HZ, FASTEST_HZ) if has_low_pass else [0.0]
        rates = FIRST_RAD_S if has_low_pass else WITHOUT_LOW_PASS
        if not np.any(is_rate) or not self.start.bandwidth:
            is_rate, rates = [np.zeros_like(is_low_pass)] * 2, rates[:1]
        shares = [_shares(both, SLOWEST_RAD_S, FASTEST_RAD_S) for both in rates]
        return [
            np.select([*is_rate, is_low_pass], [*both, corner], self.origin)
            for corner in corners
            for both in shares
        ]

    def at(self, point: Array) -> GainPoint:
        """Return the gains at a point (d,)."""
        gains = {name: values.copy() for name, values in self.start.gains.items()}
        corner = self.start.corner_hz
        factors = np.exp(self._low + np.clip(point, 0.0, 1.0) * (self._high - self._low))
        for (label, powers, axes, *_), factor in zip(self.coordinates, factors, strict=True):
            if label == FILTER:
                corner = float((self.start.corner_hz or FASTEST_HZ) * factor)
            for name, power in powers.items():
                gains[name][axes] = self._reference(name, gains)[axes] * factor**power
        return replace(self.start, gains=gains, corner_hz=corner)

    def _reference(self, name: str, gains: Mapping[str, Array]) -> Array:
        """Return what a factor on a gain (m,) counts from."""
        if self._has_integral and name == "k_i":
            return _fast_integral(gains)
        return gains[name] if gains[name].any() else self._known.get(name, gains[name])


def _shares(values: Sequence[float], lowest: float, highest: float) -> list[float]:
    return [math.log(value / lowest) / math.log(highest / lowest) for value in values]


def _fast_integral(gains: Mapping[str, Array]) -> Array:
    """Return the K_I (m,) of an integral that is as fast as the loop: K_P W, or lambda^2."""
    if "k_p" in gains:
        fast: Array = 2.0 * gains["k_p"] ** 2 / gains["k_d"]
        return fast
    return gains["lambda"] ** 2


def _factor_per_gain(law: type[ControlLaw], gains: Mapping[str, Array]) -> list[Factor]:
    """Return a factor on each gain of a user's law, within the range that it declares."""
    factors = []
    for name in (name for name, values in gains.items() if values.any()):
        declared = law.gain_ranges().get(name)
        if declared and not declared.per_inertia:
            low, high = max(declared.lower, 1e-3 * declared.upper), declared.upper
            factors.append(Factor(name, {name: 1.0}, low, high, is_value=True))
        else:
            factors.append(Factor(name, {name: 1.0}, 1.0 / OWN_RANGE, OWN_RANGE))
    return factors
