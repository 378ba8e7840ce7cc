"""The choice of a law for a robot, its hardware and its mission."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
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
from .candidates import Candidate, FlownCandidate, comparisons, fly_candidates, select
from .criteria import CRITERIA
from .front import Front
from .gain_files import install, write_gains
from .law_search import TUNED_SET, ChoiceOptions, LawSearch, has_estimate, prepare
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
            return "No law flies this mission within these limits."
        criterion, best = CRITERIA[self.options.criterion], self.order[0]
        number = f"{best.median(criterion.value):.3g} in the median of {len(best.flights)} draws"
        if not self.compared:
            only = f", the only one of {len(self.fronts)} laws within limits" if self.out else ""
            return f"Fly {best.law}{only}: {criterion.text} is {number}."
        by_finding: dict[str, list[str]] = {}
        for each in self.compared:
            by_finding.setdefault(each.finding, []).append(each.other)
        fit = f"of {len(self.order)} laws within the limits"
        parts = [f"Fly {best.law}: {fit} it has the least {criterion.text} ({number})"]
        if worse := by_finding.get("better"):
            ratio = next(1.0 / c.ratio.value for c in self.compared if c.other == worse[0])
            parts.append(f"{worse[0]} has {ratio:.3g} times as much")
        if alike := by_finding.get("alike"):
            parts.append(f"{' and '.join(alike)} cannot be told from it")
        if rivals := by_finding.get("worse"):
            parts.append(f"{' and '.join(rivals)} had less in most draws")
        return f"{'; '.join(parts)}."

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
            if not has_estimate(law):
                files.append(searched if law in own else tuned)
            elif set_folder.name == TUNED_SET:
                files.append(tuned)
            elif own.get(law) == own[self.law]:
                files.append(searched)
        return install(files, set_folder / SET_FILE, self.law, gains)


def recommend(
    scenario: Mapping[str, Any], folder: Path, options: ChoiceOptions, command: str
) -> Recommendation:
    """Search the front of each law, fly a candidate of each with many draws, and rank them.

    Args:
        scenario: options of a `Scenario`, without law and gains.
        folder: for the gains of the candidates.
        options: of the choice.
        command: the user's command, for the files' headers.

    Raises:
        InputError: the scenario cannot be flown, or it has no such law.
    """
    criterion = CRITERIA[options.criterion]
    with ScratchFolder() as place:
        search, nominal, tuned = prepare(scenario, Path(place), options, command)
        fronts = {front.law: front for front in search.fronts()}
        candidates = {
            front.law: own
            for name, front in zip(search.laws, fronts.values(), strict=True)
            if (own := _candidates(search, name, front, Path(place)))
        }
        out = {f.law: f.why_none(options.goal) for f in fronts.values() if f.law not in candidates}
        errors = {law: first.score.error for law, (first, *_) in candidates.items()}
        by_error = sorted(errors, key=errors.__getitem__)
        for law in by_error[FEWEST:]:
            if (ratio := errors[law] / errors[by_error[0]]) > FAR:
                out[law] = f"{ratio:.3g} times the least error in trials"
        study = candidates_study(scenario, nominal, options.uncertainty)

        def fly(some: Sequence[Candidate], runs: int, seed: int) -> list[FlownCandidate]:
            for each in some:
                write_gains(each.controller, each.gains, Path(each.folder), command, each.score)
            with counting_progress("batches of flights of the candidates") as begin:
                how = options.criterion, runs, seed, options.workers, begin
                return fly_candidates(study, some, *how)

        waiting = {law: iter(own) for law, own in candidates.items() if law not in out}
        by_law, order = select(waiting, fly, criterion, options.runs, options.seed)
    flown, laws_ranked = list(by_law.values()), {each.law for each in order}
    too_far = f"more than {criterion.near:g} times the least error"
    out |= {each.law: each.reason or too_far for each in flown if each.law not in laws_ranked}
    write_set(tuned, command, folder / TUNED_SET)
    for law, (first, *_) in candidates.items():
        last = by_law[law].candidate if law in by_law else first
        write_gains(last.controller, last.gains, folder / law, command, last.score)
    compared = comparisons(order, criterion) if order else []
    return Recommendation(dict(scenario), options, fronts, flown, order, compared, out, study.vary)


def _candidates(search: LawSearch, name: str, front: Front, place: Path) -> list[Candidate]:
    """Return a law's gain sets of least error with the ripple allowed and with less."""
    ripple = search.options.ripple
    sets = {id(t): t for share in QUIETER if (t := front.within(share * ripple))}
    controller, space = Law.parse(name).controller, search.space(name)
    allowed = {torque: ripple * largest for torque, largest in search.torques.items()}
    return [
        Candidate(front.law, controller, space.at(t.point), t.score, folder, allowed)
        for number, t in enumerate(sets.values())
        for folder in [f"{place}/{front.law}.{number}/"]
    ]


def candidates_study(
    scenario: Mapping[str, Any], nominal: Flight, uncertainty: Uncertainty
) -> Study:
    """Return the campaign of the candidates, without laws of its own."""
    own = any(not np.isnan(joint.coulomb) for joint in nominal.robot.friction)
    return Study(
        scenario=dict(scenario), laws=[nominal.law.name], vary=uncertainty.vary(own_friction=own)
    )
