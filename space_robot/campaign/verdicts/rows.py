"""Rows of a campaign's table by law and grid point, and their numbers with failed flights."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from space_robot_model.elementary.matrices import Array

from ...flight.ending import COMPLETE

if TYPE_CHECKING:
    from pandas import DataFrame

Bools = NDArray[np.bool_]

EXTERNAL = ("killed", "out_of_time", "refused")
"""Outcomes that the law may not have caused; they count as failures nevertheless."""
SALTELLI = "saltelli"


class GridPoint(NamedTuple):
    """The rows of one point of a campaign's grid."""

    values: tuple[str, ...]
    """Values of the grid's variables."""
    point: str
    """Text such as ``sensors = fine``; empty if there is no grid."""
    table: DataFrame


def grid_points(table: DataFrame, grid: Sequence[str]) -> list[GridPoint]:
    """Split a table by the values of the variables ``grid``, in order of appearance."""
    if not grid:
        return [GridPoint((), "", table)]
    points = []
    names = [name.removeprefix("scenario.") for name in grid]
    for key, rows in table.groupby([f"vary.{n}" for n in grid], sort=False, dropna=False):
        values = tuple(f"{v:g}" if isinstance(v, float) else str(v) for v in key)
        point = ", ".join(f"{name} = {v}" for name, v in zip(names, values, strict=True))
        points.append(GridPoint(values, point, rows))
    return points


def laws_in(table: DataFrame) -> list[str]:
    """Return the laws of a table in order of appearance."""
    return [str(law) for law in table["law"].unique()]


def law_rows(table: DataFrame, law: str) -> DataFrame:
    """Return the rows of a law, ordered by run."""
    return table[table["law"] == law].sort_values("run")


def is_complete(table: DataFrame) -> Bools:
    """Return True for each row whose flight reached its planned end."""
    complete: Bools = (table["outcome"] == COMPLETE).to_numpy(bool)
    return complete


def penalised(table: DataFrame, column: str, sign: float = 1.0) -> Array:
    """Return ``sign`` times a column, (N,); infinite if it is missing or the flight failed."""
    values = sign * table[column].to_numpy(np.float64, na_value=np.nan)
    with_failures: Array = np.where(is_complete(table) & ~np.isnan(values), values, np.inf)
    return with_failures


def has_values(table: DataFrame, column: str) -> bool:
    """Return True if any flight of the table has a value in that column."""
    return column in table and bool(np.isfinite(penalised(table, column)).any())


def variables(table: DataFrame) -> list[str]:
    """Return the names of all variables of a table, in the file's order."""
    columns = map(str, table)
    return [name.removeprefix("vary.") for name in columns if name.startswith("vary.")]


def independent_rows(table: DataFrame, design: str) -> DataFrame:
    """Return the rows that are independent draws, for verdicts and quantiles.

    In a Saltelli design these are the points A and B: the runs between differ from A in only one
    variable. In other designs these are all rows.
    """
    if design != SALTELLI:
        return table
    step = len(variables(table)) + 2
    return table[table["run"].mod(step).isin((0, step - 1))]


def saltelli_values(table: DataFrame, law: str, column: str) -> Array:
    """Return a column for `sobol_indices`, (rows, d + 2); NaN for runs not flown yet."""
    rows, step = law_rows(table, law), len(variables(table)) + 2
    count = int(rows["run"].max()) // step + 1 if len(rows) else 0
    matrix = np.full(count * step, np.nan)
    matrix[rows["run"].to_numpy()] = penalised(rows, column)
    return matrix.reshape(count, step)
