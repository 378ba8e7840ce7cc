"""The graph by the wall clock: how many ticks are answered in time, how evenly they come."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...flight.plan import Flight, FlightPlan
from ..graph import WARM_UP_TICKS, GraphRun, fly_graph
from ..measure import Options
from ..result import Result, Target

DURATION_S = 60.0
ANSWERED_ASKED = Target(99.9)


def clock(options: Options) -> list[Result]:
    """60 s at 2 kHz: the share answered within the tick, lateness of ticks, answer times."""
    duration = 1.0 if options.short else DURATION_S
    flight = Flight(FlightPlan(duration=duration, realtime=True))
    runs = []
    for k in range(count := options.batches(usual=3) if not options.short else 1):
        options.progress(f"{duration:g} s by the wall clock, {k + 1} of {count}")
        runs.append(fly_graph(flight))
    answered = tuple(100.0 * _answered_in_time(run, flight) for run in runs)
    rows = [
        Result("ticks answered in time", "%", answered, better="more",
               target=None if options.short else ANSWERED_ASKED,
               note=f"{sum(sum(run.lost.values()) for run in runs)} messages lost"),
    ]  # fmt: skip
    for name, times in (
        ("a tick comes late by", [_lateness_us(run, flight.period) for run in runs]),
        ("answer after", [_answer_us(run) for run in runs]),
    ):
        for label, percentile in (("p50", 50.0), ("p99", 99.0), ("max", 100.0)):
            samples = tuple(float(np.percentile(t, percentile)) for t in times)
            rows.append(Result(f"{name}, {label}", "us", samples))
    return rows


def _answered_in_time(run: GraphRun, flight: Flight) -> float:
    return 1.0 - int(run.plant["late_ticks"]) / flight.ticks


def _lateness_us(run: GraphRun, period: float) -> NDArray[np.float64]:
    """How long after its time each tick's state was sent."""
    starts = run.plant["encode state start"] / 1e3
    due = np.arange(len(starts)) * period * 1e6
    late: NDArray[np.float64] = (starts - due)[WARM_UP_TICKS:]
    late -= late.min()
    return late


def _answer_us(run: GraphRun) -> NDArray[np.float64]:
    """From a state's encoding to its command's arrival."""
    starts = run.plant["encode state start"]
    ticks, arrivals = run.plant["command_ticks"], run.plant["decode command start"]
    answers: NDArray[np.float64] = (arrivals - starts[ticks])[WARM_UP_TICKS:] / 1e3
    return answers
