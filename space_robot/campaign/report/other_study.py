"""Rows that were flown for one study, judged by the requirements of another one."""

from __future__ import annotations

from typing import TYPE_CHECKING

from space_robot_msgs_py.config.validation import short
from space_robot_msgs_py.errors import InputError

from ..row.window import Window
from ..store.manifest import differences
from ..study import Requirement, Study

if TYPE_CHECKING:
    from pandas import DataFrame

FLOWN = ("scenario", "laws", "vary", "design")
"""Parts of a study on which its flights depend."""


def judged_by(study: Study, table: DataFrame, flown: Study) -> DataFrame:
    """Return a table whose requirements are those of a study other than the one that was flown.

    Args:
        study: gives the requirements.
        table: of the campaign.
        flown: the study that was flown.

    Raises:
        InputError: the study asks for other flights, or for a metric in a window that the rows do
            not have.
    """
    now, then = study.content, flown.content
    for part in FLOWN:
        for key, old, new in differences(then[part], now[part], part):
            raise InputError(
                f"{study.where}: {key}: {short(old)} was flown, {short(new)} is asked for: fly that"
            )
    known = {_measured(demand): f"require.{name}" for name, demand in flown.require.items()}
    columns = {}
    for name, demand in study.require.items():
        metric, window = _measured(demand)
        column = known.get((metric, window), f"metric.{metric}" if window == Window() else "")
        if column not in table:
            raise InputError(
                f"{study.where}: require.{name}: {metric} in that window is not in the rows; "
                f"there are {', '.join(_words(*measured) for measured in known)}, and the metrics "
                "of whole flights"
            )
        columns[f"require.{name}"] = table[column]
    others = [column for column in table if not str(column).startswith("require.")]
    return table[others].assign(**columns)


def _measured(demand: Requirement) -> tuple[str, Window]:
    return demand.metric, Window(demand.from_s, demand.to_s)


def _words(metric: str, window: Window) -> str:
    end = "its end" if window.to_s is None else f"{window.to_s:g} s"
    return f"{metric} from {window.from_s:g} s to {end}"
