"""A soak on a terminal: a table, and the flights that failed."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from rich.console import Console

from ...console.tables import Column, Table
from ...console.terminal import say
from ...console.terminal_tables import print_table


def print_soak(report: dict[str, Any], console: Console) -> None:
    """Print the report of a `run.Soak`."""
    ended = ", interrupted" if report["interrupted"] else ""
    columns = Column(is_label=True), Column(), Column(is_label=True)
    print_table(Table.of(f"soak, seed {report['seed']}{ended}", columns, rows(report)), console)
    for flown in report["each"]:
        if flown["survived"]:
            continue
        lines = [f"flight {flown['number']} did not survive:", *flown["wrong"]]
        lines.append(f"again: {flown['command']}")
        if flown["bag"]:
            lines.append(f"bag: {flown['bag']}")
        for line in lines:
            say(console, line if line is lines[0] else f"  {line}")


def rows(report: dict[str, Any]) -> list[tuple[str, str, str]]:
    """List name, number and remark of each line of the table."""
    growth, files = report["memory_growth_mb"], report["shared_memory_files"]
    return [
        ("flights", str(report["flights"]), ""),
        ("survived", str(report["survived"]), ""),
        ("faults", str(report["faults"]), f"{len(report['faults_by_kind'])} kinds"),
        ("controllers restarted", str(report["restarts"]), ""),
        ("messages lost", str(report["messages_lost"]), ""),
        *_errors(report["largest_error"]),
        ("memory growth, this process", _mb(growth["soak"]), "since the third flight"),
        ("memory growth, largest node", _mb(growth["largest_node"]), "first to last quarter"),
        ("shared memory files", f"{files['start']} to {files['end']}", "of Fast DDS"),
    ]


def _errors(errors: dict[str, Any]) -> Iterator[tuple[str, str, str]]:
    for key, remark in (
        ("tracking", "torque and reference whole"),
        ("disturbed", "torque or reference taken away"),
    ):
        for what, unit in (("attitude", ""), ("joint", " rad")):
            name, largest = f"largest {what} error", errors[key][what]
            if largest:
                number, flight = f"{largest['value']:.2e}{unit}", largest["flight"]
                yield name, number, f"flight {flight}, {remark}"
            else:
                yield name, "-", ""


def _mb(value: float | None) -> str:
    return "-" if value is None else f"{value:+.1f} MB"
