"""Columns of a campaign's table as sortable numbers, by law and grid point."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...flight.ending import COMPLETE

if TYPE_CHECKING:
    from pandas import DataFrame

Array = NDArray[np.float64]
Bools = NDArray[np.bool_]

NOT_OF_THE_LAW = ("killed", "out_of_time", "refused")
"""Outcomes that the law may not have caused; they count as failures nevertheless."""


class GridPoint(NamedTuple):
    """The rows of one point of a campaign's grid."""

    values: tuple[str, ...]
    """Values of the grid's variables."""
    point: str
    """Text such as ``sensors = fine``; empty if there is no grid."""
    table: DataFrame


def parts(table: DataFrame, grid: Sequence[str]) -> list[GridPoint]:
    """Split a table by grid point, in order of appearance.

    Args:
        table: rows of a campaign.
        grid: names of the grid variables.
    """
    if not grid:
        return [GridPoint((), "", table)]
    columns = [f"vary.{name}" for name in grid]
    parts = []
    for key, rows in table.groupby(columns, sort=False, dropna=False):
        values = tuple(_word(value) for value in key)
        names = (name.removeprefix("scenario.") for name in grid)
        point = ", ".join(f"{name} = {v}" for name, v in zip(names, values, strict=True))
        parts.append(GridPoint(values, point, rows))
    return parts


def _word(value: Any) -> str:
    return f"{value:g}" if isinstance(value, float) else str(value)


def laws_of(table: DataFrame) -> list[str]:
    """Return the laws of a table in order of appearance."""
    return [str(law) for law in table["law"].unique()]


def of_law(table: DataFrame, law: str) -> DataFrame:
    """Return the rows of a law, ordered by run."""
    return table[table["law"] == law].sort_values("run")


def ended(table: DataFrame) -> Bools:
    """Return True for each row whose flight was completed."""
    is_complete: Bools = (table["outcome"] == COMPLETE).to_numpy(bool)
    return is_complete


def measured(table: DataFrame, column: str) -> Array:
    """Return a column's values, (N,); missing ones and those of failed flights are infinite."""
    values = table[column].to_numpy(np.float64, na_value=np.nan)
    with_failures: Array = np.where(ended(table) & ~np.isnan(values), values, np.inf)
    return with_failures


def turned(table: DataFrame, column: str, sign: float) -> DataFrame:
    """Return a table in which larger values of a column are worse: negated if ``sign`` < 0."""
    return table if sign > 0.0 else table.assign(**{column: -table[column].astype(float)})


def is_known(table: DataFrame, column: str) -> bool:
    """Return True if any flight of the table has a value in that column."""
    return column in table and bool(np.isfinite(measured(table, column)).any())


def metrics_of(table: DataFrame) -> list[str]:
    """Return the metrics that have a value in the table."""
    names = (str(column) for column in table if str(column).startswith("metric."))
    return [name.removeprefix("metric.") for name in names if is_known(table, name)]


def variables_of(table: DataFrame) -> Iterator[tuple[str, DataFrame]]:
    """Yield name and column of each variable that is not constant."""
    for column in table:
        if str(column).startswith("vary.") and table[column].nunique(dropna=False) > 1:
            yield str(column).removeprefix("vary."), table[column]
