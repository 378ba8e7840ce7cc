"""Columns of a campaign's table as numbers that can be ordered, by law and by point of its grid."""

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
"""Outcomes for which a law may be without blame; they count as failures all the same."""


class GridPoint(NamedTuple):
    """The rows of one point of a campaign's grid."""

    values: tuple[str, ...]
    """Of the grid's variables there."""
    point: str
    """It in words, as in ``sensors = fine``; empty if there is no grid."""
    table: DataFrame


def parts(table: DataFrame, grid: Sequence[str]) -> list[GridPoint]:
    """Divide a table by its points of the grid, in the order in which they come.

    Args:
        table: rows of a campaign.
        grid: names of the variables that are grids.
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
    """Return the laws of a table in the order in which they come."""
    return [str(law) for law in table["law"].unique()]


def of_law(table: DataFrame, law: str) -> DataFrame:
    """Return the rows of a law, in the order of its runs."""
    return table[table["law"] == law].sort_values("run")


def ended(table: DataFrame) -> Bools:
    """Tell of each row whether its flight came to its end."""
    is_complete: Bools = (table["outcome"] == COMPLETE).to_numpy(bool)
    return is_complete


def measured(table: DataFrame, column: str) -> Array:
    """Return a column's numbers, infinite where there is none: worse than any number.

    So it is where a flight did not come to its end, whatever the column says.
    """
    values = table[column].to_numpy(np.float64, na_value=np.nan)
    with_failures: Array = np.where(ended(table) & ~np.isnan(values), values, np.inf)
    return with_failures


def turned(table: DataFrame, column: str, sign: float) -> DataFrame:
    """Return a table in which more of a column's numbers is worse: times -1 if ``sign`` is."""
    return table if sign > 0.0 else table.assign(**{column: -table[column].astype(float)})


def is_known(table: DataFrame, column: str) -> bool:
    """Return whether any flight of the table has a number in that column."""
    return column in table and bool(np.isfinite(measured(table, column)).any())


def metrics_of(table: DataFrame) -> list[str]:
    """Return the metrics for which there is a number in the table."""
    names = (str(column) for column in table if str(column).startswith("metric."))
    return [name.removeprefix("metric.") for name in names if is_known(table, name)]


def variables_of(table: DataFrame) -> Iterator[tuple[str, DataFrame]]:
    """Yield the name and the column of each variable that differs from run to run."""
    for column in table:
        if str(column).startswith("vary.") and table[column].nunique(dropna=False) > 1:
            yield str(column).removeprefix("vary."), table[column]
