"""Degradations of a complete flight, from the last reports of its nodes."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import NamedTuple

MISSION_FAULTS = frozenset({"kill_mission", "stop_mission"})
_NOT_USED = re.compile(r"(rejected|refused): (another publisher's on /|reference: )")


class Degradation(NamedTuple):
    """Failures and warnings of a flight, as one-line texts."""

    failures: list[str]
    """Reasons why the flight differs from the plan."""
    warnings: list[str]
    """Anomalies without consequences."""


def degradation(
    nodes: Mapping[str, Mapping[str, str]], fault_kinds: frozenset[str], realtime: bool
) -> Degradation:
    """Return the degradations of a flight.

    A reference that was held is another motion than the mission's. In lockstep nothing but a fault
    of the mission can bring that about; by the wall clock any delay can.

    Args:
        nodes: the values that each node reported last, by its name.
        fault_kinds: what was made to fail.
        realtime: whether it was flown by the wall clock.
    """
    degraded = Degradation([], [])
    for node, values in nodes.items():
        held = int(values.get("references_held", 0))
        if held and not fault_kinds & MISSION_FAULTS:
            text = f"{node} held the reference for {held} ticks, for the mission's did not come"
            (degraded.warnings if realtime else degraded.failures).append(text)
        degraded.warnings.extend(
            f"{node} {key}: {count} messages"
            for key, count in values.items()
            if _NOT_USED.match(key)
        )
    return degraded
