"""A campaign that was flown: its table, its verdicts, and any of its flights again."""

from __future__ import annotations

from functools import cached_property
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

from typing_extensions import Self

from space_robot_msgs_py.bag.blocks import blocks_of
from space_robot_msgs_py.config.arguments import as_path
from space_robot_msgs_py.config.validation import one_of
from space_robot_msgs_py.errors import InputError

from ...scenario.in_process import fly_in_process
from ..row.fly import RowFlyer
from ..row.row import Task
from ..store.folder import MANIFEST, STUDY, TABLE
from ..store.manifest import Manifest, read_manifest
from ..store.software import software
from ..store.table import read_table
from ..study import Study, read_study
from ..verdicts.requirements import Verdict, verdicts
from .again import FlownAgain

if TYPE_CHECKING:
    from pandas import DataFrame


class FlownCampaign:
    """What is in a campaign's folder."""

    def __init__(
        self, folder: Path, temporary: TemporaryDirectory[str] | None = None, kept: int = 0
    ) -> None:
        """Read the folder's manifest.

        Args:
            folder: of the campaign.
            temporary: the same, if it is to go with this object.
            kept: flights that were there when it was flown on.

        Raises:
            InputError: no campaign is there.
        """
        if not (folder / MANIFEST).is_file():
            raise InputError(f"{folder}: is no campaign's folder (it has no {MANIFEST})")
        self.folder, self.kept, self._temporary = folder, kept, temporary
        self.manifest: Manifest = read_manifest(folder / MANIFEST)

    @classmethod
    def open(cls, folder: str | Path) -> Self:
        """Return the campaign that was flown into a folder, to its end or not.

        Raises:
            InputError: no campaign is there.
        """
        return cls(as_path(folder, "folder"))

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
        """The campaign's file."""
        return read_study((self.folder / STUDY).absolute())

    @cached_property
    def table(self) -> DataFrame:
        """All rows: a flight each, by run, then by law.

        Raises:
            InputError: it cannot be read.
        """
        return read_table(self.folder / TABLE)

    @cached_property
    def verdicts(self) -> list[Verdict]:
        """What the table says about each requirement, law by law."""
        return verdicts(self.table, self.study)

    def rerun(self, run: int, law: str | None = None, bag: str | Path | None = None) -> FlownAgain:
        """Fly a row's flight again, to the same bits, with its whole log.

        Args:
            run: number of the run.
            law: as the campaign's file has it; None: its first.
            bag: folder to record to, which must not be there yet.

        Raises:
            InputError: there is no such row, or its draws make no flight.
        """
        task = Task(run, one_of(law or self.study.laws[0], self.study.laws, "law"))
        table = self.table
        rows = table[(table["run"] == task.run) & (table["law"] == task.law)]
        if rows.empty:
            raise InputError(f"run {run}: {self.folder} has no row of it under {task.law}")
        flyer = RowFlyer.of(self.study, self.seed, self.runs)
        flight = flyer.draws.scenario(task.run, task.law).check()
        flown = fly_in_process(flight, None if bag is None else Path(bag))
        row = flyer.row_of_log(task, flight, flown.ending, blocks_of(flown.log))
        return FlownAgain(
            flown, task, row.digest, rows.iloc[0]["digest"],
            [
                f"{name} {then or 'none'}, now {software()[name] or 'none'}"
                for name, then in self.manifest.software.items() if then != software().get(name)
            ],
        )  # fmt: skip

    def __repr__(self) -> str:
        laws = ", ".join(self.study.laws)
        return f"<FlownCampaign: {self.folder}, {len(self.table)} flights of {laws}>"
