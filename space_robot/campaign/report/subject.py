"""What a report is about: a campaign's file, rows and software."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import yaml

from space_robot_msgs_py.errors import InputError

from ..flown import FlownCampaign
from ..flown.current_table import recover_table
from .other_study import judged_by

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
