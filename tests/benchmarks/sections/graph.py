"""The graph in lockstep: how fast the four processes go, and where the time of a tick is."""

from __future__ import annotations

from space_robot.flight.plan import Flight, FlightPlan, resolve

from ..graph_flights import WARM_UP_TICKS, GraphRun, fly_graph, naive_ticks_per_s
from ..measure import Options
from ..result import Beside, Result, Target

DURATION_S = 10.0
RATE_ASKED = Target(6000.0, 8000.0)
OF_EMPTY_ASKED = Target(0.8, of="ratio")


def graph(options: Options) -> list[Result]:
    """Plant, controller, mission and recorder beside the same graph that computes nothing.

    And beside two nodes written the usual way, which also tells how fast the machine is.
    """
    flight = Flight(resolve(FlightPlan(duration=0.5 if options.short else DURATION_S)))
    full, empty, naive = [], [], []
    count = options.batches(usual=5)
    for k in range(count):
        options.progress(f"the graph in lockstep, {k + 1} of {count}: as it is, empty, naive")
        full.append(fly_graph(flight))
        empty.append(fly_graph(flight, empty=True))
        naive.append(naive_ticks_per_s(500 if options.short else 4000))
    rates = tuple(run.ticks_per_s for run in full)
    rates_empty = tuple(run.ticks_per_s for run in empty)
    lost = sum(sum(run.lost.values()) for run in full + empty)
    beside = Beside("empty graph", rates_empty)
    return [
        Result(
            "lockstep graph",
            "ticks/s",
            rates,
            target=options.asked(RATE_ASKED),
            better="more",
            note=f"{lost} messages lost in {2 * count} flights",
        ),
        Result(
            "lockstep graph", "ticks/s", rates, beside, options.asked(OF_EMPTY_ASKED), better="more"
        ),
        Result(
            "lockstep graph",
            "ticks/s",
            rates,
            Beside("two naive nodes", tuple(naive)),
            better="more",
            note="naive: message objects, callbacks, SingleThreadedExecutor",
        ),
        Result(
            "lockstep graph, times real time",
            "x",
            tuple(rate * flight.period for rate in rates),
            better="more",
        ),
        *_breakdown(full),
    ]


def _breakdown(runs: list[GraphRun]) -> list[Result]:
    """Mean time of a tick and of the calls in it; the rest is transport and waiting."""
    rows = {"a tick": [1e6 / run.ticks_per_s for run in runs]}
    for node in ("plant", "controller"):
        for name in getattr(runs[0], node):
            if f"{name} start" in getattr(runs[0], node):
                rows[f"{node}: {name}"] = [
                    float(getattr(run, node)[name][WARM_UP_TICKS:].mean()) / 1e3 for run in runs
                ]
    calls = [samples for name, samples in rows.items() if name != "a tick"]
    rows["transport, waking, waiting"] = [
        rows["a tick"][k] - sum(samples[k] for samples in calls) for k in range(len(runs))
    ]
    return [Result(name, "us", tuple(samples)) for name, samples in rows.items()]
