"""The columns of a campaign's table, in order."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field

from space_robot_msgs_py.config.validation import StrictModel

from ..row.row import Row, Task

Kind = Literal["int64", "float64", "str", "float32s"]


class Schema(StrictModel):
    """Definition of the columns of a campaign's table."""

    vary: dict[str, Literal["float64", "str"]]
    """Kind of each variable."""
    grid: dict[str, int]
    """Number of values of each grid variable."""
    metrics: list[str]
    require: list[str]
    bands: list[str]
    bins: Annotated[int, Field(ge=1)]
    """Number of bins of a band; a row without band has a null."""

    def columns(self) -> Iterator[tuple[str, Kind]]:
        """Yield name and kind of each column."""
        yield from (("run", "int64"), ("law", "str"), ("outcome", "str"), ("reason", "str"))
        yield "ended_at_s", "float64"
        yield from ((f"vary.{name}", kind) for name, kind in self.vary.items())
        yield from ((f"metric.{name}", "float64") for name in self.metrics)
        yield from ((f"require.{name}", "float64") for name in self.require)
        yield from ((f"band.{name}", "float32s") for name in self.bands)
        yield "digest", "str"

    def values(self, row: Row) -> Iterator[Any]:
        """Yield a row's value for each column; None where it has none."""
        yield from (row.task.run, row.task.law, row.outcome, row.reason, row.ended_at_s)
        for name, kind in self.vary.items():
            value = row.vary.get(name)
            yield str(value) if kind == "str" and value is not None else value
        yield from (row.metrics.get(name) for name in self.metrics)
        yield from (row.require.get(name) for name in self.require)
        yield from (row.bands.get(name) for name in self.bands)
        yield row.digest

    def row(self, values: Mapping[str, Any]) -> Row:
        """Return the row with the given values by column name."""

        def known(group: str, names: Iterable[str]) -> dict[str, Any]:
            group_values = {name: values[f"{group}.{name}"] for name in names}
            return {name: value for name, value in group_values.items() if value is not None}

        bands = known("band", self.bands)
        return Row(
            Task(values["run"], values["law"]),
            values["outcome"],
            values["reason"],
            values["ended_at_s"],
            known("vary", self.vary),
            known("metric", self.metrics),
            known("require", self.require),
            {name: np.array(band, np.float32) for name, band in bands.items()},
            values["digest"],
        )
