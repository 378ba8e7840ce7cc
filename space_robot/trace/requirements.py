"""The file of requirements: the text of each, and the evidence that is to verify it."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, field_validator, model_validator
from typing_extensions import Self

from space_robot_msgs_py.config.arguments import path_text
from space_robot_msgs_py.config.files import named_file
from space_robot_msgs_py.config.validation import StrictModel, read_yaml, validate

from ..analysis.measure import Window
from ..campaign.study import Condition, RequirementId

METHODS = ("flight", "campaign", "test", "analysis", "inspection")
Conditions = Annotated[list[Condition], Field(min_length=1)]


class FlightEvidence(StrictModel):
    """A flight in this process, by the options of `Scenario`, and conditions on its metrics."""

    scenario: dict[str, Any] = Field(default_factory=dict)
    require: Conditions


class CampaignEvidence(StrictModel):
    """A study, by path or name of ``config/campaigns``, and one of its requirements."""

    study: str
    requirement: str
    law: str | None = None
    """As in the study; None: all laws."""
    runs: Annotated[int, Field(ge=1)] | None = None
    """None: those of the study."""
    seed: Annotated[int, Field(ge=0)] = 0


class AnalysisEvidence(StrictModel):
    """A command with ``--json``, and conditions on its numbers."""

    command: Annotated[str, Field(pattern=r"^space-robot \S.* --json\b")]
    """``{scratch}`` stands for a folder that is deleted afterwards."""
    require: Conditions
    """Each ``metric`` is a path in the JSON, such as ``laws.ctc.loop_radius``."""

    @field_validator("require", mode="after")
    @classmethod
    def _has_no_window(cls, require: list[Condition]) -> list[Condition]:
        if any(condition.window != Window() for condition in require):
            raise ValueError("numbers of a command have no from_s and to_s")
        return require


class Inspection(StrictModel):
    """What a person has seen; nothing computes it."""

    by: str
    date: Annotated[str, Field(pattern=r"^\d{4}-\d{2}-\d{2}$")]
    words: str


class TracedRequirement(StrictModel):
    """A requirement, verified by exactly one of `METHODS`."""

    text: str
    rationale: str = ""
    allocated_to: Literal["flight_software"] | None = None
    """None: the whole system."""
    flight: FlightEvidence | None = None
    campaign: CampaignEvidence | None = None
    test: Annotated[str, Field(pattern=r"^tests/\S+\.py::\S")] | None = None
    """Node of pytest in this project."""
    analysis: AnalysisEvidence | None = None
    inspection: Inspection | None = None

    @model_validator(mode="after")
    def _has_one_method(self) -> Self:
        if sum(getattr(self, name) is not None for name in METHODS) != 1:
            raise ValueError(f"exactly one of {', '.join(METHODS)} was expected")
        return self

    @property
    def evidence(self) -> tuple[str, Any]:
        """One of `METHODS`, and the content of that key."""
        contents = ((name, getattr(self, name)) for name in METHODS)
        return next(pair for pair in contents if pair[1] is not None)

    @property
    def source(self) -> str:
        """Where the evidence comes from, in a line."""
        if self.test:
            return self.test
        keys = self.evidence[1].model_dump(exclude_defaults=True, exclude={"require", "words"})
        return ", ".join(f"{k} {v}" for k, v in {**keys.pop("scenario", {}), **keys}.items())


class RequirementSet(StrictModel):
    """Content of a file of requirements, which have their identifiers as keys."""

    title: str = "Requirements"
    requirements: Annotated[dict[RequirementId, TracedRequirement], Field(min_length=1)]


def read_requirements(path: str | Path) -> RequirementSet:
    """Read a file of requirements, by path or by a name of ``config/requirements``.

    Raises:
        InputError: in one line, naming file and key.
    """
    file = named_file("requirements", path_text(path, "path"))
    return validate(RequirementSet, read_yaml(file), str(file))
