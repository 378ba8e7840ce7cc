"""``space-robot bench``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from .options import OUTPUT, check_writable, put_json

if TYPE_CHECKING:
    from ..bench import Result


@click.command()
@click.argument("sections", nargs=-1, metavar="[SECTION]...")
@click.option("--short", is_flag=True, help="Little work, to see that it runs; times mean nothing.")
@click.option(
    "--repetitions",
    type=click.IntRange(1, 1000),
    help="Batches of each competitor [default: as many as the section thinks fit].",
)
@click.option("--json", "as_json", is_flag=True, help="Print everything, all samples, as JSON.")
@OUTPUT
def bench(
    sections: tuple[str, ...],
    short: bool,
    repetitions: int | None,
    as_json: bool,
    output: Path | None,
) -> None:
    """Measure how fast it is on this machine, each figure beside its competitor in the same run.

    SECTION is one of plant, laws, simulate, reproduce, and on the ROS 2 graph: graph, clock,
    recorder (10 minutes), start-up [default: all]. Shown are the median and the
    spread of several repetitions, how many times better that is than what stands beside it, and
    what was asked. A machine that does other work meanwhile shows in the spread.

    \b
    Examples:
      space-robot bench
      space-robot bench plant laws
      space-robot bench simulate --repetitions 20 --output simulate.json
      space-robot bench --short --json | jq '.sections.plant[] | [.name, .median, .unit]'
    """
    from ..bench import Options
    from ..bench.machine import machine
    from ..bench.sections import SECTIONS
    from ..flight.compilation import compile_kernels

    for name in sections:
        if name not in SECTIONS:
            raise click.UsageError(f"unknown section {name!r}: choose from {', '.join(SECTIONS)}")
    if output:
        check_writable(output)
    options = Options(
        short, repetitions, lambda what: click.echo(f"measuring {what} ...", err=True)
    )
    compile_kernels()
    report: dict[str, Any] = {"machine": machine(), "short": short, "sections": {}}
    for name in dict.fromkeys(sections) or SECTIONS:
        results = SECTIONS[name](options)
        report["sections"][name] = [result.record() for result in results]
        if not as_json:
            _show(name, results)
    put_json(report, as_json, output)
    if not as_json:
        _show_machine(report["machine"])


def _show(name: str, results: list[Result]) -> None:
    from ..bench.display import print_section
    from ..flight.terminal import terminal

    print_section(name, results, terminal())


def _show_machine(machine: dict[str, Any]) -> None:
    from ..bench.display import print_machine
    from ..flight.terminal import terminal

    print_machine(machine, terminal())
