"""The nodes of a flight by name."""

ORDER = ("recorder", "mission", "controller", "plant")
"""The order in which they are activated."""
NODE_NAMES = tuple(f"{node}_node" for node in ORDER)
"""Names of nodes and executables, in that order."""
PLANT = NODE_NAMES[-1]
MISSION = NODE_NAMES[1]
