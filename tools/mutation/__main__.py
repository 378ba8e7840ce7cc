"""Do the tests notice small faults? ``python tools/mutation`` puts them in, one at a time.

A mutant is one change of one line: a sign, a comparison, a number, a statement left out. Lines are
drawn at random, the same ones for the same seed. Mutants that no test could notice (they change
nothing) are for the reader to name: survivors are shown with their change.
"""

from __future__ import annotations

import difflib
import queue
import secrets
import signal
import sys
import tempfile
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor, as_completed
from pathlib import Path
from random import Random

import click
from areas import AREAS, FURTHER, test_files
from mutants import Mutant, sample, text_of
from rich.console import Console
from rich.table import Table
from trial import Copy, Outcome

Result = tuple[str, Mutant, Outcome]


def change(mutant: Mutant) -> str:
    """Return what a mutant changes, as a diff without its head."""
    before = text_of(mutant.module).splitlines()
    lines = difflib.unified_diff(before, mutant.text().splitlines(), n=0, lineterm="")
    return "\n".join(line for line in lines if not line.startswith(("---", "+++", "@@")))


def scores(results: list[Result]) -> Table:
    """Return the score of each area."""
    table = Table("area")
    for name in ("mutants", "killed", "survived", "score"):
        table.add_column(name, justify="right")
    for area in (*dict.fromkeys(area for area, _, _ in results), "all"):
        verdicts = [o.verdict for name, _, o in results if area in (name, "all")]
        survived = verdicts.count("survived")
        killed = len(verdicts) - survived
        share = f"{killed / len(verdicts):.0%}"
        table.add_row(area, str(len(verdicts)), str(killed), str(survived), share)
    return table


def draw(areas: list[str], count: int, seed: int) -> Iterator[tuple[str, Mutant]]:
    """Yield mutants of the areas by turns; which have one more than others is drawn, too."""
    Random(seed).shuffle(areas)
    for number, area in enumerate(areas):
        share = count // len(areas) + (number < count % len(areas))
        modules = list(AREAS[area].modules)
        yield from ((area, m) for m in sample(modules, share, Random(f"{seed} {area}")))


def attempt(copies: queue.Queue[Copy], area: str, mutant: Mutant) -> Result:
    """Try a mutant on the tests near it, and on the further ones if it survives."""
    copy = copies.get()
    try:
        outcome = copy.trial(mutant, AREAS[area].tests_of(mutant.module), AREAS[area].marks)
        if outcome.verdict == "survived":
            outcome = copy.trial(mutant, [str(path) for path in test_files(FURTHER)], "")
    finally:
        copies.put(copy)
    return area, mutant, outcome


@click.command()
@click.option("--area", "areas", multiple=True, type=click.Choice(list(AREAS)), help="[all]")
@click.option("--count", default=60, show_default=True, help="Mutants, as many of each area.")
@click.option("--seed", type=int, help="Of the sample.  [a new one]")
@click.option("--jobs", default=1, show_default=True, help="Mutants tried at a time.")
@click.option("--list", "only_list", is_flag=True, help="Show the sample, try nothing.")
def main(areas: tuple[str, ...], count: int, seed: int | None, jobs: int, only_list: bool) -> None:
    """Try a random sample of mutants on the tests near them, and list those that survive.

    Those that survive the near tests are tried on tests that look at everything from outside, too.
    Kernels that are compiled here are not compiled again.
    """
    console = Console(
        width=None if sys.stdout.isatty() else 160, highlight=False, markup=False, soft_wrap=True
    )
    seed = secrets.randbelow(10**6) if seed is None else seed
    console.print(f"seed {seed}")
    chosen = list(draw(list(areas or AREAS), count, seed))
    if only_list:
        for area, mutant in chosen:
            console.print(f"{area}: {mutant.module}:{mutant.line}\n{change(mutant)}")
        return
    results: list[Result] = []
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, signal.default_int_handler)  # what was tried until then is shown
    with tempfile.TemporaryDirectory(prefix="mutation-") as folder:
        everywhere = [Copy(Path(folder) / str(number)) for number in range(jobs)]
        copies: queue.Queue[Copy] = queue.Queue()
        for copy in everywhere:
            copies.put(copy)
        with ThreadPoolExecutor(jobs) as pool:
            trials = [pool.submit(attempt, copies, area, mutant) for area, mutant in chosen]
            try:
                for trial in as_completed(trials):
                    results.append(trial.result())
                    area, mutant, outcome = results[-1]
                    console.print(
                        f"{len(results)}/{len(chosen)} {area} {mutant.module}:{mutant.line} "
                        f"{outcome.verdict} {outcome.by} ({outcome.seconds:.0f} s)"
                    )
                    if outcome.verdict == "survived":
                        console.print(change(mutant))
            except BaseException as error:
                pool.shutdown(wait=False, cancel_futures=True)
                for copy in everywhere:
                    copy.stop()
                if not isinstance(error, KeyboardInterrupt):
                    raise
    for name in sorted({name for copy in everywhere for name in copy.failing}):
        console.print(f"left out, for it fails without any mutant: {name}")
    if results:
        console.print(scores(results))


if __name__ == "__main__":
    main()
