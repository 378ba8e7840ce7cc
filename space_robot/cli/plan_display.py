"""The plan of a mission on a terminal."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from rich.console import Console

from ..console.tables import Column, JudgedCell, Table
from ..console.terminal import say
from ..console.terminal_tables import print_table

SEGMENTS = (
    Column("segment", is_label=True),
    Column("end", "s", ".2f"),
    Column("tool", "m", ".3f"),
    Column("torque", "N m", ".3g"),
    Column("momentum", "N m s", ".3g"),
    Column("σ held", "", ".2g"),
    Column("σ free", "", ".2g"),
)
SIGMA = (
    "σ: smallest singular value of the tool's Jacobian, with the base's attitude held and with a "
    "free base; its rows of translation are divided by the tool's distance from the base"
)
STORED = Column("at its end", "N m s", ".3g")
"""Momentum at the end of a segment, shown where there is any: at rest without an orbit it is zero.
"""
NO_MOMENTUM = 1e-9
"""N m s."""
SOURCES = (
    Column("given for", is_label=True),
    Column("torque", "N m", ".3g"),
    Column("momentum", "N m s", ".3g"),
    Column("at the end", "N m s", ".3g"),
)
ACTUATORS = (
    Column("actuators", is_label=True),
    Column("torque", "%", ".0f"),
    Column("momentum", "%", ".0f"),
    Column("feasible", is_label=True),
)

MANY = 1e3
"""Share from which a percentage is printed as a power of ten."""


def print_plan(report: Mapping[str, Any], console: Console) -> None:
    """Print the report of `space_robot.analysis.mission_plan.plan_report`."""
    has_ends = any(s["momentum_end"] > NO_MOMENTUM for s in report["segments"])
    rows = [
        (
            f"{s['segment']} {s['motion']}",
            s["begin_s"] + s["duration_s"],
            s["tool_travel_m"],
            s["base_torque"],
            s["momentum"],
            *([s["momentum_end"]] if has_ends else []),
            s["singular_value"],
            s["free_singular_value"],
        )
        for s in report["segments"]
    ]
    columns = (*SEGMENTS[:5], STORED, *SEGMENTS[5:]) if has_ends else SEGMENTS
    print_table(Table.of("", columns, rows), console)
    say(console, SIGMA)
    if len(report["sources"]) > 1:
        sources = {**report["sources"], "all, without unloading": report}
        rows = [
            (name.replace("_", " "), of["base_torque"], of["momentum"], of["momentum_end"])
            for name, of in sources.items()
        ]
        print_table(Table.of("", SOURCES, rows), console)
    judged = [
        (
            a["actuators"],
            _percent(a["torque"]),
            _percent(a["momentum"]),
            JudgedCell("", "yes" if a["is_feasible"] else "no", _tone(a["is_feasible"])),
        )
        for a in report["actuators"]
    ]
    print_table(Table.of("", ACTUATORS, judged), console)
    say(
        console,
        f"{report['duration_s']:.2f} s; largest base torque {report['base_torque']:.3g} N m, "
        f"largest momentum {report['momentum']:.3g} N m s",
    )
    if margins := report["joints"]:
        say(console, f"joints nearest to their limits: {', '.join(_margins(margins))}")
    for key, words in (("before", "before"), ("lightened", "in the same time, with lighter paths")):
        if other := report.get(key):
            say(
                console,
                f"{words}: {other['duration_s']:.2f} s, {other['base_torque']:.3g} N m, "
                f"{other['momentum']:.3g} N m s",
            )


def _percent(share: float) -> float | str:
    return 100.0 * share if not share >= MANY else f"{100.0 * share:.1e}"


def _margins(margins: Mapping[str, Mapping[str, Any]]) -> Iterator[str]:
    for kind, margin in margins.items():
        where = f"{margin['joint']} at {margin['time_s']:.2f} s"
        yield f"{kind} {100.0 * margin['share']:.0f} % ({where})"


def _tone(is_good: bool) -> str:
    return "good" if is_good else "bad"
