"""Separate ROS domain for every run, or a namespace in a domain chosen by the user.

Two runs in one namespace would hear each other; in two they do not.
"""

from __future__ import annotations

import os
import socket
import time
from collections.abc import Callable, Collection, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from space_robot_msgs_py import topics
from space_robot_msgs_py.errors import FlightError, InputError
from space_robot_msgs_py.ros.locks import (
    FileLock,
    HeldError,
    Holder,
    commands_in,
    domain_lock,
    nodes_in,
)
from space_robot_msgs_py.ros.process import TIMEOUT_S, defaults
from space_robot_msgs_py.topics import ROOT

DOMAINS = range(1, 101)
"""Domains with all ports below Linux' ephemeral range, which begins at 32768."""
POLL_S = 0.05
DISCOVERY_S = 2.0
"""A node that was there before is discovered in 0.1 to 1.8 s (Fast DDS of Jazzy, measured)."""
PORT_BASE, PORTS = 7400, 250
UDP_TABLES = (Path("/proc/net/udp"), Path("/proc/net/udp6"))
PEERS = "ROS_STATIC_PEERS"

_held: set[tuple[int, str]] = set()
"""Domains and namespaces held by this process."""


@contextmanager
def ros_domain(
    number: int | None = None, namespace: str = ROOT, welcome: Collection[str] = ()
) -> Iterator[int]:
    """``number``, or the user's ROS_DOMAIN_ID, or a free one; held until the context ends.

    Others may have another ``namespace`` of a domain that the user names. Nodes with the names
    ``welcome`` may be there.
    """
    number = domain_asked_for(number)
    domain, lock = (
        _free_domain(namespace) if number is None else (number, _take(number, namespace, welcome))
    )
    _held.add((domain, namespace))
    try:
        yield domain
    finally:
        if lock:
            _held.remove((domain, namespace))
            lock.release()


def domain_asked_for(domain: int | None) -> int | None:
    """Return ``domain``, or the user's ROS_DOMAIN_ID; None if neither is set."""
    chosen = os.environ.get("ROS_DOMAIN_ID", "")
    return int(chosen) if domain is None and chosen.isdecimal() else domain


def _free_domain(namespace: str) -> tuple[int, FileLock]:
    start = os.getpid() % len(DOMAINS)
    for domain in [*DOMAINS[start:], *DOMAINS[:start]]:
        try:
            lock = FileLock(domain_lock(domain, namespace), "space-robot")
        except InputError:
            continue
        if len(commands_in(domain)) == 1 and not _in_use(domain):
            return domain, lock
        lock.release()
    raise FlightError(
        f"no free ROS domain between {DOMAINS[0]} and {DOMAINS[-1]}: set ROS_DOMAIN_ID"
    )


def _take(domain: int, namespace: str, welcome: Collection[str]) -> FileLock | None:
    if (domain, namespace) in _held:
        return None
    try:
        lock = FileLock(domain_lock(domain, namespace), "space-robot")
    except HeldError as error:
        raise _refusal(domain, namespace, error.holder) from None
    try:
        _refuse_occupied(domain, namespace, welcome)
    except BaseException:
        lock.release()
        raise
    return lock


def _refuse_occupied(domain: int, namespace: str, welcome: Collection[str]) -> None:
    until = time.monotonic() + TIMEOUT_S
    while nodes := [
        node for node in nodes_in(domain, namespace) if node.name.split()[0] not in welcome
    ]:
        for node in nodes:
            if not node.starter or _is_alive(node.starter) or time.monotonic() > until:
                raise _refusal(domain, namespace, node)
        time.sleep(POLL_S)


def _refusal(domain: int, namespace: str, holder: Holder) -> InputError:
    where = "" if namespace == ROOT else f"namespace {namespace} of "
    error = InputError(
        f"{where}ROS domain {domain} is taken by {holder.name}: end that one, take another domain "
        "with --domain, or ROS_DOMAIN_ID, or fly in a namespace of its own with fly --namespace"
    )
    error.help_topic = "ros"
    return error


def is_quiet(domain: int) -> bool:
    """Return True if a domain is certainly empty: local discovery, no port in use.

    Middlewares use the ports of DDS-RTPS 9.6.2, 250 per domain, unless configured otherwise.
    """
    environment = {**defaults(), **os.environ}
    if environment["ROS_AUTOMATIC_DISCOVERY_RANGE"] != "LOCALHOST" or environment.get(PEERS):
        return False
    try:
        return not _ports_in_use(domain)
    except OSError:
        return False


def _ports_in_use(domain: int) -> bool:
    first = PORT_BASE + PORTS * domain
    lines = [line for file in UDP_TABLES for line in file.read_text("ascii").splitlines()[1:]]
    ports = (int(line.split()[1].rpartition(":")[2], 16) for line in lines)
    return any(first <= port < first + PORTS for port in ports)


def refuse_publishers(
    node: Any,
    joined_at: float,
    names: Sequence[str],
    foreign: Collection[topics.Topic],
    check: Callable[[], None],
) -> None:
    """Wait until all earlier nodes are discovered; refuse those that publish a flight's topics.

    ``joined_at``: when ``node`` was made, by the monotonic clock; ``names``: of the flight's nodes;
    ``foreign``: topics that the user's nodes publish.
    """
    from space_robot_msgs_py.ros.endpoints import full_node_name

    namespace = node.get_namespace().rstrip("/")
    # discovery shows a node, also one of ours, without its name for a moment
    own = {f"{namespace}/{name}" for name in names} | {"/_NODE_NAME_UNKNOWN_"}
    is_discovered = False
    while not is_discovered:
        check()
        time.sleep(POLL_S)
        is_discovered = time.monotonic() >= joined_at + DISCOVERY_S
        for topic in (topic for topic in topics.RECORDED if topic not in foreign):
            infos = node.get_publishers_info_by_topic(topic.name)
            if others := sorted({full_node_name(info) for info in infos} - own):
                raise InputError(
                    f"{node.resolve_topic_name(topic.name)} is also published by "
                    f"{', '.join(others)}: end that, or take another domain with --domain, or "
                    "ROS_DOMAIN_ID"
                )


def _is_alive(pid: int) -> bool:
    try:
        stat = Path(f"/proc/{pid}/stat").read_text("utf-8", errors="replace")
    except OSError:
        return False
    return stat.rpartition(")")[2].split()[0] != "Z"


def _in_use(domain: int) -> bool:
    with suppress(OSError):
        return _ports_in_use(domain)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.bind(("", PORT_BASE + 10 + PORTS * domain))
        except OSError:
            return True
    return False
