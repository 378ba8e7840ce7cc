"""Campaigns: what a run costs beside plain flights, and the memory of many."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from space_robot_control.campaign.flown import Campaign
from space_robot_control.campaign.runner import run_many
from space_robot_control.campaign.study import Study
from space_robot_control.flight.plan import Flight, FlightPlan
from space_robot_control.flight.simulate import simulate

from ..measure import Options, interleave
from ..result import Result, Target

LAW, SEED = "tde_stc", 7
DURATIONS_S = (5.0, 30.0)
FLIGHTS = {5.0: 24, 30.0: 6}
"""Of a batch."""
MANY = 1000
"""Flights over which the memory is looked at."""
ITEMS = 5000
OVERHEAD = Target(1.0 / 1.1, of="ratio")
"""Asked: at most 10 % more than a plain flight."""
VARY = {"robot.links[*].mass": {"uniform": [0.8, 1.2], "relative": True}}


def campaign(options: Options) -> list[Result]:
    """Flights of a campaign beside those of `simulate`; an empty item; memory over many flights."""
    found = []
    for duration in (0.2,) if options.short else DURATIONS_S:
        number = FLIGHTS.get(duration, 2)
        options.progress(f"{number} flights of {duration:g} s, plain and as campaigns")
        seconds = interleave(
            {
                "plain": lambda _, d=duration, n=number: _plain(d, n),  # type: ignore[misc]
                "1": lambda _, d=duration, n=number: _campaign(d, n, 1),  # type: ignore[misc]
                "2": lambda _, d=duration, n=number: _campaign(d, n, 2),  # type: ignore[misc]
            },
            options.batches(usual=5),
            warm_up=False,
        )
        each = {name: [t / number for t in taken] for name, taken in seconds.items()}
        beside = ("plain flights", each["plain"])
        found += [
            Result.timed(f"a flight of {duration:g} s, plain", "ms", each["plain"]),
            Result.timed(
                f"of a campaign, {duration:g} s, 1 worker", "ms", each["1"], beside,
                options.asked(OVERHEAD),
            ),
            Result.timed(f"of a campaign, {duration:g} s, 2 workers", "ms", each["2"], beside),
        ]  # fmt: skip
    return [*found, *_empty_items(options), *_memory(options)]


def _plain(duration: float, number: int) -> None:
    for _ in range(number):
        simulate(Flight(FlightPlan(controller=LAW, case="1", duration=duration)))


def _campaign(
    duration: float, number: int, workers: int, progress: Callable[[Any], None] | None = None
) -> None:
    study = Study(scenario={"case": "1", "duration": duration}, laws=[LAW], vary=VARY)
    Campaign(study).run(number, SEED, workers=workers, progress=progress)


def _empty_items(options: Options) -> Iterator[Result]:
    """What the runner itself takes."""
    number = 50 if options.short else ITEMS
    options.progress(f"{number} items that do nothing")
    for workers in (1, 2):
        began = time.perf_counter()
        for _ in run_many(abs, range(number), workers=workers):
            pass
        each = (time.perf_counter() - began) / number
        yield Result.timed(f"an empty item, workers {workers}", "us", [each])


def _memory(options: Options) -> list[Result]:
    """Largest memory in the second and in the last quarter of many flights."""
    number = 8 if options.short else MANY
    options.progress(f"memory over {number} flights")
    looks: list[tuple[float, float]] = []

    def look(_: Any) -> None:
        own, workers = _resident_mb(os.getpid()), 0.0
        for server in _children(os.getpid()):
            workers = max([workers, *map(_resident_mb, _children(server))])
        looks.append((own, workers))

    _campaign(0.2 if options.short else 1.0, number, 2, look)
    quarter = len(looks) // 4
    return [
        Result(f"largest memory of {who}, flights {first} to {last}", "MB",
               (max(seen[place] for seen in looks[first:last]),))
        for place, who in enumerate(("the parent", "a worker"))
        for first, last in ((quarter, 2 * quarter), (3 * quarter, number))
    ]  # fmt: skip


def _children(pid: int) -> list[int]:
    try:
        text = Path(f"/proc/{pid}/task/{pid}/children").read_text()
    except OSError:
        return []
    return [int(word) for word in text.split()]


def _resident_mb(pid: int) -> float:
    try:
        pages = int(Path(f"/proc/{pid}/statm").read_text().split()[1])
    except OSError:
        return 0.0
    return pages * os.sysconf("SC_PAGESIZE") / 1e6
