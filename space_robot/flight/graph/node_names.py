"""The nodes of a flight by name."""

from collections.abc import Collection

ORDER = ("recorder", "mission", "controller", "plant")
"""The order in which they are activated."""
NODE_NAMES = tuple(f"{node}_node" for node in ORDER)
"""Names of nodes and executables, in that order."""
PLANT = NODE_NAMES[-1]
MISSION = NODE_NAMES[1]


def started_nodes(without: Collection[str]) -> tuple[str, ...]:
    """Return the names of the nodes that a flight starts, in `ORDER`."""
    return tuple(f"{node}_node" for node in ORDER if node not in without)
