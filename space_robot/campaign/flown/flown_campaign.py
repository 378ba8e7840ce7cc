"""A flown campaign: its table, its verdicts, and reruns of its flights."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

import numpy as np
from typing_extensions import Self

from space_robot_control.laws.names import (
    NotTrustedError,
    require_shipped_file,
    require_shipped_law,
)
from space_robot_msgs_py.config.arguments import as_path, as_whole_number
from space_robot_msgs_py.config.installation import install_command
from space_robot_msgs_py.config.text import html_table
from space_robot_msgs_py.config.validation import one_of, validate
from space_robot_msgs_py.errors import InputError

from ...api import FlownFlight, Scenario
from ...api.flown_flight import fly_in_process
from ...console.files import atomic_file, write_text
from ..row.fly import RowFlyer
from ..row.row import Task
from ..study import Law, Study
from ..verdicts.requirements import Verdict, verdicts
from .flights import Precision
from .manifest import Manifest, all_texts, software
from .store import DATABASE, STUDY, open_store, study_changes

if TYPE_CHECKING:
    from pandas import DataFrame


class FlownCampaign:
    """A flown campaign, read from its folder."""

    def __init__(
        self,
        folder: Path,
        trust: bool = False,
        temporary: TemporaryDirectory[str] | None = None,
        kept: int = 0,
    ) -> None:
        """Read the manifest, see `open`; a ``temporary`` folder is deleted with this object.

        ``kept``: number of flights that existed when the campaign was resumed.
        """
        self.folder, self.kept, self._trust, self._temporary = folder, kept, trust, temporary
        with open_store(folder) as store:
            manifest = store.manifest
        if manifest is None:
            raise InputError(f"{folder}: no flight has been flown yet")
        self.manifest: Manifest = manifest

    @classmethod
    def open(cls, folder: str | Path, trust: bool = False) -> Self:
        """Open the campaign in a folder, complete or not.

        Args:
            folder: of the campaign; it may come from anyone.
            trust: allow `rerun` to import each ``module:Class`` and read each file it refers to.

        Raises:
            InputError: it is not a campaign folder, or its store is damaged.
        """
        return cls(as_path(folder, "folder"), trust)

    @property
    def seed(self) -> int:
        """Seed of all draws."""
        return self.manifest.seed

    @property
    def runs(self) -> int:
        """Number of requested runs; the table may have fewer."""
        return self.manifest.runs

    @cached_property
    def study(self) -> Study:
        """The study that was flown, even if ``study.yaml`` was changed since."""
        where = str(self.folder / DATABASE)
        return validate(Study, self.manifest.study, f"{where}: study").named(where)

    @property
    def study_changes(self) -> str:
        """Difference of ``study.yaml`` from the study that was flown, in a line; or empty."""
        return study_changes(self.folder / STUDY, self.study.content)

    @cached_property
    def table(self) -> DataFrame:
        """All rows, one per flight, ordered by run, then by law.

        Raises:
            InputError: the store cannot be read, or is damaged.
        """
        columns, laws = self.manifest.table, self.study.laws
        precision = Precision(self.study, self.runs, columns.grid)
        with open_store(self.folder) as store:
            rows = sorted(store.rows(), key=lambda row: (row.task.run, laws.index(row.task.law)))
        for row in rows:
            precision.add(row)
        return columns.table(row for row in rows if row.task.run < precision.stop)

    def export(self, path: str | Path) -> None:
        """Write the table as Parquet or, without the bands, as CSV, by the suffix of ``path``.

        Raises:
            InputError: another suffix, the file exists or cannot be written, or pyarrow is missing.
        """
        file = as_path(path, "path")
        one_of(file.suffix, (".parquet", ".csv"), "suffix", f" of {file}")
        table = self.table
        if file.suffix == ".csv":
            is_band = [str(name).startswith("band.") for name in table]
            text = table.loc[:, np.invert(is_band)].to_csv(index=False, lineterminator="\n")
            write_text(text, file)
            return
        try:
            import pyarrow  # noqa: F401
        except ImportError:
            raise InputError(f"{file}: needs pyarrow: {install_command('parquet')}") from None
        with atomic_file(file) as opened:
            table.to_parquet(opened, engine="pyarrow", index=False)

    @cached_property
    def verdicts(self) -> list[Verdict]:
        """Verdicts on each requirement, for each law and grid point."""
        return verdicts(self.table, self.study, self.runs, list(self.manifest.table.grid))

    def scenario(self, run: int, law: str | None = None) -> Scenario:
        """Return the scenario of a run, with its draws, under a law (None: the first).

        Raises:
            InputError: there is no such law, or the draws cannot be flown.
            NotTrustedError: an untrusted campaign refers to a module or a file, see `open`.
        """
        if not self._trust:
            check_study(self.study)
        law = one_of(law or self.study.laws[0], self.study.laws, "law")
        return self._flyer.draws.scenario(as_whole_number(run, "run", 0, self.runs - 1), law)

    def row_with(self, flight: FlownFlight, run: int, law: str) -> DataFrame:
        """Return a flight as a row of this campaign's table, to be appended to it.

            found.scenario(3).bench() ... found.row_with(bench.flown(), run=3, law="by hand")

        ``run`` is the one whose draws it flew, ``law`` its name in that column.

        Raises:
            InputError: the flight has no log or other columns, or a metric's function fails.
        """
        columns, run = self.manifest.table, as_whole_number(run, "run", 0, self.runs - 1)
        row = self._flyer.measured_row(Task(run, law), flight.flight, flight.ending, flight.log)
        if other := sorted(set(row.metrics) - set(columns.metrics)):
            raise InputError(f"the flight has {other[0]}, which is no column of {self.folder}")
        return columns.table([row])

    @property
    def _flyer(self) -> RowFlyer:
        return RowFlyer.of(self.study, self.seed, self.runs)

    def rerun(self, run: int, law: str | None = None, bag: str | Path | None = None) -> Rerun:
        """Fly a row's flight again, bit for bit, and return its complete log.

        ``law`` None: the file's first; ``bag``: folder to record to, which must not exist. Errors
        are those of `scenario`, and there may be no such row.
        """
        if not self._trust:
            check_study(self.study)
        task = Task(run, one_of(law or self.study.laws[0], self.study.laws, "law"))
        table = self.table
        rows = table[(table["run"] == task.run) & (table["law"] == task.law)]
        if rows.empty:
            raise InputError(f"run {run}: {self.folder} has no row of this run under {task.law}")
        flyer = self._flyer
        flight = flyer.draws.scenario(task.run, task.law).check()
        flown = fly_in_process(flight, None if bag is None else Path(bag))
        row = flyer.measured_row(task, flight, flown.ending, flown.log)
        return Rerun(
            flown,
            task,
            row.digest,
            rows.iloc[0]["digest"],
            [
                f"{name} {then or 'none'}, now {software()[name] or 'none'}"
                for name, then in self.manifest.software.items()
                if then != software().get(name)
            ],
        )

    def __repr__(self) -> str:
        laws = ", ".join(self.study.laws)
        return f"<FlownCampaign: {self.folder}, {len(self.table)} flights of {laws}>"

    def _repr_html_(self) -> str:
        heads = ("requirement", "law", "point", "verdict", "met", "at least", "at most")
        rows = [
            [
                verdict.requirement,
                verdict.law,
                verdict.point,
                verdict.word,
                f"{verdict.met} of {verdict.runs}",
                f"{verdict.limits.low:.4f}",
                f"{verdict.limits.high:.4f}",
            ]
            for verdict in self.verdicts
        ]
        return html_table(heads, rows, repr(self)[1:-1])


CAMPAIGN = "campaign"


def check_study(study: Study) -> None:
    """Check that a study refers to shipped modules and files only.

    Raises:
        NotTrustedError: it refers to another one.
    """
    controller = study.scenario.get("parameters", {}).get("controller", {})
    named = [Law.parse(law).controller for law in study.laws]
    for name in (*named, *filter(None, [controller.get("controller")])):
        require_shipped_law(str(name), CAMPAIGN)
    laws = [Law.parse(law).gains for law in study.laws]
    for text in all_texts([laws, study.scenario, study.vary]):
        require_shipped_file("value of an option", text, CAMPAIGN)
    if study.metrics:
        raise NotTrustedError(
            f"the {CAMPAIGN} has metrics of its own ({', '.join(study.metrics)}): --trust imports "
            "their functions, which runs their code"
        )


def needs_trust(study: Study) -> bool:
    """Return True if flights of a study are flown again with ``--trust`` only."""
    try:
        check_study(study)
    except NotTrustedError:
        return True
    return False


class Rerun(FlownFlight):
    """A flight flown again, compared with its row in the campaign's table."""

    def __init__(
        self,
        flown: FlownFlight,
        task: Task,
        digest: str,
        row_digest: str,
        other_software: Sequence[str],
    ) -> None:
        """Store a flight with its digest, that of its row (empty: not flown), and differences.

        ``other_software``: differences from the software that flew the campaign.
        """
        super().__init__(flown.flight, flown.ending, flown.bag, flown.log)
        self.task, self.digest, self.row_digest = task, digest, row_digest
        self._other_software = other_software

    @property
    def is_same(self) -> bool:
        """True if flight and row have the same digest: then they are equal bit for bit."""
        return self.digest == self.row_digest

    @property
    def verdict(self) -> str:
        """Result of the comparison in a line."""
        if self.is_same:
            return f"same digest as the row: {self.digest}"
        if not self.row_digest:
            return "the row has no digest: its flight was refused, killed or out of time"
        why = "; ".join(self._other_software) or "the software is the same, check the machine"
        return f"digest {self.digest} differs from the row's {self.row_digest} ({why})"
