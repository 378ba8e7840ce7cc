"""Random flights with faults, back to back on the real graph: ``python tests/soak --help``."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import click
from rich.console import Console
from soaked_flights import soak

from space_robot.console.tables import Column, Table
from space_robot.console.terminal import say, terminal
from space_robot.console.terminal_tables import print_table
from space_robot.processes.interruption import exit_code, raising_signals

BAGS = click.Path(path_type=Path, file_okay=False)


@click.command(context_settings={"show_default": True})
@click.option("--minutes", type=float, default=30.0, help="Stop starting new flights after these.")
@click.option("--seed", default=0, help="The same seed draws the same flights.")
@click.option("--duration", type=click.FloatRange(0.5), default=5.0, help="Of a flight, simulated.")
@click.option("--bags", type=BAGS, help="New folder for all bags [default: of failed flights].")
@click.option("--output", type=click.File("w", lazy=False), help="Also write a report, as JSON.")
def main(minutes: float, seed: int, duration: float, bags: Path | None, output: Any) -> None:
    r"""Fly random missions with faults back to back on the real graph.

    Law, case, swaps and one to four faults of each flight are drawn from the seed; killed and
    stopped processes are among them. A flight survives if it comes to its end, no node dies that
    was not killed, every torque is finite, no message is lost that no fault explains, its bag can
    be read, and no process is left. Those that do not are listed, each with the command that flies
    it again. Exit code 1: one did not survive. Ctrl-C shows what was flown so far (then 130).

    \b
    Examples:
      python tests/soak --minutes 480 --seed 7 --output soak.json
      make soak ARGS='--minutes 2 --duration 1'
    """
    with raising_signals():
        soaked = soak(60.0 * minutes, seed, duration, bags, lambda line: click.echo(line, err=True))
    report = soaked.report()
    if output:
        json.dump(report, output, indent=1, allow_nan=False)
    print_report(report, terminal())
    if soaked.interrupted_by:
        sys.exit(exit_code(soaked.interrupted_by))
    sys.exit(report["survived"] < report["flights"])


def print_report(report: dict[str, Any], console: Console) -> None:
    """Print the table, and the flights that did not survive."""
    ended = ", interrupted" if report["interrupted"] else ""
    columns = Column(is_label=True), Column(), Column(is_label=True)
    print_table(Table.of(f"soak, seed {report['seed']}{ended}", columns, rows(report)), console)
    for flown in report["each"]:
        if not flown["survived"]:
            say(console, f"flight {flown['number']} did not survive:")
            for line in (
                *flown["wrong"],
                f"again: {flown['command']}",
                f"bag: {flown['bag'] or '-'}",
            ):
                say(console, f"  {line}")


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


if __name__ == "__main__":
    main()
