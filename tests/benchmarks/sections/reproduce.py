"""The paper's Table V flown again, all of it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory

from space_robot.paper.reproduction.flights import ROWS
from space_robot.paper.reproduction.reproduce import reproduce as run
from space_robot.processes.pool import cores

from ..measure import Options, interleave
from ..result import Result, Target

TARGET = Target(10.0)
"""s, on two cores."""


def reproduce(options: Options) -> list[Result]:
    """Wall time of ``space-robot reproduce`` into a folder that is thrown away; and ``--brief``."""
    rows, duration = (ROWS[:1], 0.5) if options.short else (ROWS, None)

    def flown(brief: bool) -> Callable[[int], None]:
        def once(loops: int) -> None:
            for _ in range(loops):
                with TemporaryDirectory() as folder:
                    out = Path(folder) / "reproduction"
                    run(rows, out, duration=duration, brief=brief, jobs=cores())

        return once

    options.progress(f"reproduction of {len(rows)} rows on {cores()} processors")
    competitors = {"": flown(False), ", --brief": flown(True)}
    seconds = interleave(competitors, options.batches(usual=3), warm_up=False)
    target = options.asked(TARGET)
    return [
        Result.timed(f"{len(rows)} rows, {cores()} processes{how}", "s", taken, target=target)
        for how, taken in seconds.items()
    ]
