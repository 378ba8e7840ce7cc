"""The choice of a law for a robot, its hardware and its mission."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from space_robot_control.controller.settings import SET_FILE

from ..campaign.gain_set import write_set
from ..campaign.study import Law, Study
from ..campaign.verdicts.laws import PairedComparison
from ..console.progress import counting_progress
from ..flight.plan import Flight
from ..processes.scratch_folder import ScratchFolder
from ..tuning.method import Tuned
from .candidates import Candidate, FlownCandidate, comparisons, fly_candidates, select
from .criteria import CRITERIA
from .front import Front
from .gain_files import install, write_gains
from .law_search import TUNED_SET, ChoiceOptions, has_estimate, prepare
from .trials import Uncertainty

FAR, FEWEST = 10.0, 4
"""A law with so many times the error of the best one in trials is out, unless it is one of the best
few."""
QUIETER = (1.0, 0.5, 0.25)
"""Shares of the ripple allowed at which a law flies the draws, until it is not out."""


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
        reason = f"of {len(self.flown)} laws it has" if len(self.flown) > 1 else "no other can;"
        text = f"Fly {best.law}: {reason} the least {criterion.text}"
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
            if tuned.name == SET_FILE:
                continue
            if law == self.law or (law in own and not has_estimate(law)):
                files.append(searched)
            elif not has_estimate(law) or set_folder.name == TUNED_SET:
                files.append(tuned)
            elif own.get(law) == own[self.law]:
                files.append(searched)
        return install(files, set_folder / SET_FILE, self.law, gains)


def recommend(
    scenario: Mapping[str, Any], folder: Path, options: ChoiceOptions, command: str
) -> tuple[Recommendation, Tuned]:
    """Search the front of each law, fly a candidate of each with many draws, and rank them.

    Args:
        scenario: options of a `Scenario`, without law and gains.
        folder: for the gains of the candidates.
        options: of the choice.
        command: the user's command, for the files' headers.

    Returns:
        The choice, and the gains from which the search began.

    Raises:
        InputError: the scenario cannot be flown, or it has no such law.
    """
    with ScratchFolder() as place:
        search, nominal, tuned = prepare(scenario, Path(place), options, command)
        names, searched = search.laws, search.fronts()
    write_set(tuned, command, folder / TUNED_SET)
    fronts = {front.law: front for front in searched}
    best = {f.law: tried for f in searched if (tried := f.within(options.ripple))}
    out = {f.law: f.why_none(options.goal) for f in searched if f.law not in best}
    by_error = sorted(best, key=lambda law: best[law].score.error)
    for law in by_error[FEWEST:]:
        if (ratio := best[law].score.error / best[by_error[0]].score.error) > FAR:
            out[law] = f"{ratio:.3g} times the least error in trials"

    def quieter(name: str, front: Front) -> Iterator[Candidate]:
        controller, before = Law.parse(name).controller, None
        for share in QUIETER:
            tried = front.within(share * options.ripple)
            if tried is not None and (before is None or tried.score is not before.score):
                point = search.space(name).at(tried.point)
                where = write_gains(controller, point, folder / front.law, command, tried.score)
                yield Candidate(front.law, controller, point, tried.score, f"{where}/")
            before = tried

    study = candidates_study(scenario, nominal, options.uncertainty)
    criterion = CRITERIA[options.criterion]

    def fly(candidates: Sequence[Candidate], runs: int, seed: int) -> list[FlownCandidate]:
        with counting_progress("flights of the candidates") as begin:
            how = options.criterion, runs, seed, options.workers, begin
            return fly_candidates(study, candidates, *how)

    waiting: dict[str, Iterator[Candidate]] = {}
    for name, front in zip(names, searched, strict=True):
        own = quieter(name, front)
        if front.law in out:
            next(own, None)  # its gain files are written
        else:
            waiting[front.law] = own
    by_law, order = select(waiting, fly, criterion, options.runs, options.seed)
    flown = list(by_law.values())
    out |= {each.law: each.reason for each in flown if each.reason}
    compared = comparisons(order, criterion) if order else []
    choice = Recommendation(
        dict(scenario), options, fronts, flown, order, compared, out, study.vary
    )
    return choice, tuned


def candidates_study(
    scenario: Mapping[str, Any], nominal: Flight, uncertainty: Uncertainty
) -> Study:
    """Return the campaign of the candidates, without laws of its own."""
    own = any(not np.isnan(joint.coulomb) for joint in nominal.robot.friction)
    return Study(
        scenario=dict(scenario), laws=[nominal.law.name], vary=uncertainty.vary(own_friction=own)
    )
