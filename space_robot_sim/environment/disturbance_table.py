"""A user's own disturbance as a table of time: its columns, and what is wrong with them.

Columns are ``time`` (s, rising from 0 or later), the force on the base (N) and the torque on it
(N m), both on the axes of the base's frame and at its centre of mass, and the torque (N m,
prismatic joints: N) on joints with motors, by the joints' names. Those that are missing are zero.
Between two rows the numbers are linear, before the first and after the last row they are zero.

As text it is JSON, a list of numbers by column: so the text holds all its numbers.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from functools import lru_cache
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.config.columns import missing_column, read_columns
from space_robot_msgs_py.config.text import choices, parse_json
from space_robot_msgs_py.config.validation import short
from space_robot_msgs_py.errors import InputError

Array = NDArray[np.float64]

TIME = "time"
BASE = tuple(f"base_{kind}_{axis}" for kind in ("force", "torque") for axis in "xyz")
"""Columns of the wrench on the base."""
MOST_VALUES = 50_000
"""Largest number of values, those of ``time`` included: a bag holds all of them."""
LARGEST = 1e12
"""Largest size of a value, N, N m or s."""
JSON = "{"
"""Begin of a text that holds the numbers; any other text is a path."""


class DisturbanceTable(NamedTuple):
    """A checked table."""

    columns: dict[str, list[float]]
    """Finite numbers by column, equally many; ``time`` is the first column."""

    @classmethod
    def of(cls, columns: Mapping[str, Sequence[Any]], where: str) -> DisturbanceTable:
        """Check columns; ``where`` names their file, or key, in errors.

        Raises:
            InputError: a column is missing or has no numbers, or the times do not rise.
        """
        if TIME not in columns:
            raise InputError(f"{where}: {missing_column(repr(TIME), [*map(str, columns)])}")
        if len(columns) < 2:
            allowed = ", ".join(BASE)
            raise InputError(f"{where}: {TIME!r} alone: columns are {allowed}, and joints by name")
        checked = {TIME: _numbers(TIME, columns[TIME], where)}
        time = checked[TIME]
        checked |= {
            str(name): _numbers(str(name), values, where)
            for name, values in columns.items()
            if name != TIME
        }
        for name, values in checked.items():
            if len(values) != len(time):
                raise InputError(
                    f"{where}: {name}: {len(time)} values were expected, as many as times, got "
                    f"{len(values)}"
                )
        if len(time) < 2:
            raise InputError(f"{where}: at least 2 rows are needed, got {len(time)}")
        if (count := len(time) * len(checked)) > MOST_VALUES:
            raise InputError(
                f"{where}: {len(time)} rows of {len(checked)} columns are {count} values, at most "
                f"{MOST_VALUES} are allowed: leave out columns of zeros, or rows"
            )
        if time[0] < 0.0:
            raise InputError(f"{where}: {TIME} must begin at 0 s or later, got {time[0]:g} s")
        for before, after in pairwise(time):
            if not before < after:
                raise InputError(f"{where}: {TIME} must rise, got {after:g} s after {before:g} s")
        return cls(checked)

    @staticmethod
    @lru_cache(maxsize=16)
    def parse(text: str) -> DisturbanceTable:
        """Parse the text of a table."""
        try:
            columns = parse_json(text)
        except ValueError as error:
            raise InputError(f"disturbance: not a table as JSON ({error})") from None
        return DisturbanceTable.of(columns, "disturbance")

    @property
    def text(self) -> str:
        """The table as JSON; the same numbers come from it."""
        return json.dumps(self.columns, separators=(",", ":"))

    @property
    def label(self) -> str:
        """The table in a few words."""
        own = [name for name in self.columns if name != TIME]
        names = ", ".join(own[:3]) + (f" and {len(own) - 3} more" if len(own) > 3 else "")
        time = self.columns[TIME]
        return f"{names} from {time[0]:g} to {time[-1]:g} s"

    def loads(self, joint_names: Sequence[str], where: str = "disturbance") -> Array:
        """Return the loads (K, n+6) of the rows: on the base as `BASE`, then on joints with motors.

        ``where`` names the table's file, or key, in errors.
        """
        names = [*BASE, *joint_names]
        loads = np.zeros((len(self.columns[TIME]), len(names)))
        for name, values in self.columns.items():
            if name == TIME:
                continue
            if name not in names:
                raise InputError(f"{where}: unknown column {name!r}: {choices(name, names)}")
            loads[:, names.index(name)] = values
        return loads


def table_text(text: str, folder: Path = Path()) -> str:
    """Return a table as text: the ``text`` itself, or the table of the file that it names.

    A relative path begins in ``folder``; an empty text is none.
    """
    if not text.strip() or text.startswith(JSON):
        return text
    path = folder / text
    if path.suffix not in (".csv", ".parquet"):
        raise InputError(f"disturbance {short(text)}: a .csv or .parquet file was expected")
    return DisturbanceTable.of(read_columns(path), str(path)).text


def check_table_text(text: str) -> str:
    """Check the text of a table without opening a file, and return it."""
    if text.startswith(JSON):
        DisturbanceTable.parse(text)
    return text


def _numbers(name: str, values: Any, where: str) -> list[float]:
    if not isinstance(values, (list, tuple)):
        raise InputError(f"{where}: {name}: a list of numbers was expected, got {short(values)}")
    for row, value in enumerate(values, 1):
        is_number = isinstance(value, (int, float)) and not isinstance(value, bool)
        if not is_number or not abs(value) <= LARGEST:
            raise InputError(
                f"{where}: {name}: row {row}: a number of at most {LARGEST:g} was expected, "
                f"got {short(value)}"
            )
    return [float(value) for value in values]
