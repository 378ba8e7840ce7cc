"""A ROS domain of its own for every run: two runs in one domain would hear each other."""

from __future__ import annotations

import os
import socket
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from space_robot_msgs_py.errors import FlightError, InputError
from space_robot_msgs_py.ros.lifeline import PATIENCE_S
from space_robot_msgs_py.ros.locks import FileLock, HeldError, Holder, domain_lock, nodes_in

DOMAINS = range(1, 102)
"""Domains whose ports stay below Linux' ephemeral range."""
LOOK_S = 0.05

_held: set[int] = set()
"""Domains that this process has already."""


@contextmanager
def ros_domain(given: int | None = None) -> Iterator[int]:
    """``given``, or the user's ROS_DOMAIN_ID, or a free one; held until the context ends.

    Raises:
        InputError: that domain has nodes of this project, or a command that has started some.
        FlightError: none is free.
    """
    of_user = os.environ.get("ROS_DOMAIN_ID", "")
    if given is None and of_user.isdecimal():
        given = int(of_user)
    domain, lock = _free_domain() if given is None else (given, _take(given))
    _held.add(domain)
    try:
        yield domain
    finally:
        if lock:
            _held.remove(domain)
            lock.release()


def _free_domain() -> tuple[int, FileLock]:
    start = os.getpid() % len(DOMAINS)
    for domain in [*DOMAINS[start:], *DOMAINS[:start]]:
        try:
            lock = FileLock(domain_lock(domain), "space-robot")
        except InputError:
            continue
        if not _in_use(domain):
            return domain, lock
        lock.release()
    raise FlightError("no free ROS domain between 1 and 101: set ROS_DOMAIN_ID")


def _take(domain: int) -> FileLock | None:
    """The lock of a domain that the user wants; None: this process has it."""
    if domain in _held:
        return None
    try:
        lock = FileLock(domain_lock(domain), "space-robot")
    except HeldError as error:
        raise _refusal(domain, error.holder) from None
    try:
        _see_that_nobody_is_there(domain)
    except BaseException:
        lock.release()
        raise
    return lock


def _see_that_nobody_is_there(domain: int) -> None:
    """Refuse nodes, but wait for those that are ending because their starter has been killed."""
    until = time.monotonic() + PATIENCE_S
    while nodes := nodes_in(domain):
        for node in nodes:
            if not node.starter or _is_alive(node.starter) or time.monotonic() > until:
                raise _refusal(domain, node)
        time.sleep(LOOK_S)


def _refusal(domain: int, holder: Holder) -> InputError:
    return InputError(
        f"ROS domain {domain} is taken by {holder.name}: end that one, or take another domain "
        "with --domain, or ROS_DOMAIN_ID"
    )


def _is_alive(pid: int) -> bool:
    """Tell if a process runs; one that has ended and is only waited for (state Z) does not."""
    try:
        stat = Path(f"/proc/{pid}/stat").read_text("utf-8", errors="replace")
    except OSError:
        return False
    return stat.rpartition(")")[2].split()[0] != "Z"


def _in_use(domain: int) -> bool:
    """Tell if some participant has the domain's first unicast port (DDS-RTPS 9.6.2)."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.bind(("", 7410 + 250 * domain))
        except OSError:
            return True
    return False
