"""What can keep an unchanged controller from giving the recorded bits again."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any


def reasons(
    flight: Mapping[str, Any],
    *,
    has_laws: bool,
    begins_late: bool,
    by_the_clock: bool,
    is_finished: bool,
) -> Iterator[str]:
    """A sentence each, for a replay of a recorded ``flight``."""
    if begins_late:
        yield (
            "it does not begin where the flight did: laws with memory start afresh, and every law "
            "takes over from the applied torque within 20 ms"
        )
    if by_the_clock:
        yield "by the wall clock the controller may miss states, and a law's memory with them"
    faults = " ".join(flight.get("faults", []))
    if not has_laws and (flight.get("restart_controller") or "_controller" in faults):
        yield "the controller was stopped or started again in flight, the replayed one is not"
    if not has_laws:
        yield "the bag has no record of laws and gains changed in flight with `ros2 param set`"
    if "_mission" in faults:
        yield "the mission was killed or stopped: references may have come late in flight"
    if not flight:
        yield "the bag does not say what was flown: case, gains and swaps are a guess"
    elif "parameters" not in flight:
        yield "the bag is an older one: parameters changed with --set are not in it"
    if not is_finished:
        yield "the bag was not finished: played up to its last command"
