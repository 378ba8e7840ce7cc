"""What `space-robot export` prints."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from rich.console import Console

from space_robot_control.flight_code.folder import Exported

from ..console.tables import Column, JudgedCell, Table
from ..console.terminal import say
from ..console.terminal_tables import print_table
from ..export.verify import ReplayVerdict


def print_export(
    folder: Path, exported: Exported, flights: Sequence[tuple[str, str, int]], console: Console
) -> None:
    """Print what was written."""
    figures = exported.figures()
    say(
        console,
        f"{folder}: laws {', '.join(figures['laws'])}; {figures['functions']} kernels, "
        f"{figures['lines']} lines of C99, {figures['state_bytes']} bytes of state",
    )
    columns = (
        Column("flight", is_label=True),
        Column("what", is_label=True),
        Column("states", spec="d"),
    )
    print_table(Table.of("Recorded flights", columns, flights), console)
    say(console, f"replay them: make -C {folder}")


def print_verdicts(verdicts: Sequence[ReplayVerdict], console: Console) -> None:
    """Print what compilers and processors made of it."""
    if not verdicts:
        return
    columns = (
        Column("target", is_label=True),
        Column("states", spec="d"),
        Column("tick", "ns", ".0f"),
        Column("verdict", is_label=True),
    )
    good, bad = JudgedCell("", "every bit equal", "good"), "bad"
    rows = [
        (v.target, v.states, v.tick_ns, good if v.is_accepted else JudgedCell("", v.reason, bad))
        for v in verdicts
    ]
    print_table(Table.of("Acceptance", columns, rows), console)
