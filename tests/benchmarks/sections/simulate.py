"""A whole flight in one process."""

from __future__ import annotations

from collections.abc import Callable

from space_robot.analysis import analyze
from space_robot.flight.plan import Flight, FlightPlan, resolve
from space_robot.flight.simulate import simulate as fly
from space_robot_msgs_py.bag.flight_log import FlightLog

from ..measure import Options, interleave, repeated
from ..result import Result, Target

DURATION_S = 30.0
TARGETS = {"tde_stc": Target(0.6, 0.4)}
"""Asked of a flight, s."""


def simulate(options: Options) -> list[Result]:
    """30 s closed loop, warm: reading the plan, flying, and (in rows of its own) analysing."""
    duration = 0.1 if options.short else DURATION_S
    laws = ("tde_stc", "ctc")
    parts: dict[str, Callable[[], object]] = {}
    for law in laws:
        plan = FlightPlan(controller=law, duration=duration)
        parts[law] = lambda plan=plan: _flight(plan)  # type: ignore[misc]
        parts[f"{law}, analyzed"] = lambda plan=plan: analyze(_flight(plan))  # type: ignore[misc]
    options.progress(f"flights of {duration:g} s in this process")
    seconds = interleave(
        {name: repeated(part) for name, part in parts.items()},
        options.batches(usual=7),
        batch_s=options.batch_s,
    )
    targets = {} if options.short else TARGETS
    return [
        Result.timed(
            f"{name}, {duration:g} s", "s", times, ("real time", [duration]), targets.get(name)
        )
        for name, times in seconds.items()
    ]


def _flight(plan: FlightPlan) -> FlightLog:
    return fly(Flight(resolve(plan)))
