"""Campaigns from Python.

campaign = Campaign.load("my.yaml").run(runs=10_000, seed=7, out="campaigns/a")
campaign.table, campaign.verdicts, campaign.rerun(4711).log
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import yaml

from space_robot_msgs_py.config.validation import short, validate
from space_robot_msgs_py.config.yaml_text import read_file
from space_robot_msgs_py.errors import InputError

from ...processes.pool import check_scheduler, cores
from ...processes.scratch_folder import ScratchFolder
from ..store.folder import MANIFEST, begin_or_resume, held_folder
from ..store.recovery import open_journal
from ..store.table import check_tables
from ..study import Study, read_study
from .bags import fly_bags
from .current_table import WRITTEN, write_if_older
from .flights import Flights, Progress
from .flown_campaign import FlownCampaign
from .preparation import Preparation


class Campaign:
    """Campaign: flights of a study's variations under each of its laws."""

    def __init__(self, study: Study) -> None:
        """Take a study; what it names is looked up by `run`.

        Raises:
            InputError: it is none.
        """
        if not isinstance(study, Study):
            raise InputError(
                f"study: a Study was expected, got {short(study)}; "
                "Campaign.load reads a file, Campaign.of a mapping"
            )
        self.study = study
        self._text = ""

    @classmethod
    def load(cls, path: str | Path) -> Campaign:
        """Read a campaign's file, by its path or by a name of ``config/campaigns``.

        Raises:
            InputError: in one line, naming file and key.
        """
        campaign = cls(read_study(path))
        campaign._text = read_file(Path(campaign.study.where))
        return campaign

    @classmethod
    def of(cls, content: Mapping[str, Any]) -> Campaign:
        """Take what would be in a campaign's file: ``{"laws": ["ctc"], "vary": {...}}``.

        Raises:
            InputError: in one line, naming the key.
        """
        is_mapping = isinstance(content, Mapping)
        return cls(validate(Study, dict(content) if is_mapping else content, "campaign"))

    def run(
        self,
        runs: int | None = None,
        seed: int = 0,
        out: str | Path | None = None,
        workers: int | None = None,
        scheduler: str | None = None,
        timeout_s: float | None = None,
        progress: Callable[[Progress], object] | None = None,
        warn: Callable[[str], object] = warnings.warn,
    ) -> FlownCampaign:
        """Fly the campaign, or its remaining flights, and write its table.

        What is in the table depends on file, seed, runs and software alone: not on workers, nor on
        how often it was interrupted. Ctrl-C (KeyboardInterrupt) leaves the table of what is done.

        Args:
            runs: draws of all that is varied, each flown by every law; None: as the file says.
            seed: of all draws.
            out: the campaign's folder; the same one again resumes. None: a temporary one, which
                lasts as long as what is returned.
            workers: processes that fly; 0: this one; None: one a processor.
            scheduler: address of a Dask scheduler whose workers fly instead.
            timeout_s: longest wall-clock time of a flight; its row says ``out_of_time`` then.
            progress: called at the beginning and after each flight.
            warn: called with each line on what was damaged in the folder; what is lost is flown
                again.

        Raises:
            InputError: something cannot be flown; the folder holds something else; disk full.
        """
        check_tables()
        asked = Preparation.of(self.study, seed, runs)
        manifest = asked.manifest
        temporary = None if out is not None else ScratchFolder()
        folder = Path(temporary.name if temporary else str(out))
        if scheduler is not None and not (folder / MANIFEST).exists():
            check_scheduler(scheduler)  # else the folder would be begun for nothing
        with held_folder(folder):
            damage = begin_or_resume(folder, manifest, self._text or as_yaml(self.study))
            journal, damage_of_rows = open_journal(folder, manifest)
            with journal:
                for line in (*damage, *damage_of_rows):
                    warn(line)
                flights = Flights(asked.flyer, asked.runs, journal)
                processes = cores() if workers is None else workers
                options = {"workers": processes, "scheduler": scheduler, "timeout_s": timeout_s}
                try:
                    if not flights.are_complete:
                        asked.compile()
                        journal.make_note(WRITTEN, "")  # until it has the rows to come
                        flights.fly(progress or (lambda _: None), options)
                finally:  # whatever ended it: the rows that there are have their table
                    runs_of_table = flights.precision.stop
                    write_if_older(folder, journal, manifest, runs_of_table)
                fly_bags(folder, asked.flyer, journal, runs_of_table, processes)
        return FlownCampaign(folder, True, temporary, flights.kept)


def as_yaml(study: Study) -> str:
    """Write a study as a campaign's file."""
    content = study.model_dump(by_alias=True, exclude_defaults=True)
    return yaml.safe_dump(content, sort_keys=False, allow_unicode=True)
