"""The choice of a law for a robot, its hardware and its mission."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from space_robot_control.controller.settings import OF_THE_SET
from space_robot_control.laws import find_law, laws
from space_robot_msgs_py.errors import InputError
from space_robot_sim.environment.friction import coefficients

from ..analysis.analysed_log import AnalysedLog
from ..analysis.torques import SHORTEST_S
from ..api import Scenario
from ..campaign.gain_set import tuned_set, write_set
from ..campaign.study import Law, Study
from ..campaign.verdicts.laws import PairedComparison
from ..console.progress import counting_progress, watching_progress
from ..flight.flown_log import empty_log
from ..flight.plan import Flight, resolve
from ..processes.executor import run_all
from ..processes.scratch_folder import ScratchFolder
from ..tuning.inertia import SAMPLING, sampled_reference
from ..tuning.method import Tuned
from ..tuning.task import AUTO, TuningOptions, force_demand
from .candidates import Candidate, FlownCandidate, comparisons, fly_candidates, ranked
from .criteria import CRITERIA
from .front import SHARES_OF_RIPPLE, Front, search_front
from .gain_files import install, write_gains
from .search_space import GainPoint, SearchSpace
from .trials import Trials, Uncertainty

Array = NDArray[np.float64]
INITIAL_TUNING = TuningOptions(margin=0.05, mass_uncertainty=0.2, h_bar=AUTO)
"""Requirements on the gains from which the search starts."""

WITHOUT_PAYLOAD = "1"
"""The case with friction alone."""
FAST, LONGEST_TRIAL_S = 0.6, 40.0
"""Share of the largest speed that is fast; the longest trial, s."""
TUNED_SET = "tuned"
"""Name of the set from which the search starts."""
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
    evaluations: int = 160
    """Gain sets tried for each law."""
    is_short: bool = False
    """Whether few numbers of each law are searched, at the ripple allowed only."""
    trial_s: float = 12.0
    """Duration of a trial, s: of a longer mission the beginning is flown, and of a slow one as
    much as it takes until it is fast, see `fast_at`."""
    runs: int = 24
    """Draws that every candidate flies."""
    seed: int = 1
    workers: int = 1
    uncertainty: Uncertainty = field(default_factory=Uncertainty)


@dataclass(frozen=True)
class Recommendation:
    """What was found."""

    scenario: Mapping[str, Any]
    """Options of the scenario."""
    options: ChoiceOptions
    fronts: Mapping[str, Front]
    """By law."""
    flown: Sequence[FlownCandidate]
    order: Sequence[FlownCandidate]
    """Those that are not out, the best one first."""
    compared: Sequence[PairedComparison]
    """The best one with each of the others of the order."""
    out: Mapping[str, str]
    """Why a law is out, by law."""
    vary: Mapping[str, Any]
    """What differed from draw to draw, as a campaign has it."""

    @property
    def law(self) -> str:
        """The law to fly; empty: none can."""
        return self.order[0].law if self.order else ""

    @property
    def sentence(self) -> str:
        """The recommendation and its reason."""
        if not self.order:
            return "No law flies this mission with these sensors and actuators."
        criterion = CRITERIA[self.options.criterion]
        best = self.order[0]
        text = f"Fly {best.law}: of {len(self.flown)} laws it has the least {criterion.text}"
        text += f" ({best.median(criterion.value):.3g} in the median of {len(best.flights)} draws)"
        if not self.compared:
            return f"{text}."
        worse = [c.other for c in self.compared if c.finding == "better"]
        alike = [c.other for c in self.compared if c.finding != "better"]
        parts = []
        if worse:
            ratio = 1.0 / next(c.ratio.value for c in self.compared if c.other == worse[0])
            parts.append(f"{worse[0]}, the next one, has {ratio:.3g} times as much")
        if alike:
            parts.append(f"{' and '.join(alike)} cannot be told from it")
        return f"{text}; {'; '.join(parts)}."

    def install(self, folder: Path, gains: Path) -> Path:
        """Make the law with its gains the default of a robot; return the set's folder.

        The set has the other laws' best gains, too, or their tuned ones. It has one low-pass: a
        law whose estimate has another one is not in it.

        Args:
            folder: of the choice.
            gains: of the robot.

        Raises:
            InputError: a file cannot be written.
        """
        own = {each.law: each.candidate.gains.corner_hz for each in self.flown}
        set_folder = folder / (self.law if has_estimate(self.law) else TUNED_SET)
        files = []
        for tuned in sorted((folder / TUNED_SET).glob("*.yaml")):
            law, searched = tuned.stem, folder / tuned.stem / tuned.name
            if tuned.name == OF_THE_SET:
                continue
            if law == self.law or (law in own and not has_estimate(law)):
                files.append(searched)
            elif not has_estimate(law) or set_folder.name == TUNED_SET:
                files.append(tuned)
            elif own.get(law) == own[self.law]:
                files.append(searched)
        return install(files, set_folder / OF_THE_SET, self.law, gains)


def recommend(
    scenario: Mapping[str, Any], folder: Path, options: ChoiceOptions, command: str
) -> tuple[Recommendation, Tuned]:
    """Search the front of each law, fly a candidate of each with many draws, and rank them.

    Args:
        scenario: options of a `Scenario`, without law and gains.
        folder: that exists, for the gains of the candidates.
        options: of the choice.
        command: the user's command, for the files' headers.

    Returns:
        The choice, and the gains from which the search began.

    Raises:
        InputError: the scenario cannot be flown, or it has no such law.
    """
    names = tuple(dict.fromkeys(options.laws)) or tuple(sorted(laws()))
    for_tuning = {key: scenario[key] for key in TUNED if key in scenario}
    tuned = _tuned(for_tuning, str(scenario.get("case", WITHOUT_PAYLOAD)))
    write_set(tuned, command, folder / TUNED_SET)
    points, gains = tuned_points(tuned), f"{folder}/{TUNED_SET}"
    for law in names:
        kind = find_law(Law.parse(law).controller)
        if "=" not in law and kind.name not in points:
            raise InputError(f"law {law}: has no tuned gains: give some, {law}=GAINS")
    search = _Search(dict(scenario), gains, points, options)
    nominal = Scenario(**search.scenario_with(names[0])).check()
    known = nominal.scenario.robots.controller
    friction = coefficients(known, nominal.plant_settings.friction)[: known.n]
    if (duration := nominal.ticks * nominal.period) < SHORTEST_S:
        raise InputError(f"a choice needs {SHORTEST_S:g} s of flight or more, got {duration:g} s")
    search = replace(
        search,
        torques=largest_torques(nominal),
        friction=friction,
        duration=min(duration, max(options.trial_s, fast_at(nominal))),
        controls_base=nominal.controls_base,
    )
    searched = _searched(search, names)
    fronts = {front.law: front for front in searched}
    out: dict[str, str] = {}
    candidates = []
    for law, front in zip(names, searched, strict=True):
        controller = Law.parse(law).controller
        tried = front.within(options.ripple)
        if tried is None:
            out[front.law] = front.why_none()
            continue
        point = search.space(law).at(tried.point)
        where = write_gains(controller, point, folder, command, tried.score)
        candidates.append(Candidate(front.law, controller, point, tried.score, f"{where}/"))
    study = candidates_study(scenario, nominal, options.uncertainty)
    with counting_progress("flights of the candidates") as begin:
        flown = fly_candidates(
            study, candidates, options.criterion, options.runs, options.seed, options.workers, begin
        )
    criterion = CRITERIA[options.criterion]
    order = ranked(flown, criterion)
    out |= {each.law: each.reason for each in flown if each.reason}
    compared = comparisons(order, criterion) if order else []
    found_law = Recommendation(
        dict(scenario), options, fronts, flown, order, compared, out, study.vary
    )
    return found_law, tuned


def _searched(search: _Search, names: Sequence[str]) -> list[Front]:
    """Return the front of each law; a progress line counts their gain sets."""
    options = search.options
    with ScratchFolder() as folder:
        tally = Path(folder) / "tried"
        tally.touch()
        with watching_progress(
            "gain sets tried", options.evaluations * len(names), lambda: tally.stat().st_size
        ):
            workers = min(options.workers, len(names))
            return run_all(replace(search, tally=str(tally)), names, workers)


def _tuned(options: Mapping[str, Any], case: str) -> Tuned:
    """Tune for a case; where its payload leaves no margin at all, for the robot without one."""
    try:
        return tuned_set(options, [case], INITIAL_TUNING, lambda text: None)
    except InputError:
        if case == WITHOUT_PAYLOAD:
            raise
        return tuned_set(options, [WITHOUT_PAYLOAD], INITIAL_TUNING, lambda text: None)


def has_estimate(law: str) -> bool:
    """Return True if a law has an estimate behind the low-pass of the set."""
    kind = find_law(law)
    return "h_bar" in kind.gain_descriptions() or kind.estimates_with_model


def largest_torques(flight: Flight) -> dict[str, float]:
    """Return the largest torque that a mission asks of each group of axes, N m or N."""
    scenario = flight.scenario
    demand = force_demand(scenario.robots.controller, scenario.mission, [scenario.plant])
    columns = AnalysedLog(empty_log(flight, 0, 1, is_brief=True)).torque_columns
    return {name: float(np.mean(demand.peak[axes])) for name, axes in columns.items()}


def fast_at(flight: Flight) -> float:
    """Return when the joints, or the base, are first about as fast as ever in a mission, s."""
    scenario = flight.scenario
    motion = sampled_reference(scenario.robots.controller, scenario.mission)
    joints, base = motion.joints[:, 1], motion.base[:, 4:7]
    speed = np.linalg.norm(joints if joints.any() else base, axis=1)
    first = int(np.argmax(speed >= FAST * speed.max(initial=0.0)))
    return min(first * SAMPLING, LONGEST_TRIAL_S)


def candidates_study(
    scenario: Mapping[str, Any], nominal: Flight, uncertainty: Uncertainty
) -> Study:
    """Return the campaign of the candidates, without laws of its own."""
    own = any(not np.isnan(joint.coulomb) for joint in nominal.robot.friction)
    return Study(
        scenario=dict(scenario), laws=[nominal.law.name], vary=uncertainty.vary(own_friction=own)
    )


def tuned_points(tuned: Tuned) -> dict[str, GainPoint]:
    """Return the gains of a tuned set by law."""
    return {law: GainPoint(own.gains, tuned.corner_hz) for law, own in tuned.laws.items()}


@dataclass(frozen=True)
class _Search:
    """Searches the front of a law; it can be sent to other processes."""

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
        options = self.options
        trials = Trials(
            Scenario(**{**self.scenario_with(law), "duration": self.duration}),
            options.uncertainty,
            self.torques,
            CRITERIA[options.criterion],
        )

        def note(count: int) -> None:
            with Path(self.tally).open("ab") as file:
                file.write(bytes(count))

        return search_front(
            trials,
            self.space(law),
            options.ripple,
            options.evaluations,
            options.seed,
            (1.0,) if options.is_short else SHARES_OF_RIPPLE,
            note,
        )

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
        return SearchSpace(
            find_law(controller),
            start,
            self.friction,
            self.controls_base,
            has_estimate(controller),
            self.options.is_short,
        )
