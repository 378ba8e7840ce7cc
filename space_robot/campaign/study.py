"""The file of a campaign: flights, variables and requirements."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Annotated, Any, Literal, NamedTuple

from pydantic import Field, PrivateAttr, ValidationInfo, field_validator, model_validator
from typing_extensions import Self

from space_robot_msgs_py.config.arguments import path_text
from space_robot_msgs_py.config.files import named_file
from space_robot_msgs_py.config.text import choices
from space_robot_msgs_py.config.validation import StrictModel, read_yaml, short, validate
from space_robot_msgs_py.errors import InputError, explained_by

from ..analysis.analysed_log import PointingBudget
from ..analysis.measure import Window, describe
from ..analysis.own_metric import check_names, importable_text
from ..scenario.objects import as_disturbance
from ..scenario.options import OPTIONS
from ..scenario.resolve import resolve
from ..scenario.scenario import Scenario

Design = Literal["independent", "latin_hypercube", "sobol", "saltelli"]
NOT_TO_BE_EXTENDED = ("latin_hypercube", "saltelli")
"""Designs in which every run depends on the number of runs."""
MOST_RUNS = 10_000_000
NOT_SETTABLE = {
    "controller": "use laws",
    "seed": "each run has its own, derived from --seed",
    "plant_robot": "vary robot.*",
    "compression": "a campaign's bags use the recorder's default",
    "split_size": "a campaign's bags use the recorder's default",
    **{
        name: "only graphs of nodes have it"
        for name, option in OPTIONS.items()
        if option.needs_graph
    },
}
"""Options of a flight that a study cannot set, and the reason or alternative."""


class Law(NamedTuple):
    """A control law with a gain set."""

    controller: str
    gains: str

    @classmethod
    def parse(cls, text: str) -> Law:
        """Parse ``LAW`` or ``LAW=GAINS``."""
        controller, _, gains = text.partition("=")
        return cls(controller, gains or "default")


def short_names(laws: Sequence[str]) -> dict[str, str]:
    """Return the name of each law in tables: without gain set, if all laws have the same."""
    sets = {Law.parse(law).gains for law in laws}
    return {law: Law.parse(law).controller if len(sets) == 1 else law for law in laws}


RequirementId = Annotated[str, Field(pattern=r"^[A-Za-z][A-Za-z0-9_.-]*$")]
"""Identifier of a requirement in a file of requirements, such as ``PNT-001``."""


class Condition(StrictModel):
    """A bound on a metric in a time window."""

    metric: Annotated[str, Field(min_length=1)]
    from_s: Annotated[float, Field(ge=0.0)] = 0.0
    to_s: float | None = None
    """None: to the end of the flight."""
    below: float | None = None
    above: float | None = None

    @model_validator(mode="after")
    def _makes_sense(self) -> Self:
        if (self.below is None) is (self.above is None):
            raise ValueError("either below or above is needed, and not both")
        if self.to_s is not None and not self.from_s < self.to_s:
            raise ValueError(f"to_s must be later than from_s ({self.from_s:g} s)")
        return self

    @property
    def bound(self) -> float:
        """Bound of the metric."""
        bound = self.above if self.below is None else self.below
        assert bound is not None
        return bound

    @property
    def window(self) -> Window:
        """Time window of the metric."""
        return Window(self.from_s, self.to_s)

    @property
    def sign(self) -> float:
        """1 if a larger metric is worse, -1 if a smaller one is."""
        return 1.0 if self.above is None else -1.0

    def __str__(self) -> str:
        way = "below" if self.above is None else "above"
        end = "" if self.to_s is None else f" to {self.to_s:g} s"
        window = f" from {self.from_s:g} s{end}" if self.from_s or end else ""
        unit = describe(self.metric).unit.strip("-").replace("share", "")
        return f"{self.metric} {way} {f'{self.bound:g} {unit}'.rstrip()}{window}"

    def is_met(self, value: float) -> bool:
        """Return True if a flight's value meets the bound; False for NaN."""
        return self.sign * value < self.sign * self.bound


class Requirement(Condition):
    """A condition to be met by a share of all runs."""

    share: Annotated[float, Field(gt=0.0, lt=1.0, alias="in")]
    """Share of the runs that must meet the bound."""
    confidence: Annotated[float, Field(gt=0.0, lt=1.0)] = 0.9
    id: RequirementId | None = None
    """Identifier in a file of requirements."""

    def __str__(self) -> str:
        share, confidence = 100.0 * self.share, 100.0 * self.confidence
        demand = super().__str__()
        return f"{demand} in {share:g} % of the cases, with {confidence:g} % confidence"


class Keep(StrictModel):
    """Data kept of each flight in addition to its row."""

    bag: Literal["never", "on_failure", "always"] = "never"


class Until(StrictModel):
    """Stopping rule: a precision of every requirement's share, and a maximum number of runs."""

    half_width: Annotated[float, Field(gt=0.0, lt=0.5)]
    """Half-width of the confidence interval of the share."""
    runs: Annotated[int, Field(ge=1, le=MOST_RUNS)]


class Study(StrictModel):
    """Content of a campaign's file."""

    scenario: dict[str, Any] = Field(default_factory=dict)
    """Options of `Scenario`, except those of `NOT_SETTABLE`."""
    laws: Annotated[list[str], Field(min_length=1)]
    """Each as ``LAW`` or ``LAW=GAINS``."""
    vary: dict[str, Any] = Field(default_factory=dict)
    """Distribution of each variable, by the variable's name."""
    metrics: dict[str, Any] = Field(default_factory=dict)
    """Function of each metric of the user's own, ``file.py:FUNCTION``, by the metric's name."""
    pointing: PointingBudget = PointingBudget()
    """Band and window of the metrics of the base's pointing."""
    require: dict[str, Requirement] = Field(default_factory=dict)
    keep: Keep = Keep()
    until: Until | None = None
    design: Design = "independent"
    runs: Annotated[int, Field(ge=1, le=MOST_RUNS)] | None = None
    fixed_runs: bool = False
    """True: the number of runs is fixed in advance, and there is one verdict, after the last run.
    False: runs can be added, and verdicts are valid at any time, but need more runs."""

    _where: str = PrivateAttr("campaign")

    @property
    def where(self) -> str:
        """Name of the file, for errors."""
        return self._where

    @field_validator("scenario", mode="after")
    @classmethod
    def _are_options(cls, scenario: dict[str, Any]) -> dict[str, Any]:
        for name in scenario:
            check_option(name)
        if callable(scenario.get("disturbance")):  # numbers can go to any process and file
            sampled = resolve(Scenario(**scenario)).options.disturbance
            return {**scenario, "disturbance": sampled}
        if "disturbance" in scenario:
            return {**scenario, "disturbance": as_disturbance(scenario["disturbance"])}
        return scenario

    @field_validator("laws", mode="after")
    @classmethod
    def _differ(cls, laws: list[str]) -> list[str]:
        for law in laws:
            if not Law.parse(law).controller or law.endswith("="):
                raise ValueError(f"LAW or LAW=GAINS was expected, got {short(law)}")
        if len({Law.parse(law) for law in laws}) < len(laws):
            raise ValueError("the same law twice")
        return laws

    @field_validator("vary", mode="after")
    @classmethod
    def _is_finite(cls, vary: dict[str, Any]) -> dict[str, Any]:
        for name, value in vary.items():
            for number in _numbers(value):
                if not math.isfinite(number):
                    raise ValueError(f"{name}: finite numbers were expected, got {number}")
        return vary

    @field_validator("metrics", mode="after")
    @classmethod
    def _are_functions(cls, metrics: dict[str, Any]) -> dict[str, str]:
        check_names(metrics)
        return {name: importable_text(function) for name, function in metrics.items()}

    @field_validator("until", mode="after")
    @classmethod
    def _needs_require(cls, until: Until | None, info: ValidationInfo) -> Until | None:
        if until and not info.data.get("require"):
            raise ValueError("needs require: the precision is that of requirements")
        return until

    @field_validator("design", mode="after")
    @classmethod
    def _can_stop_early(cls, design: Design, info: ValidationInfo) -> Design:
        if info.data.get("until") and design in NOT_TO_BE_EXTENDED:
            raise ValueError("this design needs all runs and cannot stop early: remove until")
        return design

    @field_validator("fixed_runs", mode="after")
    @classmethod
    def _cannot_stop_early(cls, fixed_runs: bool, info: ValidationInfo) -> bool:
        if fixed_runs and info.data.get("until"):
            raise ValueError("contradicts until, which chooses the number of runs: remove one")
        return fixed_runs

    @property
    def has_fixed_runs(self) -> bool:
        """True if the number of runs cannot be increased after the start."""
        return self.fixed_runs or self.design in NOT_TO_BE_EXTENDED

    def runs_asked(self, runs: int | None = None) -> int:
        """Return the number of runs to fly: ``runs``, or that of the file if it is None.

        Raises:
            InputError: both are None.
        """
        count = runs or self.runs or (self.until and self.until.runs)
        if not count:
            raise InputError(f"{self.where}: runs: missing: set it in the file, or with --runs")
        return count

    @property
    def content(self) -> dict[str, Any]:
        """Return all keys except the number of runs, as JSON data."""
        content: dict[str, Any] = json.loads(self.model_dump_json(by_alias=True))
        del content["runs"]
        return content

    def named(self, where: str) -> Study:
        """Return the same study with the name of its file for errors."""
        copied = self.model_copy()
        copied._where = where
        return copied


def _numbers(value: Any) -> Iterator[float]:
    if isinstance(value, float):
        yield value
    elif isinstance(value, (dict, list)):
        for inner in value.values() if isinstance(value, dict) else value:
            yield from _numbers(inner)


def check_option(name: str) -> None:
    """Check that a study can set an option of `Scenario`.

    Raises:
        ValueError: with the alternative, or with the allowed options.
    """
    if name in NOT_SETTABLE:
        raise ValueError(f"{name} cannot be set: {NOT_SETTABLE[name]}")
    allowed = [option for option in Scenario.model_fields if option not in NOT_SETTABLE]
    if name not in allowed:
        raise ValueError(f"unknown option {short(name)}: {choices(name, allowed)}")


@explained_by("campaign")
def read_study(path: str | Path) -> Study:
    """Read a campaign's file, by path or by a name of ``config/campaigns``.

    Raises:
        InputError: in one line, naming file and key.
    """
    file = named_file("campaigns", path_text(path, "path"))
    return validate(Study, read_yaml(file), str(file)).named(str(file))
