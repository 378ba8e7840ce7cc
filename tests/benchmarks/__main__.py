"""The plant beside MuJoCo, Basilisk and Pinocchio: ``python tests/benchmarks --help``."""

from __future__ import annotations

import json
import os
import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import click

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))


@click.command()
@click.argument("sections", nargs=-1, type=click.Choice(["plant", "growth"]))
@click.option("--short", is_flag=True, help="Little work, to see that it runs.")
@click.option("--repetitions", type=click.IntRange(1, 1000), help="Batches of each competitor.")
@click.option("--json", "as_json", is_flag=True, help="Print everything, all samples, as JSON.")
@click.option("--output", type=click.Path(path_type=Path), help="File to write the JSON to.")
@click.option("--plot", type=click.Path(path_type=Path), help="PNG of the growth.")
@click.option("--cold", is_flag=True, help="Compile anew, to see how long that takes.")
def benchmarks(
    sections: tuple[str, ...], short: bool, repetitions: int | None, as_json: bool,
    output: Path | None, plot: Path | None, cold: bool,
) -> None:  # fmt: skip
    r"""Measure the plant beside its peers in one run, and check that they fly the same robot.

    Needs mujoco and pin (of the extra `test`), and for Basilisk bsk (of the extra `bench`).
    Exit code 1: a peer moves otherwise.

    \b
    Examples:
      python tests/benchmarks
      python tests/benchmarks growth --plot growth.png
      python tests/benchmarks growth --cold
    """
    chosen = sections or ("plant", "growth")
    with TemporaryDirectory() as cache:
        if cold:
            os.environ["NUMBA_CACHE_DIR"] = cache
        report, is_same = _run(chosen, short, repetitions, plot, None if as_json else cold)
    text = json.dumps(report, indent=1)
    if output:
        output.write_text(text + "\n", "utf-8")
    if as_json:
        click.echo(text)
    sys.exit(not is_same)


def _run(
    sections: tuple[str, ...], short: bool, repetitions: int | None, plot: Path | None,
    show_cold: bool | None,
) -> tuple[dict[str, Any], bool]:  # fmt: skip
    from checks import HAS_BASILISK
    from display import draw_growth, print_checks, print_growth
    from growth import JOINTS, SHORT_JOINTS, growth
    from plant_step import plant_step
    from rich.console import Console

    from space_robot_control.bench import Options
    from space_robot_control.bench.display import print_machine, print_section
    from space_robot_control.bench.machine import machine

    console = Console(quiet=show_cold is None)
    options = Options(
        short, repetitions, lambda what: click.echo(f"measuring {what} ...", err=True)
    )
    if not HAS_BASILISK:
        click.echo("Basilisk is not installed (pip install bsk): left out", err=True)
    report: dict[str, Any] = {"machine": machine(), "short": short}
    checks: list[dict[str, Any]] = []
    if "plant" in sections:
        results, checks = plant_step(options)
        print_section("plant step, RK4 at 0.5 ms, case 3", results, console)
        report["plant"] = [result.record() for result in results]
        report["checks"] = list(checks)
    if "growth" in sections:
        found = growth(options, SHORT_JOINTS if short else JOINTS)
        print_growth(found, bool(show_cold), console)
        report["growth"] = found.record()
        checks += found.checks
        if plot:
            draw_growth(found, plot)
    print_checks(checks, console)
    print_machine(report["machine"], console)
    return report, all(check["same"] for check in checks)


if __name__ == "__main__":
    benchmarks()
