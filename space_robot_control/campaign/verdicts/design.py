"""What a campaign's design makes of its rows: points of a grid, rows that count as independent."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..draws.fault_variables import EACH
from .values import measured, of_law

if TYPE_CHECKING:
    from pandas import DataFrame

Array = NDArray[np.float64]

SALTELLI = "saltelli"


def variables(table: DataFrame) -> list[str]:
    """Return the names of all variables of a table, in the file's order."""
    names = (str(column) for column in table)
    return [name.removeprefix("vary.") for name in names if name.startswith("vary.")]


def grid_names(names: Iterable[str], vary: Mapping[str, Any]) -> list[str]:
    """Return the names of the variables that are grids.

    Args:
        names: of all variables of the campaign.
        vary: what its file varies.
    """
    return list(_grids(names, vary))


def grid_points(names: Iterable[str], vary: Mapping[str, Any]) -> int:
    """Return the number of points of the grid; 1 if there is none. Arguments as of `grid_names`."""
    return math.prod(_grids(names, vary).values())


def _grids(names: Iterable[str], vary: Mapping[str, Any]) -> dict[str, int]:
    """Return the number of values of each variable that is a grid."""
    inner = vary.get("faults")
    faults = {f"faults.{key}": v for key, v in inner.items()} if isinstance(inner, dict) else {}
    keys = {**vary, **faults}
    counts = {k: len(v["grid"]) for k, v in keys.items() if isinstance(v, dict) and "grid" in v}
    patterns = {key: _pattern(key) for key in counts}
    values = {}
    for name in names:
        own = [name] if name in keys else [k for k, p in patterns.items() if p.fullmatch(name)]
        for key in counts.keys() & own:
            values[name] = counts[key]
    return values


def _pattern(key: str) -> re.Pattern[str]:
    """Return what the names of the variables of a key look like, elements by their own names."""
    if key.endswith(EACH):
        return re.compile(re.escape(key.removesuffix(EACH)) + ":[^:=]+")
    named = re.sub(r"\\\[[^\]]*\\\]", r"\\[[^\\]]*\\]", re.escape(key))
    return re.compile(named + r"(\[[^\]]*\])?")  # an element that need not be written: all


def independent_rows(table: DataFrame, design: str) -> DataFrame:
    """Return the rows that verdicts and quantiles may take for independent draws.

    Of a Saltelli design these are the points A and B: the runs between share all variables but one
    with A. Other designs keep all.

    Args:
        table: rows of the campaign.
        design: its design.
    """
    if design != SALTELLI:
        return table
    step = len(variables(table)) + 2
    return table[table["run"].mod(step).isin((0, step - 1))]


def saltelli_values(table: DataFrame, law: str, column: str) -> Array:
    """Return a column as `sobol.sobol_indices` takes it, NaN where a run has not been flown.

    Args:
        table: rows of a campaign of the design ``saltelli``.
        law: as in the table.
        column: as in ``metric.attitude_rms``.
    """
    rows, step = of_law(table, law), len(variables(table)) + 2
    count = int(rows["run"].max()) // step + 1 if len(rows) else 0
    found = np.full(count * step, np.nan)
    found[rows["run"].to_numpy()] = measured(rows, column)
    return found.reshape(count, step)
