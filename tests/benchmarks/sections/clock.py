"""The graph by the wall clock: how many ticks are answered in time, how evenly they come."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from space_robot.flight.plan import Flight, FlightPlan, resolve

from ..graph_flights import WARM_UP_TICKS, GraphRun, fly_graph
from ..measure import Options
from ..result import Result, Target

DURATION_S = 60.0
ANSWERED_ASKED = Target(99.9)
FIFO_PRIORITY = 50


def clock(options: Options) -> list[Result]:
    """60 s at 2 kHz: the share answered within the tick, lateness of ticks, answer times.

    Under the usual scheduling, and under SCHED_FIFO where it is granted.
    """
    duration = 1.0 if options.short else DURATION_S
    count = 1 if options.short else options.batches(usual=3)
    runs: dict[str, list[GraphRun]] = {"usual": [], "FIFO": []}
    flights = {
        name: Flight(resolve(FlightPlan(duration=duration, realtime=True, fifo_priority=priority)))
        for name, priority in (("usual", 0), ("FIFO", FIFO_PRIORITY))
    }
    for k in range(count):
        for name, flight in flights.items():
            options.progress(f"{duration:g} s by the wall clock, {name}, {k + 1} of {count}")
            runs[name].append(fly_graph(flight))
    target = options.asked(ANSWERED_ASKED)
    return [
        row for name, flight in flights.items() for row in _rows(name, flight, runs[name], target)
    ]


def _rows(name: str, flight: Flight, runs: list[GraphRun], target: Target | None) -> list[Result]:
    answered = tuple(100.0 * _answered_in_time(run, flight) for run in runs)
    lost = sum(sum(run.lost.values()) for run in runs)
    rows = [
        Result(
            f"{name}: ticks answered in time",
            "%",
            answered,
            better="more",
            target=target,
            note=f"{lost} messages lost",
        )
    ]
    for what, times in (
        ("a tick comes late by", [_lateness_us(run, flight.period) for run in runs]),
        ("answer after", [_answer_us(run) for run in runs]),
    ):
        for label, percentile in (("p50", 50.0), ("p99", 99.0), ("max", 100.0)):
            samples = tuple(float(np.percentile(t, percentile)) for t in times)
            rows.append(Result(f"{name}: {what}, {label}", "us", samples))
    return rows


def _answered_in_time(run: GraphRun, flight: Flight) -> float:
    return 1.0 - int(run.plant["missed_deadlines"]) / flight.ticks


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
    answers: NDArray[np.float64] = (arrivals - starts[ticks]) / 1e3
    return answers[min(WARM_UP_TICKS, len(answers) // 2) :]  # on a busy machine there are few
