"""How fast it all is, each figure beside its competitor: ``python tools/benchmarks --help``."""

from __future__ import annotations

import json
import os
import platform
import sys
from collections.abc import Iterator
from contextlib import suppress
from importlib import import_module
from importlib.metadata import PackageNotFoundError, version
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import click

sys.path.append(str(Path(__file__).resolve().parents[2] / "tests"))

from measuring import Row, Run
from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table

SECTIONS = {
    "plant": ("plant", "a step of the plant, from compiled code and from Python"),
    "laws": ("plant", "a controller's tick, and a tick of a whole flight, under each law"),
    "mpc": ("plant", "a law that solves a QP in each tick, and three solvers"),
    "flight-code": ("flight_code", "the flight code in C beside its kernels"),
    "simulate": ("flights", "flights of 30 s in this process"),
    "campaign": ("flights", "flights of a campaign beside single ones"),
    "lanes": ("flights", "eight flights at a time; MuJoCo's rollout"),
    "graph": (
        "graph",
        "four processes in lockstep, beside two naive nodes; where a tick's time is",
    ),
    "composed": ("graph", "one process in lockstep, and by the wall clock"),
    "clock": ("graph", "four processes by the wall clock"),
    "peers": ("simulators", "a step of the plant beside MuJoCo, Pinocchio and Basilisk"),
    "growth": ("simulators", "the same over the number of joints"),
}
"""Module of each section, and what it measures."""
PEERS = {"mujoco": "MuJoCo", "pinocchio": "Pinocchio"}
NEEDS = {"peers": PEERS, "growth": PEERS, "mpc": {"daqp": "DAQP"}}
PACKAGES = ("space_robot", "numpy", "numba", "llvmlite", "mujoco", "pin", "bsk")


@click.command(
    epilog="\b\n" + "\n".join(f"{name:12} {text}" for name, (_, text) in SECTIONS.items())
)
@click.argument("sections", nargs=-1, type=click.Choice(list(SECTIONS)), metavar="[SECTION]...")
@click.option("--short", is_flag=True, help="Little work, to see that it runs; times mean nothing.")
@click.option("--repetitions", type=click.IntRange(1), help="Batches of each competitor.")
@click.option("--output", type=click.File("w", lazy=False), help="File for all samples, as JSON.")
def bench(sections: tuple[str, ...], short: bool, repetitions: int | None, output: Any) -> None:
    """Measure how fast it is on this machine, each figure beside its competitor in the same run.

    Shown are the median and the spread of several repetitions, and how many times better that is
    than what stands beside it. A machine that does other work meanwhile shows in the spread.

    Exit code 1: a peer moves otherwise than the plant, so it is not the same robot.

    \b
    Examples:
      make bench ARGS='plant laws'
      python tools/benchmarks simulate --repetitions 20 --output simulate.json
    """
    from space_robot.flight.compilation import compile_kernels

    compile_kernels()
    run = Run(short, repetitions, lambda what: click.echo(f"measuring {what} ...", err=True))
    console = Console(width=None if sys.stdout.isatty() else 120)
    report: dict[str, Any] = {"machine": machine(), "short": short, "sections": {}}
    is_same = True
    for name in _that_can_run(sections or tuple(SECTIONS)):
        section = getattr(import_module(SECTIONS[name][0]), name.replace("-", "_"))
        rows: list[Row] = list(section(run))
        report["sections"][name] = [row.record() for row in rows]
        show(name, rows, console)
        is_same &= not any(row.holds is False for row in rows)
    console.print(*(f"{key}: {value}" for key, value in report["machine"].items()), sep="; ")
    if output:
        json.dump(report, output, indent=1, allow_nan=False)
    sys.exit(not is_same)


def _that_can_run(names: tuple[str, ...]) -> Iterator[str]:
    """Yield each section once; what is left out is said."""
    for name in dict.fromkeys(names):
        missing = [tool for module, tool in NEEDS.get(name, {}).items() if not find_spec(module)]
        if missing:
            click.echo(f"{name} is left out: no {', no '.join(missing)} here", err=True)
        else:
            yield name


def show(title: str, rows: list[Row], console: Console) -> None:
    """Print the rows of a section."""
    table = Table(title=title, title_justify="left", box=SIMPLE_HEAD, padding=(0, 1, 0, 0))
    for name, justify in (
        ("", "left"),
        ("median", "right"),
        ("spread", "right"),
        ("beside", "left"),
    ):
        table.add_column(name, justify=justify, overflow="fold")  # type: ignore[arg-type]
    table.add_column("times better", justify="right")
    table.add_column("", overflow="fold")
    for row in rows:
        beside = f"{row.beside}: {_number(row.median_beside)}" if row.beside else ""
        ratio = f"{row.ratio:.2f}" if row.beside else ""
        low, high = min(row.samples), max(row.samples)
        spread = f"{_number(low)}..{_number(high)}" if len(row.samples) > 1 else ""
        verdict = "" if row.holds is None else "as it must be" if row.holds else "[red]too far[/]"
        cells = [row.name, f"{_number(row.median)} {row.unit}", spread, beside, ratio]
        table.add_row(*cells, " ".join(filter(None, (verdict, row.note))))
    console.print(table)


def _number(value: float) -> str:
    return f"{value:.0f}" if abs(value) >= 1000.0 else f"{value:.3g}"


def machine() -> dict[str, Any]:
    """Return what it is measured on: a time means nothing without."""
    cpu = platform.processor()
    with suppress(OSError):
        lines = Path("/proc/cpuinfo").read_text("utf-8").splitlines()
        cpu = next((x.partition(":")[2].strip() for x in lines if x.startswith("model name")), cpu)
    packages = {}
    for name in PACKAGES:
        with suppress(PackageNotFoundError):
            packages[name] = version(name)
    return {
        "cpu": cpu,
        "processors": len(os.sched_getaffinity(0)),
        "load": round(os.getloadavg()[0], 2),
        "system": platform.platform(),
        "python": " ".join([platform.python_version(), *platform.python_build()]),
        **packages,
    }


if __name__ == "__main__":
    bench(prog_name="python tools/benchmarks")
