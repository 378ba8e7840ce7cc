"""The command line: which sections, how long, as a table or as JSON."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import click

from space_robot.cli.options import file_option
from space_robot.console.files import check_writable
from space_robot_msgs_py.errors import SpaceRobotError

SECTIONS = (
    "plant",
    "wheels",
    "orbit",
    "laws",
    "mpc",
    "simulate",
    "reproduce",
    "campaign",
    "lanes",
    "graph",
    "composed",
    "clock",
    "recorder",
    "start-up",
    "compile",
    "python",
    "flight-code",
    "peers",
    "growth",
)
BESIDE_PEERS = {"orbit", "peers", "growth"}


@click.command()
@click.argument("sections", nargs=-1, metavar="[SECTION]...")
@click.option("--short", is_flag=True, help="Little work, to see that it runs; times mean nothing.")
@click.option(
    "--repetitions",
    type=click.IntRange(1, 1000),
    help="Batches of each competitor [default: as many as the section thinks fit].",
)
@click.option("--json", "as_json", is_flag=True, help="Print everything, all samples, as JSON.")
@file_option("--output", help="File to write the JSON to as well.")
@click.option("--plot", type=click.Path(path_type=Path, dir_okay=False), help="PNG of the growth.")
@click.option("--cold", is_flag=True, help="Compile anew, to see how long first calls take.")
def bench(
    sections: tuple[str, ...],
    short: bool,
    repetitions: int | None,
    as_json: bool,
    output: Path | None,
    plot: Path | None,
    cold: bool,
) -> None:
    """Measure how fast it is on this machine, each figure beside its competitor in the same run.

    SECTION is one of plant, wheels (beside Basilisk's), orbit (its torques beside Basilisk's),
    laws, mpc (a law that solves a QP), simulate, reproduce, campaign, lanes (eight flights at a
    time, beside MuJoCo's rollout);
    on the ROS 2 graph: graph, composed, clock, recorder (10 minutes), start-up; compile (a first
    start, and one with a robot of another size); python (a tick stepped from Python); flight-code
    (in C, beside its kernels); beside MuJoCo, Pinocchio and Basilisk: peers (one step of the plant)
    and growth (over the number of joints) [default: all].
    Shown are the median and the spread of several repetitions, how many times better that is than
    what stands beside it, and what was asked. A machine that does other work meanwhile shows in the
    spread.

    Exit code 1: a peer moves otherwise than the plant, so it is not the same robot.

    \b
    Examples:
      make bench ARGS='plant laws'
      python tests/benchmarks simulate --repetitions 20 --output simulate.json
      python tests/benchmarks growth --plot growth.png
      python tests/benchmarks --short --json plant | jq '.sections.plant[] | [.name, .median]'
    """
    for name in sections:
        if name not in SECTIONS:
            raise click.UsageError(f"unknown section {name!r}: choose from {', '.join(SECTIONS)}")
    try:
        for path in filter(None, (output, plot)):
            check_writable(path)
        with ExitStack() as stack:
            if cold:  # before any kernel is imported, and for the nodes, too
                os.environ["NUMBA_CACHE_DIR"] = stack.enter_context(TemporaryDirectory())
            report, kept = _run(sections or SECTIONS, short, repetitions, plot, not as_json, cold)
        text = json.dumps(report, indent=1, allow_nan=False)
        if output:
            output.write_text(f"{text}\n", "utf-8")
        if as_json:
            click.echo(text)
    except SpaceRobotError as error:
        _say(f"error: {error}")
        sys.exit(error.exit_code)
    sys.exit(not kept)


def _run(
    names: tuple[str, ...],
    short: bool,
    repetitions: int | None,
    plot: Path | None,
    is_shown: bool,
    cold: bool,
) -> tuple[dict[str, Any], bool]:
    """The report, and whether all conditions were kept."""
    from space_robot.console.terminal import terminal
    from space_robot.flight.compilation import compile_kernels

    from .display import print_machine, print_section
    from .machine import machine
    from .measure import Options
    from .sections import section

    options = Options(short, repetitions, lambda what: _say(f"measuring {what} ..."), plot)
    if not cold:
        compile_kernels()
    console = terminal(quiet=not is_shown)
    report: dict[str, Any] = {"machine": machine(), "short": short, "sections": {}}
    kept = True
    for name in _that_can_run(names):
        results = section(name)(options)
        report["sections"][name] = [result.record() for result in results]
        print_section(name, results, console)
        kept &= not any(result.is_condition and not result.reached for result in results)
    print_machine(report["machine"], console)
    return report, kept


def _that_can_run(names: tuple[str, ...]) -> Iterator[str]:
    """Each section once; what is left out, with a word."""
    from .peers import is_installed

    tools = {"mujoco": "MuJoCo", "pinocchio": "Pinocchio"}
    missing = [tool for module, tool in tools.items() if not is_installed(module)]
    for name in dict.fromkeys(names):
        if name in BESIDE_PEERS and missing:
            _say(f"{name} is left out: no {' and no '.join(missing)} here (extra `bench`)")
            continue
        if name == "orbit" and not is_installed("Basilisk"):
            _say("orbit is left out: no Basilisk here (bsk, extra `bench`)")
            continue
        if name in {"wheels", *BESIDE_PEERS} and not is_installed("Basilisk"):
            _say(f"{name}: without Basilisk, which is not installed (bsk, extra `bench`)")
        yield name


def _say(text: str) -> None:
    click.echo(text, err=True)
