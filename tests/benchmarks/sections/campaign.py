"""Campaigns: what a run costs beside plain flights, and the memory of many."""

from __future__ import annotations

import os
import resource
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from space_robot.analysis import analyze
from space_robot.campaign.flown import Campaign
from space_robot.campaign.study import Study
from space_robot.flight.plan import Flight, FlightPlan, resolve
from space_robot.flight.simulate import simulate
from space_robot.processes.pool import run_many

from ..measure import Options, interleave
from ..result import Result, Target

LAW, SEED = "tde_stc", 7
DURATIONS_S = (5.0, 30.0)
FLIGHTS = {5.0: 32, 30.0: 16}
"""Of a repetition: the same number of eights for each of two workers."""
MANY = 4000
"""Flights over which the memory is looked at."""
ITEMS = 5000
OVERHEAD = Target(1.0 / 1.1, of="ratio")
"""Asked: at most 10 % more processor time than a plain flight."""
VARY = {"robot.links[*].mass": {"uniform": [0.8, 1.2], "relative": True}}


def campaign(options: Options) -> list[Result]:
    """Flights of a campaign beside plain ones; an item that does nothing; memory of many."""
    found: list[Result] = []
    for duration in (0.2,) if options.short else DURATIONS_S:
        number = FLIGHTS.get(duration, 2)
        options.progress(f"{number} flights of {duration:g} s, plain and as campaigns")
        found += _beside_plain(options, duration, number)
    return [*found, *_empty_items(options), *_memory(options)]


def _beside_plain(options: Options, duration: float, number: int) -> list[Result]:
    """A flight's time and, of all processes together, its processor time."""
    spent: dict[str, list[float]] = {"plain": [], "1 worker": [], "2 workers": []}

    def counted(name: str, workers: int) -> Callable[[int], None]:
        def fly(_: int) -> None:
            began = _processor_s()
            if workers:
                _campaign(duration, number, workers)
            else:
                _plain(duration, number)
            spent[name].append((_processor_s() - began) / number)

        return fly

    competitors = {name: counted(name, workers) for workers, name in enumerate(spent)}
    seconds = interleave(competitors, options.batches(usual=5), warm_up=False)
    each = {name: [taken / number for taken in seconds[name]] for name in spent}
    found = []
    for kind, times in (("", each), (", processor time", spent)):
        found.append(Result.timed(f"a flight of {duration:g} s, plain{kind}", "ms", times["plain"]))
        for name in ("1 worker", "2 workers"):
            asked = options.asked(OVERHEAD) if kind and name == "1 worker" else None
            row = f"of a campaign, {duration:g} s, {name}{kind}"
            found.append(Result.timed(row, "ms", times[name], ("plain", times["plain"]), asked))
    return found


def _processor_s() -> float:
    """Of this process and of those that it has waited for."""
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(one.ru_utime + one.ru_stime for one in used)


def _plain(duration: float, number: int) -> None:
    """Fly and analyse, for a campaign's row has figures of merit, too."""
    for _ in range(number):
        analyze(simulate(Flight(resolve(FlightPlan(controller=LAW, case="1", duration=duration)))))


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
        Result(
            f"largest memory of {who}, flights {first} to {last}",
            "MB",
            (max(seen[place] for seen in looks[first:last]),),
        )
        for place, who in enumerate(("the parent", "a worker"))
        for first, last in ((quarter, 2 * quarter), (3 * quarter, number))
    ]


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
