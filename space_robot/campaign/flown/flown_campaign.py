"""A campaign that was flown: its table, its verdicts, and any of its flights again."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

from typing_extensions import Self

from space_robot_control.laws.trust import check_file, check_law
from space_robot_msgs_py.bag.blocks import blocks_of
from space_robot_msgs_py.config.arguments import as_path
from space_robot_msgs_py.config.validation import one_of, validate
from space_robot_msgs_py.errors import InputError

from ...api import FlownFlight
from ...api.in_process import fly_in_process
from ..row.fly import RowFlyer
from ..row.row import Task
from ..store.folder import MANIFEST, STUDY, TABLE, study_changes
from ..store.manifest import Manifest, read_manifest
from ..store.software import software, texts_of
from ..store.table import check_table, read_table
from ..study import Law, Study
from ..verdicts.requirements import Verdict, verdicts

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
        """Read the folder's manifest.

        Args:
            folder: of the campaign.
            trust: see `open`.
            temporary: the same, if it is to go with this object.
            kept: flights that were there when it was flown on.

        Raises:
            InputError: no campaign is there, or its manifest is damaged.
        """
        if not (folder / MANIFEST).is_file():
            raise InputError(f"{folder}: is no campaign's folder (it has no {MANIFEST})")
        self.folder, self.kept, self._trust, self._temporary = folder, kept, trust, temporary
        self.manifest: Manifest = read_manifest(folder / MANIFEST)

    @classmethod
    def open(cls, folder: str | Path, trust: bool = False) -> Self:
        """Open the campaign in a folder, complete or not.

        Args:
            folder: of the campaign; it may be anybody's.
            trust: let `rerun` import the ``module:Class`` and read the files that it names.

        Raises:
            InputError: no campaign is there, or its manifest is damaged.
        """
        return cls(as_path(folder, "folder"), trust)

    @property
    def seed(self) -> int:
        """Of all draws."""
        return self.manifest.seed

    @property
    def runs(self) -> int:
        """Runs that were asked for; fewer may be in the table."""
        return self.manifest.runs

    @cached_property
    def study(self) -> Study:
        """The study that was flown, whatever ``campaign.yaml`` says by now."""
        where = str(self.folder / MANIFEST)
        return validate(Study, self.manifest.study, f"{where}: study").named(where)

    @property
    def study_changes(self) -> str:
        """How ``campaign.yaml`` differs from the study that was flown, in a line; or empty."""
        return study_changes(self.folder / STUDY, self.study.content)

    @cached_property
    def table(self) -> DataFrame:
        """All rows: a flight each, by run, then by law.

        Raises:
            InputError: it cannot be read, or is damaged.
        """
        check_table(self.folder / TABLE, self.manifest.campaign)
        return read_table(self.folder / TABLE, self.manifest.table)

    @cached_property
    def verdicts(self) -> list[Verdict]:
        """Verdicts on each requirement, by law."""
        return verdicts(self.table, self.study, self.runs, list(self.manifest.table.grid))

    def rerun(self, run: int, law: str | None = None, bag: str | Path | None = None) -> Rerun:
        """Fly a row's flight again, to the same bits, with its whole log.

        Args:
            run: number of the run.
            law: as the campaign's file has it; None: its first.
            bag: folder to record to, which must not be there yet.

        Raises:
            InputError: there is no such row, or its draws make no flight.
            NotTrustedError: the campaign names a module or a file, and is not trusted, see `open`.
        """
        if not self._trust:
            check_study(self.study)
        task = Task(run, one_of(law or self.study.laws[0], self.study.laws, "law"))
        table = self.table
        rows = table[(table["run"] == task.run) & (table["law"] == task.law)]
        if rows.empty:
            raise InputError(f"run {run}: {self.folder} has no row of it under {task.law}")
        flyer = RowFlyer.of(self.study, self.seed, self.runs)
        flight = flyer.draws.scenario(task.run, task.law).check()
        flown = fly_in_process(flight, None if bag is None else Path(bag))
        row = flyer.row_of_log(task, flight, flown.ending, blocks_of(flown.log))
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


CAMPAIGN = "campaign"


def check_study(study: Study) -> None:
    """Check that a study imports no module and opens no file but those that are shipped.

    Raises:
        NotTrustedError: it names one.
    """
    controller = study.scenario.get("parameters", {}).get("controller", {})
    named = [Law.parse(law).controller for law in study.laws]
    for name in (*named, *filter(None, [controller.get("controller")])):
        check_law(str(name), CAMPAIGN)
    laws = [Law.parse(law).gains for law in study.laws]
    for text in texts_of([laws, study.scenario, study.vary]):
        check_file("value of an option", text, CAMPAIGN)


class Rerun(FlownFlight):
    """A `FlownFlight` that knows whether it is the one of the campaign's table."""

    def __init__(
        self,
        flown: FlownFlight,
        task: Task,
        digest: str,
        digest_of_row: str,
        other_software: Sequence[str],
    ) -> None:
        """Take the flight, what it is of, and its digest and that of the row.

        Args:
            flown: with its log.
            task: run and law.
            digest: of this flight.
            digest_of_row: of the table; empty if the row has no flight.
            other_software: what differs from the software that flew the campaign.
        """
        super().__init__(flown.flight, flown.ending, flown.bag, flown.log)
        self.task, self.digest, self.digest_of_row = task, digest, digest_of_row
        self._other_software = other_software

    @property
    def is_same(self) -> bool:
        """True if the flight has the digest of its row: then it is the same to the last bit."""
        return self.digest == self.digest_of_row

    @property
    def verdict(self) -> str:
        """What there is to say of that, in a line."""
        if self.is_same:
            return f"same digest as the row: {self.digest}"
        if not self.digest_of_row:
            return "the row has no digest: its flight was not flown to an end of its own"
        why = "; ".join(self._other_software) or "the software is the same: is the machine?"
        return f"digest {self.digest} differs from the row's {self.digest_of_row} ({why})"
