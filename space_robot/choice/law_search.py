"""The search of one law or several: what is common to `recommend` and to `gains tune --law`."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from space_robot_control.laws import find_law, laws
from space_robot_model.elementary.matrices import Array
from space_robot_msgs_py.errors import InputError
from space_robot_sim.environment.friction import coefficients

from ..analysis.analysed_log import AnalysedLog
from ..analysis.torques import SHORTEST_S
from ..api import Scenario
from ..campaign.gain_set import tuned_set, write_set
from ..campaign.study import Law
from ..console.progress import watching_progress
from ..flight.flown_log import empty_log
from ..flight.mission_demand import demand_remark
from ..flight.plan import Flight, resolve
from ..processes.executor import run_all
from ..processes.scratch_folder import ScratchFolder
from ..tuning.inertia import SAMPLING, sampled_reference
from ..tuning.method import Tuned
from ..tuning.task import TuningOptions, force_demand
from .criteria import CRITERIA
from .front import RIPPLE_SHARES, Front, Goal, Tried, search_front
from .gain_files import write_gains
from .search_space import GainPoint, SearchSpace
from .start import first_points
from .trials import Trials, Uncertainty

INITIAL_TUNING = TuningOptions(margin=0.05, mass_uncertainty=0.2)
"""Requirements on the gains from which the search starts."""

WITHOUT_PAYLOAD = "1"
"""The case with friction alone."""
FAST, LONGEST_TRIAL_S = 0.6, 40.0
"""Share of the largest speed that is fast; the longest trial, s."""
TUNED_SET = "tuned"
"""Name of the set from which `first_points` starts the search."""
TUNED = ("robot", "mission", "sensors", "navigation", "orbit", "period", "parameters")
"""Options of a scenario that gains are tuned for."""


@dataclass(frozen=True)
class ChoiceOptions:
    """How a law is chosen."""

    criterion: str = "tracking"
    """Name of one of `CRITERIA`."""
    ripple: float = 0.05
    """Largest ripple of the torques, as a share of the largest one in the mission."""
    laws: tuple[str, ...] = ()
    """That take part, also ``file.py:Class``; empty: all of this project."""
    evaluations: int = 80
    """Gain sets flown for each law."""
    is_short: bool = False
    """Whether few numbers of each law are searched, at the ripple allowed only."""
    trial_s: float = 12.0
    """Duration of a trial, s: of a longer mission the beginning is flown, and of a slow one as
    much as it takes until it is fast, see `fast_at`."""
    runs: int = 12
    """Draws that every candidate flies."""
    seed: int = 1
    workers: int = 0
    uncertainty: Uncertainty = field(default_factory=Uncertainty)
    error: float | None = None
    """If set: the least ripple with at most this error is searched."""
    bandwidth: float | None = None
    """If set: poles of the law, rad/s; only its other gains are searched."""

    @property
    def goal(self) -> Goal:
        """The place on the front that is searched."""
        return Goal(self.ripple, self.error)


def prepare(
    scenario: Mapping[str, Any], folder: Path, options: ChoiceOptions, command: str
) -> tuple[LawSearch, Flight, Tuned]:
    """Tune all laws for a scenario, and prepare the search of their gains from there on.

    Args:
        scenario: options of a `Scenario`, without law and gains.
        folder: that exists, for the tuned set.
        options: of the search.
        command: the user's command, for the files' headers.

    Returns:
        The search, the nominal flight, and the gains from which the search begins.

    Raises:
        InputError: the scenario cannot be flown, or it has no such law.
    """
    names = tuple(dict.fromkeys(options.laws)) or tuple(sorted(laws()))
    controllers = [Law.parse(law).controller for law in names]
    kinds = [find_law(controller).name for controller in controllers]
    for name, count in Counter(kinds).items():
        if count > 1:
            raise InputError(f"law {name}: named twice, with or without gains of its own")
    for_tuning = {key: scenario[key] for key in TUNED if key in scenario}
    tuned = _tuned(for_tuning, str(scenario.get("case", WITHOUT_PAYLOAD)))
    write_set(tuned, command, folder / TUNED_SET)
    for law, controller in zip(names, controllers, strict=True):
        if "=" not in law and controller not in tuned.laws:
            raise InputError(f"law {law}: has no tuned gains: give some, {law}=GAINS")
    search = LawSearch(names, dict(scenario), f"{folder}/{TUNED_SET}", {}, options)
    nominal = Scenario(**search.scenario_with(names[0])).check()
    known = nominal.scenario.robots.controller
    friction = coefficients(known, nominal.plant_settings.friction)[: known.n]
    if (duration := nominal.ticks * nominal.period) < SHORTEST_S:
        raise InputError(f"a search needs {SHORTEST_S:g} s of flight or more, got {duration:g} s")
    if remark := demand_remark(nominal.scenario):
        raise InputError(f"no law can fly this: {remark}")
    log = AnalysedLog(empty_log(nominal, 0, 1, is_brief=True))
    CRITERIA[options.criterion].check(log)
    peak = force_demand(known, nominal.scenario.mission, [nominal.scenario.plant]).peak
    search = replace(
        search,
        points=first_points(tuned, peak, options.ripple, nominal.period),
        torques={name: float(np.mean(peak[axes])) for name, axes in log.torque_columns.items()},
        friction=friction,
        duration=min(duration, max(options.trial_s, fast_at(nominal))),
        controls_base=nominal.controls_base,
    )
    return search, nominal, tuned


def _tuned(options: Mapping[str, Any], case: str) -> Tuned:
    """Tune for a case; where payload, or then noise, leaves no gains at all, without it."""
    try:
        return tuned_set(options, [case], INITIAL_TUNING, lambda text: None)
    except InputError:
        if case != WITHOUT_PAYLOAD:
            return _tuned(options, WITHOUT_PAYLOAD)
        if "sensors" not in options:
            raise
        noisy = ("sensors", "navigation")
        return _tuned({key: own for key, own in options.items() if key not in noisy}, case)


def has_estimate(law: str) -> bool:
    """Return True if a law has an estimate behind the low-pass of the set."""
    kind = find_law(law)
    return "h_bar" in kind.gain_descriptions() or kind.estimates_with_model


def fast_at(flight: Flight) -> float:
    """Return when the joints, or the base, are first about as fast as ever in a mission, s."""
    scenario = flight.scenario
    motion = sampled_reference(scenario.robots.controller, scenario.mission)
    joints, base = motion.joints[:, 1], motion.base[:, 4:7]
    speed = np.linalg.norm(joints if joints.any() else base, axis=1)
    first = int(np.argmax(speed >= FAST * speed.max(initial=0.0)))
    return min(first * SAMPLING, LONGEST_TRIAL_S)


@dataclass(frozen=True)
class LawSearch:
    """Searches the front of a law; it can be sent to other processes."""

    laws: tuple[str, ...]
    """Also ``file.py:Class=GAINS``."""
    scenario: dict[str, Any]
    gains: str
    points: dict[str, GainPoint]
    options: ChoiceOptions
    torques: dict[str, float] = field(default_factory=dict)
    friction: Array = field(default_factory=lambda: np.empty((0, 2)))
    """f_C and f_V (n, 2) of the joints as a user knows them."""
    duration: float = 0.0
    """Of a trial, s."""
    controls_base: bool = True
    tally: str = os.devnull
    """File that gets a byte for each gain set tried."""

    def __call__(self, law: str) -> Front:
        """Return the front of a law."""
        from threadpoolctl import threadpool_limits  # comes with scikit-learn

        options = self.options
        scenario = Scenario(**{**self.scenario_with(law), "duration": self.duration})
        trials = Trials(scenario, options.uncertainty, self.torques, CRITERIA[options.criterion])

        def note(count: int) -> None:
            with Path(self.tally).open("ab") as file:
                file.write(bytes(count))

        how = options.goal, options.evaluations, options.seed
        shares = (1.0,) if options.is_short else RIPPLE_SHARES
        # threads for such small matrices only wait for one another, and change last digits
        with threadpool_limits(1):
            return search_front(trials, self.space(law), *how, shares, note)

    def fronts(self) -> list[Front]:
        """Return the front of each law; a progress line counts their gain sets."""
        with ScratchFolder() as folder:
            tally = Path(folder) / "tried"
            tally.touch()
            kinds = {law: find_law(Law.parse(law).controller) for law in self.laws}
            total = self.options.evaluations * len(kinds)
            with watching_progress("gain sets tried", total, lambda: tally.stat().st_size):
                # a law with a large memory takes longest, so it begins first
                order = sorted(kinds, key=lambda law: -kinds[law].memory_type.block(1).nbytes)
                how = order, min(self.options.workers, len(order))
                fronts = run_all(replace(self, tally=str(tally)), *how)
                return [fronts[order.index(law)] for law in self.laws]

    def scenario_with(self, law: str) -> dict[str, Any]:
        """Return the options of the scenario with a law."""
        controller, gains = Law.parse(law)
        own = gains if "=" in law else self.gains
        return {**self.scenario, "controller": controller, "gains": own}

    def space(self, law: str) -> SearchSpace:
        """Return the search space of a law."""
        controller = Law.parse(law).controller
        start = self.points.get(controller)
        if "=" in law:
            scenario = resolve(Scenario(**self.scenario_with(law)))
            corner = scenario.controller.acceleration_filter_hz
            start = GainPoint(scenario.law.gain_values, corner)
        assert start is not None
        own, options, has_low_pass = find_law(controller), self.options, has_estimate(controller)
        if options.bandwidth is not None and not start.bandwidth:
            raise InputError(f"law {controller}: has no bandwidth that is known")
        how = options.is_short, options.bandwidth
        return SearchSpace(own, start, self.friction, self.controls_base, has_low_pass, *how)


def tune_law(
    scenario: Mapping[str, Any], folder: Path, options: ChoiceOptions, command: str
) -> Tried:
    """Search the gains of one law for a place on its front, and write them as a set.

    Args:
        scenario: options of a `Scenario`, without law and gains.
        folder: of the set.
        options: with the one law, and ripple, error or bandwidth.
        command: the user's command, for the files' headers.

    Raises:
        InputError: the scenario cannot be flown, or no gains are as asked.
    """
    with ScratchFolder() as place:
        search, _, _ = prepare(scenario, Path(place), options, command)
        (law,), (front,) = search.laws, search.fronts()
        if (tried := front.chosen(options.goal)) is None:
            raise InputError(f"law {law}: no gains are as asked: {front.why_none(options.goal)}")
        point = search.space(law).at(tried.point)
    write_gains(Law.parse(law).controller, point, folder, command, tried.score)
    return tried
