"""Output of a replay: counts, first difference, differences by axis; torques as CSV and figure."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from rich.console import Console

from space_robot_msgs_py.bag.law_history import in_words

from ..analysis.words import flown as flown_words
from ..console.files import csv_rows, csv_writer
from ..console.tables import Column, Table, named
from ..console.terminal import print_table, say

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from ..flight.replay.comparison import Comparison

COUNTS = {
    "played": "states replayed",
    "compared": "commands compared",
    "equal": "equal to the last bit",
    "unanswered": "recorded, not answered now",
    "unrecorded": "answered now, not recorded",
    "without_state": "recorded without their state",
    "skipped": "not answered in flight, left out",
}
ALWAYS = ("played", "compared", "equal")
MOST_STRETCHES = 10
"""Maximum number of stretches of a damaged bag that are shown."""


def print_replay(report: dict[str, Any], console: Console) -> None:
    """Print the report of `run.Replay`."""
    say(console, title(report))
    print_table(Table.of("", (named(), Column()), counts(report)), console)
    for text in filter(None, (report["unfinished"], *report["damage"])):
        say(console, text)
    if not report["whole"] and len(report["stretches"]) > 1:
        _print_stretches(report["stretches"], console)
    if (first := report["first_difference"]) and report["differs"]:
        _print_first(first, console)
    if not report["identical"] and report["compared"]:
        _print_axes(report, console)
        for reason in report["reasons"] if report["judged"] else ():
            say(console, f"may differ: {reason}")
    if report["passed"]:
        say(console, verdict(report))


def title(report: dict[str, Any]) -> str:
    """Return a title: the bag replayed and the law that answered."""
    now = report["replayed"]
    law, swaps = now["controller"], ""
    if now["as_in_flight"]:
        law = in_words(report["recorded"]["laws"])
    elif now["swaps"]:
        swaps = f", swaps {' '.join(now['swaps'])}"
    changed = "".join(f", {name}={value}" for name, value in now["set"].items())
    law = f"{law}, gains {now['gains']}{swaps}{changed}"
    return f"replay of {report['bag']}: {law}"


def counts(report: dict[str, Any]) -> list[tuple[str, str]]:
    """Return name and value of each row of the table; rare rows are left out if zero."""
    rows = [(words, str(report[k])) for k, words in COUNTS.items() if k in ALWAYS or report[k]]
    for key, words in (("recorded", "in the bag"), ("replayed", "now")):
        if number := report["unreadable"][key]:
            rows.append((f"commands {words} that cannot be read", str(number)))
    rate = report["ticks_per_s"]
    return [*rows, ("ticks/s", "-" if rate is None else f"{rate:.0f}")]


def verdict(report: dict[str, Any]) -> str:
    """Return the outcome in one line."""
    flown, first = report["recorded"], report["first_difference"]
    if not report["has_commands"]:
        return "the bag has no commands to compare with"
    if report["identical"] and (report["whole"] or not report["judged"]):
        return "the commands are the recorded ones, to the last bit"
    if not report["judged"]:
        return (
            f"{flown_words(flown)} was flown: the differences are what the other would have "
            "commanded on the same history (open loop)"
        )
    if first and report["differs"]:
        when = f"tick {first['tick']} (t = {first['time_s']:.4f} s)"
        return f"the commands are not the recorded ones: they differ from {when} on"
    if first:
        gap = report["first_gap_s"]
        before = "the commands before it are the recorded ones, to the last bit; " if gap else ""
        return (
            f"the bag is not whole, from t = {gap:.4f} s on: {before}after a gap the controller "
            "was not sent all that it was sent in flight"
        )
    if not report["whole"]:
        return (
            "the bag is not whole: the commands that are left are the recorded ones, to the last "
            "bit, but some are missing"
        )
    return "the commands are equal as far as they can be compared, but some are missing"


def _print_stretches(stretches: list[dict[str, Any]], console: Console) -> None:
    shown = stretches[:MOST_STRETCHES]
    rows = [[s["from_s"], s["to_s"], str(s["compared"]), str(s["equal"])] for s in shown]
    more = "" if len(stretches) == len(shown) else f" (the first {len(shown)} of {len(stretches)})"
    times = Column("from, s", spec=".4f"), Column("to, s", spec=".4f")
    columns = *times, Column("compared"), Column("equal")
    print_table(Table.of(f"whole stretches of the bag{more}", columns, rows), console)


def _print_first(first: dict[str, Any], console: Console) -> None:
    title = f"first difference: tick {first['tick']}, t = {first['time_s']:.4f} s"
    columns = (named("field"), Column("recorded"), Column("replayed"), Column("by", spec=".3g"))
    rows = []
    for field in first["fields"]:
        by = "" if field["difference"] is None else field["difference"]
        rows.append([field["field"], str(field["recorded"]), str(field["replayed"]), by])
    print_table(Table.of(title, columns, rows), console, dense=True)  # all digits in 80 columns


def _print_axes(report: dict[str, Any], console: Console) -> None:
    names = ("RMS recorded", "RMS replayed", "RMS of difference", "largest difference")
    columns = named("axis"), *(Column(name, spec=".4g") for name in names)
    rows = []
    for axis, values in report["axes"].items():
        unit, *numbers = values.values()
        rows.append([axis if unit == "N m" else f"{axis} ({unit})", *numbers])
    print_table(Table.of("torque, N m, over the ticks compared", columns, rows), console)


def write_csv(comparison: Comparison, period: float, path: Path) -> None:
    """Write a row per tick: tick, time in s, torque of each axis in N m or N."""
    ticks, recorded, replayed = comparison.table()
    names = [
        f"{axis}_{which}" for which in ("recorded", "replayed") for axis in comparison.axis_names
    ]
    numbers = np.column_stack([(ticks * period).round(9), recorded, replayed])
    with csv_writer(path, replace=True) as writer:
        writer.writerow(["tick", "time_s", *names])
        writer.writerows(csv_rows(ticks, numbers))


def torque_figure(comparison: Comparison, period: float, title: str) -> Figure:
    """Plot the recorded and the replayed torque of every axis over time."""
    from ..analysis.figures import style  # slow to import

    ticks, recorded, replayed = comparison.table()
    time, names = ticks.astype(np.float64) * period, comparison.axis_names
    with style.house_style():
        figure = style.page(14.0 + 48.0 * math.ceil(len(names) / 3), title)
        panels = style.grid(figure, len(names), 3, shared=False)
        for index, (axes, name) in enumerate(zip(panels, names, strict=True)):
            both = np.column_stack([recorded[:, index], replayed[:, index]])
            style.plot_lines(axes, time, both, dashed=True)
            axes.set_title(style.plain(name))
            unit = comparison.units[index]
            axes.set(xlabel="time (s)", ylabel="force (N)" if unit == "N" else f"torque ({unit})")
        style.legend_above(figure, ("recorded", "replayed"), dashed=True)
    return figure
