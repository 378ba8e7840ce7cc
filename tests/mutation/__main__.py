"""Do the tests notice small faults? ``python tests/mutation`` puts them in, one at a time.

A mutant is one change of one line: a sign, a comparison, a number, a statement left out. Lines are
drawn at random, the same ones for the same seed. Mutants that no test could notice (they change
nothing) are for the reader to name: the survivors are listed with their change.
"""

from __future__ import annotations

import difflib
import queue
import secrets
import signal
import sys
import tempfile
import threading
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from random import Random
from typing import NoReturn

import click
from areas import AREAS, FURTHER
from mutants import Mutant, sample, text_of
from rich.console import Console
from rich.table import Table
from trial import Copy, Outcome

Result = tuple[str, Mutant, Outcome]


def change(mutant: Mutant) -> str:
    """What a mutant changes, as a diff without its head."""
    before = text_of(mutant.module).splitlines()
    lines = difflib.unified_diff(before, mutant.text().splitlines(), n=0, lineterm="")
    return "\n".join(line for line in lines if not line.startswith(("---", "+++", "@@")))


def table(results: list[Result]) -> Table:
    """The score of each area."""
    shown = Table()
    for name in ("area", "mutants", "killed", "survived", "score"):
        shown.add_column(name, justify="left" if name == "area" else "right")
    for area in (*dict.fromkeys(area for area, _, _ in results), "all"):
        verdicts = [o.verdict for name, _, o in results if area in (name, "all")]
        survived = verdicts.count("survived")
        killed = len(verdicts) - survived
        shown.add_row(
            area, str(len(verdicts)), str(killed), str(survived), f"{killed / len(verdicts):.0%}"
        )
    return shown


def draw(areas: list[str], count: int, seed: int) -> Iterator[tuple[str, Mutant]]:
    """Mutants of the areas by turns; which have one more than others is drawn, too."""
    Random(seed).shuffle(areas)
    for number, area in enumerate(areas):
        share = count // len(areas) + (number < count % len(areas))
        modules = list(AREAS[area].modules())
        yield from ((area, m) for m in sample(modules, share, Random(f"{seed} {area}")))


@click.command()
@click.option("--area", "areas", multiple=True, type=click.Choice(list(AREAS)), help="[all]")
@click.option("--count", default=60, show_default=True, help="Mutants, as many of each area.")
@click.option("--seed", type=int, help="Of the sample.  [a new one]")
@click.option("--jobs", default=1, show_default=True, help="Mutants tried at a time.")
@click.option("--list", "only_list", is_flag=True, help="Show the sample, try nothing.")
def main(areas: tuple[str, ...], count: int, seed: int | None, jobs: int, only_list: bool) -> None:
    """Try a random sample of mutants on the tests near them, and list those that survive.

    Those that survive the near tests are tried on tests that look at everything from outside, too.
    """
    console = Console(width=160 if not sys.stdout.isatty() else None)
    if seed is None:
        seed = secrets.randbelow(10**6)
    console.print(f"seed {seed}", highlight=False)
    chosen = list(draw(list(areas or AREAS), count, seed))
    if only_list:
        for area, mutant in chosen:
            console.print(f"{area}: {mutant.module}:{mutant.line}", change(mutant), markup=False)
        return
    results: list[Result] = []
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, _interrupt)  # what was tried until then is shown
    with tempfile.TemporaryDirectory(prefix="mutation-") as folder:
        everywhere = [Copy(Path(folder) / str(number)) for number in range(jobs)]
        copies: queue.Queue[Copy] = queue.Queue()
        for copy in everywhere:
            copies.put(copy)
        lock = threading.Lock()

        def work(area: str, mutant: Mutant) -> None:
            copy = copies.get()
            try:
                tests = AREAS[area].tests_of(mutant.module)
                outcome = copy.trial(mutant, tests, AREAS[area].marks)
                if outcome.verdict == "survived":
                    outcome = copy.trial(mutant, FURTHER, "")
            finally:
                copies.put(copy)
            with lock:
                results.append((area, mutant, outcome))
                console.print(
                    f"{len(results)}/{len(chosen)} {area} {mutant.module}:{mutant.line} "
                    f"{outcome.verdict} {outcome.by} ({outcome.seconds:.0f} s)",
                    markup=False,
                    highlight=False,
                )
                if outcome.verdict == "survived":
                    console.print(change(mutant), markup=False, highlight=False)

        with ThreadPoolExecutor(jobs) as pool:
            trials = [pool.submit(work, area, mutant) for area, mutant in chosen]
            try:
                for trial in trials:
                    trial.result()
            except KeyboardInterrupt:
                pool.shutdown(wait=False, cancel_futures=True)
                for copy in everywhere:
                    copy.stop()
    if not results:
        return
    console.print(table(results))
    for area, mutant, outcome in results:
        if outcome.verdict == "survived":
            console.print(f"{area}: {mutant.module}:{mutant.line}", markup=False)
            console.print(change(mutant), markup=False, highlight=False)


def _interrupt(number: int, frame: object) -> NoReturn:
    raise KeyboardInterrupt


if __name__ == "__main__":
    main()
