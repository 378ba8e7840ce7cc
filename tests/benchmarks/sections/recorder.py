"""The recorder at 2 kHz: nothing lost, memory flat, little of a core."""

from __future__ import annotations

from space_robot.flight.plan import Flight, FlightPlan, resolve

from ..graph_flights import NodeUse, fly_graph
from ..measure import Options
from ..result import Result, Target

DURATION_S = 600.0
CORE_ASKED = Target(25.0)
LOST_ASKED = Target(0.0)
MEMORY_ASKED = Target(250.0)
GROWTH_ASKED = Target(5.0)


def recorder(options: Options) -> list[Result]:
    """10 minutes by the wall clock; processor and memory of every node, too."""
    duration = 1.5 if options.short else DURATION_S
    options.progress(f"{duration:g} s by the wall clock, recorded")
    run = fly_graph(Flight(resolve(FlightPlan(duration=duration, realtime=True))), timed=False)
    lost = float(sum(run.lost.values()))
    own = run.use["recorder"]

    return [
        Result(
            "messages lost",
            "",
            (lost,),
            target=options.asked(LOST_ASKED),
            note=f"of {run.received + lost:.0f} in {duration:g} s",
        ),
        Result("recorder, of a core", "%", (100.0 * own.cores,), target=options.asked(CORE_ASKED)),
        Result(
            "recorder, memory growth",
            "MB",
            (_growth(own),),
            target=options.asked(GROWTH_ASKED),
            note="largest of the last half less largest of the first half",
        ),
        *(
            Result(
                f"{name}, memory", "MB", (max(use.memory_mb),), target=options.asked(MEMORY_ASKED)
            )
            for name, use in run.use.items()
        ),
        *(
            Result(f"{name}, of a core", "%", (100.0 * use.cores,))
            for name, use in run.use.items()
            if name != "recorder"
        ),
    ]


def _growth(use: NodeUse) -> float:
    half = len(use.memory_mb) // 2
    return max(use.memory_mb[half:]) - max(use.memory_mb[:half])
