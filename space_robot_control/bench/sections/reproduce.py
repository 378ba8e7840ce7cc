"""The paper's Table V flown again, all of it."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory

from ...reproduction.flights import ROWS
from ...reproduction.processes import cores
from ...reproduction.reproduce import reproduce as run
from ..measure import Options, interleave
from ..result import Result, Target

TARGET = Target(10.0)
"""s, on two cores."""


def reproduce(options: Options) -> list[Result]:
    """Wall time of ``space-robot reproduce`` into a folder that is thrown away."""
    rows, duration = (ROWS[:1], 0.5) if options.short else (ROWS, None)

    def once(loops: int) -> None:
        for _ in range(loops):
            with TemporaryDirectory() as folder:
                run(rows, Path(folder) / "reproduction", duration=duration, jobs=cores())

    options.progress(f"reproduction of {len(rows)} rows on {cores()} processors")
    seconds = interleave({"all": once}, options.batches(usual=3), warm_up=False)
    name = f"{len(rows)} rows, {cores()} processes"
    return [Result.timed(name, "s", seconds["all"], target=options.asked(TARGET))]
