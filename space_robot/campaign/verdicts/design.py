"""Effect of a campaign's design on its rows: which are independent, which belong together."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from .values import measured, of_law

if TYPE_CHECKING:
    from pandas import DataFrame

Array = NDArray[np.float64]

SALTELLI = "saltelli"


def variables(table: DataFrame) -> list[str]:
    """Return the names of all variables of a table, in the file's order."""
    names = (str(column) for column in table)
    return [name.removeprefix("vary.") for name in names if name.startswith("vary.")]


def independent_rows(table: DataFrame, design: str) -> DataFrame:
    """Return the rows that are independent draws, for verdicts and quantiles.

    In a Saltelli design these are the points A and B: the runs between differ from A in only one
    variable. In other designs these are all rows.

    Args:
        table: rows of the campaign.
        design: its design.
    """
    if design != SALTELLI:
        return table
    step = len(variables(table)) + 2
    return table[table["run"].mod(step).isin((0, step - 1))]


def saltelli_values(table: DataFrame, law: str, column: str) -> Array:
    """Return a column for `sobol.sobol_indices`, (rows, d + 2); NaN for runs not flown yet.

    Args:
        table: rows of a campaign with the design ``saltelli``.
        law: as in the table.
        column: such as ``metric.attitude.rms``.
    """
    rows, step = of_law(table, law), len(variables(table)) + 2
    count = int(rows["run"].max()) // step + 1 if len(rows) else 0
    matrix = np.full(count * step, np.nan)
    matrix[rows["run"].to_numpy()] = measured(rows, column)
    return matrix.reshape(count, step)
