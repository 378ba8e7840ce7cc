"""Input of a report: a campaign's file, rows and software."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import yaml

from space_robot_msgs_py.config.validation import short
from space_robot_msgs_py.errors import InputError

from ...analysis.measure import Window
from ..flown import FlownCampaign
from ..flown.current_table import recover_table
from ..store.manifest import differences
from ..study import Requirement, Study

if TYPE_CHECKING:
    from pandas import DataFrame

    from ..study import Study


@dataclass(frozen=True)
class Subject:
    """The campaign of a report."""

    folder: Path
    """Path as the user wrote it, for the commands in the report."""
    study: Study
    seed: int
    runs: int
    """Number of requested runs."""
    table: DataFrame
    """The flown rows."""
    grid: Sequence[str] = ()
    """Names of the grid variables."""
    about: Mapping[str, str] = field(default_factory=dict)
    """Versions and digests, by name."""
    remarks: Sequence[str] = ()
    """One line for each damaged file and each difference from the study that was flown."""

    @property
    def text(self) -> str:
        """Return the text of the campaign's file."""
        content = self.study.model_dump(mode="json", by_alias=True, exclude_defaults=True)
        return yaml.safe_dump(content, sort_keys=False, allow_unicode=True, width=110)

    @property
    def time_s(self) -> float:
        """Return the duration of the completed flights, s; 0 if there are none."""
        complete = self.table.loc[self.table["outcome"] == "complete", "ended_at_s"]
        return float(complete.max()) if len(complete) else 0.0


def subject_of(campaign: FlownCampaign, study: Study | None = None) -> Subject:
    """Read the input of a report: all rows that have been flown.

    Args:
        campaign: the flown campaign.
        study: with the requirements to judge (None: the study that was flown).

    Raises:
        InputError: the table cannot be read, is empty, or lacks a metric that ``study`` requires.
    """
    manifest = campaign.manifest
    try:
        remarks = recover_table(campaign.folder, manifest, campaign.study)
    except InputError as error:  # in use by another process, or read-only: used as it is
        remarks = [str(error)]
    if campaign.table.empty:
        raise InputError("; ".join([f"{campaign.folder}: no flight has been flown yet", *remarks]))
    table = campaign.table
    if study is not None:
        table = judged_by(study, table, campaign.study)
        remarks.append(f"The requirements are those of {study.where}.")
    elif changes := campaign.study_changes:
        remarks.append(f"{changes}; what was flown counts")
    about = {name: text for name, text in manifest.software.items() if text}
    if manifest.commit:
        about["commit"] = manifest.commit
    about |= {f"digest of {name}": digest[:16] for name, digest in manifest.files.items()}
    return Subject(
        campaign.folder,
        study or campaign.study,
        campaign.seed,
        campaign.runs,
        table,
        list(manifest.table.grid),
        about,
        remarks,
    )


FLOWN = ("scenario", "laws", "vary", "design")
"""Keys of a study that its flights depend on."""


def judged_by(study: Study, table: DataFrame, flown: Study) -> DataFrame:
    """Return the table with the requirements of another study.

    Args:
        study: with the new requirements.
        table: of the campaign.
        flown: the study that was flown.

    Raises:
        InputError: the study has other flights, or requires a metric in a window that the rows do
            not have.
    """
    now, then = study.content, flown.content
    for part in FLOWN:
        for key, old, new in differences(then[part], now[part], part):
            raise _other(study, key, old, new)
    for name, function in study.metrics.items():
        if function != (was := flown.metrics.get(name)):
            raise _other(study, f"metrics.{name}", was, function)
    known = {_measured(demand): f"require.{name}" for name, demand in flown.require.items()}
    columns = {}
    for name, demand in study.require.items():
        metric, window = _measured(demand)
        column = known.get((metric, window), f"metric.{metric}" if window == Window() else "")
        if column not in table:
            raise InputError(
                f"{study.where}: require.{name}: the rows have no {metric} in that window; they "
                f"have {', '.join(_words(*measured) for measured in known)}, and the metrics of "
                "whole flights"
            )
        columns[f"require.{name}"] = table[column]
    others = [column for column in table if not str(column).startswith("require.")]
    return table[others].assign(**columns)


def _other(study: Study, key: str, flown: Any, now: Any) -> InputError:
    return InputError(
        f"{study.where}: {key}: {short(flown)} was flown, not {short(now)}: fly the new study"
    )


def _measured(demand: Requirement) -> tuple[str, Window]:
    return demand.metric, Window(demand.from_s, demand.to_s)


def _words(metric: str, window: Window) -> str:
    end = "its end" if window.to_s is None else f"{window.to_s:g} s"
    return f"{metric} from {window.from_s:g} s to {end}"
