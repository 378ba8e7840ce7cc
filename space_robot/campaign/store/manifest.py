"""Manifest of a campaign: all that its rows depend on, so that rows are never mixed."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import numpy as np
from pydantic import Field

from space_robot_msgs_py.config.validation import StrictModel, short
from space_robot_msgs_py.errors import InputError

from ..row.row import Row
from ..study import NOT_TO_BE_EXTENDED

if TYPE_CHECKING:
    from pandas import DataFrame

NEW_FOLDER = "choose another folder for this one"


class Columns(StrictModel):
    """The columns of a campaign's table, in order."""

    vary: dict[str, Literal["float64", "str"]]
    """Kind of each variable."""
    grid: dict[str, int]
    """Number of values of each grid variable."""
    metrics: list[str]
    require: list[str]
    bands: list[str]

    def table(self, rows: Iterable[Row]) -> DataFrame:
        """Return rows as a data frame: missing numbers are NaN, missing bands None."""
        import pandas

        rows = list(rows)
        table: dict[str, Any] = {
            "run": np.array([row.task.run for row in rows], np.int64),
            "law": [row.task.law for row in rows],
            "outcome": [row.outcome for row in rows],
            "reason": [row.reason for row in rows],
            "ended_at_s": np.array([row.ended_at_s for row in rows], float),
        }
        for name, kind in self.vary.items():
            values = [row.vary.get(name) for row in rows]
            is_text = kind == "str"
            table[f"vary.{name}"] = (
                [None if value is None else str(value) for value in values]
                if is_text
                else np.array(values, float)
            )
        for name in self.metrics:
            table[f"metric.{name}"] = np.array([row.metrics.get(name) for row in rows], float)
        for name in self.require:
            table[f"require.{name}"] = np.array([row.require.get(name) for row in rows], float)
        for name in self.bands:
            bands = [row.bands.get(name) for row in rows]
            table[f"band.{name}"] = pandas.Series(bands, dtype=object)
        return pandas.DataFrame(table | {"digest": [row.digest for row in rows]})


class Manifest(StrictModel):
    """The campaign of a folder."""

    seed: Annotated[int, Field(ge=0)]
    runs: Annotated[int, Field(ge=1)]
    """Number of runs to be flown."""
    study: dict[str, Any]
    """Content of the campaign's file without ``runs``."""
    software: dict[str, str | None]
    """Version of each package that the rows depend on, and a digest of the sources."""
    commit: str | None
    """Commit, for information; the digest of the sources is what is compared."""
    files: dict[str, str]
    """Digests of the files that the campaign's file refers to, by name."""
    flights: dict[str, str]
    """Digest of the nominal flight of each law."""
    table: Columns

    def check_same(self, other: Manifest, where: Path) -> None:
        """Check that ``other`` is the same campaign, possibly with more runs.

        Args:
            other: manifest of the campaign to be flown now.
            where: the folder, for the error.

        Raises:
            InputError: the first difference, in one line.
        """
        for what, before, now in (
            ("seed", self.seed, other.seed),
            ("file", self.study, other.study),
            ("software", self.software, other.software),
            ("named file", self.files, other.files),
            ("flight", self.flights, other.flights),
            ("columns", self.table.model_dump(), other.table.model_dump()),
        ):
            for key, old, new in differences(before, now):
                raise InputError(
                    f"{where}: was started with another {what}: {key + ': ' if key else ''}"
                    f"{short(old)} then, {short(new)} now: {NEW_FOLDER}"
                )
        if other.runs == self.runs:
            return
        begun = f"{where}: was started with {self.runs} runs, {other.runs} are requested"
        if other.runs < self.runs:
            raise InputError(f"{begun}: request {self.runs} or more, or {NEW_FOLDER}")
        if (design := self.study.get("design")) in NOT_TO_BE_EXTENDED:
            raise InputError(f"{begun}, and a {design} design cannot be extended: {NEW_FOLDER}")
        if self.study.get("fixed_runs"):
            raise InputError(f"{begun}, but its file has fixed_runs: true: {NEW_FOLDER}")


def differences(before: Any, now: Any, key: str = "") -> Iterator[tuple[str, Any, Any]]:
    """Yield the keys whose values differ, with both values; None for a missing one.

    The order of the variables (``vary``) is compared, too: the draws depend on it.
    """
    if isinstance(before, Mapping) and isinstance(now, Mapping):
        for name in dict.fromkeys((*before, *now)):
            inner = f"{key}.{name}" if key else str(name)
            yield from differences(before.get(name), now.get(name), inner)
        is_ordered = key.rpartition(".")[2] == "vary"
        if is_ordered and list(before) != list(now) and sorted(before) == sorted(now):
            yield f"order of {key}", ", ".join(before), ", ".join(now)
    elif before != now:
        yield key, before, now
