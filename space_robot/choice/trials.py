"""Trial flights of a gain set: the mission's beginning, with a light and a heavy robot.

The two differ from the nominal flight in everything that a gain set needs margin for, each in the
direction in which errors add up: the light robot's loop is the fastest, and its drives report less
torque than they apply; those of the heavy robot report more.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from space_robot_msgs_py.config.files import merge

from ..analysis.words import Metrics
from ..api import Scenario
from ..campaign.draws.nominal import Nominal, Variation
from ..campaign.draws.paths import Path, Unavailable, value_at
from ..flight.batch import fly_in_lanes
from ..flight.plan import Flight
from .criteria import Criterion, mean_log
from .search_space import GainPoint
from .stability import SmallMotions

LATENCY = "plant.command_latency_ticks"
ALLOWED_SATURATION = 0.01
"""Largest share of ticks with a wheel at its limit."""
HELD = 0.5
"""Largest share of its way on which friction may hold a joint."""


class Deviation(NamedTuple):
    """Factors on the numbers of a nominal flight."""

    mass: float
    torque_scale: float
    friction: float
    latency_ticks: int


@dataclass(frozen=True)
class Uncertainty:
    """How wrong the numbers may be that a law knows: shares, and ticks."""

    mass: float = 0.2
    torque_scale: float = 0.05
    friction: float = 0.5
    latency_ticks: int = 1

    @property
    def deviations(self) -> tuple[Deviation, Deviation]:
        """The light robot and the heavy one."""
        mass, scale, friction = self.mass, self.torque_scale, self.friction
        return (
            Deviation(1.0 - mass, 1.0 + scale, 1.0 - friction, self.latency_ticks),
            Deviation(1.0 + mass, 1.0 - scale, 1.0 + friction, 0),
        )

    @property
    def gain(self) -> float:
        """Largest factor on the loop gain: by masses and torque, and by a delay beyond one tick."""
        return (1.0 + self.torque_scale) / (1.0 - self.mass) * max(1.0, self.latency_ticks)

    def vary(self, own_friction: bool) -> dict[str, Any]:
        """Return the same as distributions of a campaign.

        Args:
            own_friction: whether the robot's file has friction of some joints.
        """

        def within(share: float) -> dict[str, Any]:
            return {"uniform": [1.0 - share, 1.0 + share]}

        vary: dict[str, Any] = {}
        if self.mass:
            for body in ("base", "links[*]"):
                for number in ("mass", "inertia"):
                    vary[f"robot.{body}.{number}"] = {**within(self.mass), "relative": True}
        if self.friction:
            for where in ("plant", "robot.joints[*]") if own_friction else ("plant",):
                for kind in ("coulomb", "viscous"):
                    friction = {**within(self.friction), "relative": True}
                    vary[f"{where}.friction.{kind}"] = friction
        if self.torque_scale:
            vary["faults"] = {"torque_scale@0:all": within(self.torque_scale)}
        if self.latency_ticks:
            vary[LATENCY] = {"choice": list(range(self.latency_ticks + 1)), "offset": True}
        return vary


class Score(NamedTuple):
    """What the trials of a gain set showed."""

    error: float
    """Mean of `errors`, see `mean_log`."""
    ripple: float
    """Largest ripple of a group of torques, as a share of its largest torque in the mission."""
    saturation: float
    """Share of the ticks with any wheel at a limit."""
    flown: float
    """Share of the trials' time that was flown before a flight ended early; 1: all of it."""
    beyond: bool
    """True if a joint was beyond its effort limit."""
    metrics: Mapping[str, float]
    """RMS over the trials, by name."""
    errors: Mapping[str, float] = {}
    """Logarithms of the errors that count."""
    ripples: Mapping[str, float] = {}
    """Logarithms of the ripples as shares."""
    held: bool = False
    """True if friction held a joint on much of its way."""
    growth: float = 0.0
    """Of small motions along the mission, 1/s; above 0 nothing is flown."""

    @property
    def is_flyable(self) -> bool:
        """True if all trials were flown within the limits of joints and wheels."""
        is_free = not (self.beyond or self.held)
        return self.flown >= 1.0 and is_free and self.saturation <= ALLOWED_SATURATION


class Trials:
    """The trial flights of one law."""

    def __init__(
        self,
        scenario: Scenario,
        uncertainty: Uncertainty,
        torques: Mapping[str, float],
        criterion: Criterion,
    ) -> None:
        """Resolve the scenario once.

        Args:
            scenario: with law, gains, hardware, and a duration.
            uncertainty: of the numbers that the law knows.
            torques: largest torque of the mission by torque column, N m or N.
            criterion: what counts.

        Raises:
            InputError: it cannot be flown.
        """
        self.nominal = Nominal(scenario)
        self.law = self.nominal.resolved.law
        self._torques, self._criterion = torques, criterion
        self._variations = [self._variation(deviation) for deviation in uncertainty.deviations]
        flight, is_late = Flight(self.nominal.resolved), uncertainty.latency_ticks > 0
        self._small = SmallMotions(flight, uncertainty.gain, 1.0 - uncertainty.friction, is_late)

    def fly(self, points: Sequence[GainPoint]) -> list[Score]:
        """Fly the trials of several gain sets in lanes, and score each.

        Those under which small motions grow are not flown.
        """
        growth = [self._growth(point) for point in points]
        flights = [
            self._flight(variation, point)
            for point, fastest in zip(points, growth, strict=True)
            for variation in self._variations
            if fastest <= 0.0
        ]
        trials = iter(
            {"flown": flown.log.ticks / flight.ticks}
            if flown.ending.error
            else {"flown": 1.0, **self._criterion.of(flown.log)}
            for flight, flown in zip(flights, fly_in_lanes(flights), strict=True)
        )
        flown = [
            [next(trials) if fastest <= 0.0 else {"flown": 0.0} for _ in self._variations]
            for fastest in growth
        ]
        return [self._score(f)._replace(growth=g) for f, g in zip(flown, growth, strict=True)]

    def _growth(self, point: GainPoint) -> float:
        law = type(self.law)(dict(point.gains), self.law.period)
        return self._small.growth(law, point.corner_hz)

    def _variation(self, deviation: Deviation) -> Variation:
        tree, changed = self.nominal.tree, dict[Path, Any]()
        robot = tree["robot"]
        bodies = [("base",), *(("links", name) for name in robot["links"])]
        for body in bodies:
            for number in ("mass", "inertia"):
                path = ("robot", *body, number)
                changed[path] = deviation.mass * value_at(tree, path)
        for kind in ("coulomb", "viscous"):
            paths = [
                ("plant", "friction", kind),
                *(("robot", "joints", name, "friction", kind) for name in robot["joints"]),
            ]
            for path in paths:
                value = value_at(tree, path)
                if not isinstance(value, Unavailable):
                    changed[path] = deviation.friction * value
        latency = tuple(LATENCY.split("."))
        changed[latency] = value_at(tree, latency) + deviation.latency_ticks
        changed["faults", "torque_scale@0:all={}"] = deviation.torque_scale
        return self.nominal.variation(changed, self.nominal.scenario.seed)

    def _flight(self, variation: Variation, point: GainPoint) -> Flight:
        gains = {name: values.tolist() for name, values in point.gains.items()}
        parameters = merge(
            variation.parameters,
            {"controller": {self.law.name: gains, "acceleration_filter_hz": point.corner_hz}},
        )
        return self.nominal.flight_with(variation._replace(parameters=parameters))

    def _score(self, trials: Sequence[Metrics]) -> Score:
        flown = float(np.mean([trial["flown"] for trial in trials]))
        if flown < 1.0:
            return Score(math.inf, math.inf, 0.0, flown, False, {})
        mean = {
            name: math.sqrt(float(np.mean([trial.get(name, 0.0) ** 2 for trial in trials])))
            for name in trials[0]
        }
        errors = self._criterion.log_errors(mean)
        ripples = {
            name: math.log(max(mean[f"{name}.ripple"] / most, 1e-12))
            for name, most in self._torques.items()
        }
        return Score(
            math.exp(mean_log(errors)),
            math.exp(max(ripples.values())),
            mean.get("wheels.saturation", 0.0),
            1.0,
            any(value for name, value in mean.items() if name.endswith(".beyond_effort")),
            mean,
            errors,
            ripples,
            any(value > HELD for name, value in mean.items() if name.endswith(".standing")),
        )
