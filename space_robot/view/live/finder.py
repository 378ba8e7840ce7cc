"""Discovery of running plants: ROS domain and namespace."""

from __future__ import annotations

from typing import NamedTuple

from space_robot_msgs_py import topics
from space_robot_msgs_py.config.validation import full_namespace
from space_robot_msgs_py.ros.locks import living_nodes, nodes_in

from ...flight.graph.domain import domain_asked_for
from ...flight.graph.node_names import PLANT
from ...flight.graph.node_services import TemporaryNode

MOST_NAMES = 5
"""Maximum number of nodes listed in a message."""


class FlightPlace(NamedTuple):
    """ROS domain and namespace of a flight."""

    domain: int
    namespace: str

    def __str__(self) -> str:
        where = "" if self.namespace == topics.ROOT else f"namespace {self.namespace} of "
        return f"{where}ROS domain {self.domain}"


class Finder:
    """Finds a running plant in a ROS domain, or on this machine.

    In a domain it is found by its topics, on any machine. Without a domain it is found by the locks
    of this machine's nodes, because `fly` chooses a free domain by default.
    """

    def __init__(self, domain: int | None = None, namespace: str = "") -> None:
        """Start the search.

        Args:
            domain: None: that of ROS_DOMAIN_ID, if it is set.
            namespace: of the robot; empty: any.

        Raises:
            InputError: invalid namespace.
        """
        self._namespace = full_namespace(namespace) if namespace else ""
        domain = domain_asked_for(domain)
        self._node = None if domain is None else TemporaryNode("viewer_looks", domain)
        self._domain = domain

    def find(self) -> FlightPlace | None:
        """Return the place of a plant: the last started one on this machine; None if none runs."""
        if self._domain is not None:
            places = sorted(self._publishing())
            return FlightPlace(self._domain, places[0]) if places else None
        newest = next(living_nodes(PLANT, self._namespace), None)
        return FlightPlace(*newest) if newest else None

    def describe(self) -> str:
        """Return a description of the search and its results."""
        if self._domain is None:
            return "no plant runs on this machine"
        assert self._node is not None
        own = self._node.node.get_name()
        names = sorted({name for name in self._node.node.get_node_names() if name != own})
        nodes = ", ".join(names[:MOST_NAMES]) + (", ..." if len(names) > MOST_NAMES else "")
        seen = f"nodes {nodes}, but no publisher of base/state" if names else "no other node"
        return f"ROS domain {self._domain} has {seen}"

    def is_there(self, place: FlightPlace) -> bool:
        """Return True if a discovered plant still runs."""
        if self._domain is not None:
            return place.namespace in self._publishing()
        return any(PLANT in node.name for node in nodes_in(place.domain, place.namespace))

    def _publishing(self) -> set[str]:
        """Return the namespaces of the domain whose base state is published."""
        assert self._node is not None
        node, last = self._node.node, topics.BASE_STATE
        places = set()
        for name, types in node.get_topic_names_and_types():
            if last.type in types and name.endswith(f"/{last.name}"):
                places.add(name.removesuffix(f"/{last.name}") or topics.ROOT)
        wanted = {self._namespace} if self._namespace else places
        return {n for n in places & wanted if node.count_publishers(last.in_namespace(n))}

    def close(self) -> None:
        """Leave the domain."""
        if self._node:
            self._node.leave()
