"""The option ``disturbance``: a file, columns of numbers, or a function of time."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from inspect import isclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from space_robot_msgs_py.config.arguments import as_positive
from space_robot_msgs_py.config.validation import short
from space_robot_msgs_py.errors import InputError
from space_robot_sim.environment.disturbance_table import BASE, TIME, DisturbanceTable

PERIOD_S = 0.01
"""Period at which a function is sampled, s."""
Columns = dict[str, list[float]]
Load = Callable[[float], Mapping[str, float] | ArrayLike]


def sampled(function: Load, duration: float, period: float = PERIOD_S) -> Columns:
    """Return the columns of a disturbance that is given as a function of time.

        sr.Scenario(disturbance=sr.sampled(lambda t: {"base_torque_z": 0.1 * t}, duration=5.0))

    Args:
        function: of the time (s); returns numbers by column, see `DisturbanceTable`, or 6 numbers:
            force (N) and torque (N m) on the base, base frame.
        duration: s; the last row is at or just after it.
        period: s between two rows, between which the numbers are linear.

    Raises:
        InputError: a number is not above 0, or the function returns something else.
    """
    duration, period = as_positive(duration, "duration"), as_positive(period, "period")
    count = math.ceil(duration / period - 1e-6) + 1
    times = [k * period for k in range(count)]
    rows = [_row(function(time), time) for time in times]
    names = list(dict.fromkeys(name for row in rows for name in row))
    columns = {TIME: times, **{name: [row.get(name, 0.0) for row in rows] for name in names}}
    return DisturbanceTable.of(columns, "disturbance").columns


def as_disturbance(value: Any) -> str | Columns | Load:
    """Accept a path, columns or a function, for pydantic.

    Raises:
        ValueError: it is something else, or a column is wrong.
    """
    if isinstance(value, Mapping):
        columns = {str(name): _listed(numbers) for name, numbers in value.items()}
        return DisturbanceTable.of(columns, "columns").columns
    if callable(value) and not isclass(value):
        function: Load = value
        return function
    if isinstance(value, str) or hasattr(value, "__fspath__"):
        return str(value)
    raise ValueError("a CSV or Parquet file, columns (a mapping) or a function was expected")


def table_parameters(disturbance: str | Columns | Load) -> dict[str, str]:
    """Return the parameter of the plant for an option; none of a function, which is sampled."""
    if callable(disturbance) or not disturbance:
        return {}
    if isinstance(disturbance, str):
        return {"disturbance.table": disturbance}
    return {"disturbance.table": DisturbanceTable(disturbance).text}


def _row(value: Any, time: float) -> dict[str, float]:
    """Return the numbers of a function by column."""
    returned = f"disturbance: the function returned {short(value)}"
    is_list = isinstance(value, Sequence) and not isinstance(value, str)
    is_array = isinstance(value, np.ndarray) and value.ndim > 0
    if (is_list or is_array) and len(value) == len(BASE):
        value = dict(zip(BASE, value, strict=True))
    if not isinstance(value, Mapping):
        raise InputError(
            f"{returned} at {time:g} s; a mapping of numbers by column, or {len(BASE)} numbers "
            f"({', '.join(BASE)}), was expected"
        )
    row = {}
    for name, number in value.items():
        is_number = isinstance(number, (int, float)) or getattr(number, "shape", 0) == ()
        row[str(name)] = float(number) if is_number and np.isrealobj(number) else math.nan
        if not math.isfinite(row[str(name)]):
            raise InputError(f"{returned} at {time:g} s; a number was expected for {name}")
    return row


def _listed(numbers: Any) -> Any:
    if hasattr(numbers, "tolist"):
        return numbers.tolist()
    return list(numbers) if isinstance(numbers, (tuple, range)) else numbers
