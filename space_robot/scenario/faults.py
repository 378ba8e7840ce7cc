"""Catalogue of all kinds of faults, including faults of node processes.

The plant's faults stand beside what they spoil; a process is killed or stopped by the orchestrator
(`space_robot.flight.graph.following`).
"""

from __future__ import annotations

import math

from space_robot_sim.faults.grammar import Argument, Kind, by_name
from space_robot_sim.plant.settings import PLANT_KINDS

_SECONDS = Argument("SECONDS", "s of the wall clock", 0.0, 1e6, default=math.inf)
_NODES = ("controller", "recorder", "mission")

KILLS = {
    node: Kind(f"kill_{node}", None, f"the {node}'s process is killed", lasts=False)
    for node in _NODES
}
"""Kinds of faults that kill a process, by node."""
STOPS = {
    node: Kind(
        f"stop_{node}",
        _SECONDS,
        f"the {node}'s process is stopped, and continues after SECONDS",
        lasts=False,
    )
    for node in _NODES
}
"""Kinds of faults that stop a process for a while, by node."""
FAULTED_NODES = {kind: node for kinds in (KILLS, STOPS) for node, kind in kinds.items()}
"""Node affected by each kind of fault."""

PROCESS_KINDS = by_name(*(kinds[node] for node in _NODES for kinds in (KILLS, STOPS)))
"""All kinds that the orchestrator causes, by name."""
KINDS = by_name(*PLANT_KINDS.values(), *PROCESS_KINDS.values())
"""All kinds by name: the plant's, then the orchestrator's."""
