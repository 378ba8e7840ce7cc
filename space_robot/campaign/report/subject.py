"""What a report is about: a campaign's file, rows and software."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import yaml

from space_robot_msgs_py.config.validation import short
from space_robot_msgs_py.errors import InputError

from ..flown import FlownCampaign
from ..flown.current_table import recover_table
from ..row.window import Window
from ..store.manifest import differences
from ..study import Requirement, Study

if TYPE_CHECKING:
    from pandas import DataFrame

    from ..study import Study


@dataclass(frozen=True)
class Subject:
    """The campaign that a report is about."""

    folder: Path
    """As the user wrote it, for the commands that are shown."""
    study: Study
    seed: int
    runs: int
    """That were asked for."""
    table: DataFrame
    """The rows that there are."""
    grid: Sequence[str] = ()
    """Names of the variables that are grids."""
    about: Mapping[str, str] = field(default_factory=dict)
    """Versions and the like, by what they are of."""
    remarks: Sequence[str] = ()
    """On the folder: what is damaged, or differs from what was flown, a line each."""

    @property
    def text(self) -> str:
        """Return the campaign's file, as it was checked."""
        content = self.study.model_dump(mode="json", by_alias=True, exclude_defaults=True)
        return yaml.safe_dump(content, sort_keys=False, allow_unicode=True, width=110)

    @property
    def time_s(self) -> float:
        """Return how long the flights are that came to their end, s; 0 if none did."""
        complete = self.table.loc[self.table["outcome"] == "complete", "ended_at_s"]
        return float(complete.max()) if len(complete) else 0.0


def subject_of(campaign: FlownCampaign, study: Study | None = None) -> Subject:
    """Return what a report on a campaign is about: all rows that have been flown.

    Args:
        campaign: that was flown.
        study: whose requirements are judged (None: of the one that was flown).

    Raises:
        InputError: the table cannot be read, or has no row; or ``study`` cannot be judged by it.
    """
    manifest = campaign.manifest
    try:
        remarks = recover_table(campaign.folder, manifest, campaign.study)
    except InputError as error:  # another process flies it, or it cannot be written: as it is
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
"""Parts of a study on which its flights depend."""


def judged_by(study: Study, table: DataFrame, flown: Study) -> DataFrame:
    """Return a table whose requirements are those of a study other than the one that was flown.

    Args:
        study: gives the requirements.
        table: of the campaign.
        flown: the study that was flown.

    Raises:
        InputError: the study asks for other flights, or for a metric in a window that the rows do
            not have.
    """
    now, then = study.content, flown.content
    for part in FLOWN:
        for key, old, new in differences(then[part], now[part], part):
            raise InputError(
                f"{study.where}: {key}: {short(old)} was flown, {short(new)} is asked for: fly that"
            )
    known = {_measured(demand): f"require.{name}" for name, demand in flown.require.items()}
    columns = {}
    for name, demand in study.require.items():
        metric, window = _measured(demand)
        column = known.get((metric, window), f"metric.{metric}" if window == Window() else "")
        if column not in table:
            raise InputError(
                f"{study.where}: require.{name}: {metric} in that window is not in the rows; "
                f"there are {', '.join(_words(*measured) for measured in known)}, and the metrics "
                "of whole flights"
            )
        columns[f"require.{name}"] = table[column]
    others = [column for column in table if not str(column).startswith("require.")]
    return table[others].assign(**columns)


def _measured(demand: Requirement) -> tuple[str, Window]:
    return demand.metric, Window(demand.from_s, demand.to_s)


def _words(metric: str, window: Window) -> str:
    end = "its end" if window.to_s is None else f"{window.to_s:g} s"
    return f"{metric} from {window.from_s:g} s to {end}"
