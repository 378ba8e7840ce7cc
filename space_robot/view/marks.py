"""Marks on the time axis of a flight: events, faults, changes of law, the Earth's shadow."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise
from typing import NamedTuple

from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.bag.law_history import LawChange, laws_of
from space_robot_msgs_py.errors import InputError
from space_robot_sim.environment.events import Capture, Event
from space_robot_sim.faults.grammar import Fault, parse_fault

from ..analysis.described import events_of
from ..scenario.faults import KINDS
from .orbit_frames import shadow_intervals


class Mark(NamedTuple):
    """A mark on the plots of a flight."""

    start: float
    """Start, s."""
    stop: float
    """End, s: equal to ``start`` for an instant, infinite for a permanent change."""
    text: str
    kind: str
    """``event``, ``fault``, ``law`` or ``shadow``."""


def marks_of(log: FlightLog) -> list[Mark]:
    """Return the marks of a flight, by time; invalid entries of the bag are ignored."""
    period = log.timebase.period
    start = log.first_tick * period
    end = start + log.ticks * period
    marks = [_of_event(event) for event in _events(log)]
    marks += [_of_fault(fault) for fault in _faults(log)]
    marks += [
        Mark(law.tick * period, law.tick * period, str(LawChange(before, law)), "law")
        for before, law in pairwise(laws_of(log))
    ]
    marks += [
        Mark(begin, stop, "in the Earth's shadow", "shadow")
        for begin, stop in shadow_intervals(log)
    ]
    return sorted(mark for mark in marks if mark.start < end and mark.stop >= start)


def shared_marks(flights: Mapping[str, FlightLog]) -> list[Mark]:
    """Return the marks of some flights, by time, with flight names unless all have the mark."""
    of_each = {name: marks_of(log) for name, log in flights.items()}
    every = sorted({mark for marks in of_each.values() for mark in marks})
    shared = []
    for mark in every:
        names = [name for name, marks in of_each.items() if mark in marks]
        if len(names) < len(of_each):
            mark = mark._replace(text=f"{', '.join(names)}: {mark.text}")
        shared.append(mark)
    return shared


def _of_event(event: Event) -> Mark:
    text = f"capture {event.target.name}" if isinstance(event, Capture) else "release"
    return Mark(event.time_s, event.time_s, text, "event")


def _events(log: FlightLog) -> list[Event]:
    try:
        return events_of(log)
    except InputError:
        return []


def _faults(log: FlightLog) -> list[Fault]:
    faults = []
    for text in log.flight.get("faults", ()):
        try:
            faults.append(parse_fault(str(text), KINDS))
        except InputError:
            continue
    return faults


def _of_fault(fault: Fault) -> Mark:
    stop = fault.stop_s if fault.kind.lasts else fault.start_s
    return Mark(fault.start_s, stop, f"{fault.kind.name} {fault.argument}".strip(), "fault")
