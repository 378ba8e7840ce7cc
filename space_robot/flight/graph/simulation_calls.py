"""Calls that pause, step and reset a running graph, from outside."""

from __future__ import annotations

import time
import uuid
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from space_robot_msgs_py.config.validation import full_namespace
from space_robot_msgs_py.errors import FlightError, InputError
from space_robot_msgs_py.ros.locks import is_held, living_nodes, node_lock
from space_robot_sim.plant.settings import MOST_TICKS

from .domain import domain_asked_for
from .node_names import MISSION, PLANT
from .node_services import Check, TemporaryNode, call_trigger, set_parameters

FIND_S = 5.0
"""Discovery of a running node takes 0.1 to 1.8 s."""
POLL_S = 0.02


def call_simulation(action: str, domain: int | None, namespace: str, ticks: int = 1) -> str:
    """Call ``pause``, ``resume``, ``step`` or ``reset`` of a plant; return its message.

    Args:
        action: one of these.
        domain: its ROS domain (None: ROS_DOMAIN_ID, or that of the only plant on this machine).
        namespace: its namespace.
        ticks: of a step.

    Raises:
        InputError: no plant is there, or ``ticks`` cannot be.
        FlightError: the plant refuses.
    """
    if not 1 <= ticks <= MOST_TICKS:
        raise InputError(f"--ticks {ticks}: 1 to {MOST_TICKS} were expected")
    service = f"{PLANT}/{action}"
    with _caller("simulation_call", service, domain, namespace) as (node, check):
        if action == "step":
            set_parameters(node, PLANT, {"step_ticks": ticks}, check)
        success, text = call_trigger(node, service, check)
    if not success:
        raise FlightError(f"{PLANT} cannot {action}: {text}")
    return text


def go_to(segment: str, domain: int | None, namespace: str) -> None:
    """Have the mission of a running graph fly a segment, in place of what it was to fly.

    Raises:
        InputError: no mission is there.
        FlightError: the segment is refused; the flight goes on as it was.
    """
    service = f"{MISSION}/set_parameters_atomically"
    with _caller("goto", service, domain, namespace) as (node, check):
        # a text of its own: the mission ignores one that it has had
        set_parameters(node, MISSION, {"goto": f"{segment} # {uuid.uuid4()}"}, check)


@contextmanager
def _caller(
    name: str, service: str, domain: int | None, namespace: str
) -> Iterator[tuple[Any, Check]]:
    """Join the graph of a service with a node; yield it with a check that the service is there."""
    namespace = full_namespace(namespace)
    domain = domain_asked_for(domain)
    domain = _plant_domain(namespace) if domain is None else domain
    visitor = TemporaryNode(name, domain, namespace)
    try:
        yield visitor.node, _wait_for(visitor.node, service, domain)
    finally:
        visitor.leave()


def _plant_domain(namespace: str) -> int:
    """Return the domain of the only plant of a ``namespace`` on this machine."""
    domains = sorted(domain for domain, _ in living_nodes(PLANT, namespace))
    if len(domains) != 1:
        name = f"{namespace.rstrip('/')}/{PLANT}"
        there = f"in ROS domains {', '.join(map(str, domains))}" if domains else "on this machine"
        number = "several" if domains else "no"
        raise InputError(f"{number} {name} {there}: name one's ROS domain with --domain")
    return domains[0]


def _wait_for(node: Any, service: str, domain: int) -> Check:
    """Wait for a service; return a check that its node is still there."""
    until = time.monotonic() + FIND_S
    while not node.count_services(service):
        if time.monotonic() > until:
            name = node.resolve_service_name(service)
            raise InputError(f"no service {name} in ROS domain {domain}: is a graph flying there?")
        time.sleep(POLL_S)
    name = service.rpartition("/")[0]
    lock = node_lock(domain, node.resolve_service_name(name))
    is_here = is_held(lock)  # on this machine: discovery lists a killed node for another 20 s

    def check() -> None:
        if not node.count_services(service) or (is_here and not is_held(lock)):
            raise FlightError(f"{name} has gone")

    return check
