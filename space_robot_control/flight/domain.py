"""A ROS domain of its own for every run: two runs in one domain would hear each other."""

from __future__ import annotations

import fcntl
import os
import socket
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from space_robot_msgs_py.errors import FlightError

DOMAINS = range(1, 102)
"""Domains whose ports stay below Linux' ephemeral range."""


@contextmanager
def ros_domain(given: int | None = None) -> Iterator[int]:
    """``given``, or the user's ROS_DOMAIN_ID, or a free one held until the context ends.

    Raises:
        FlightError: none is free.
    """
    of_user = os.environ.get("ROS_DOMAIN_ID", "")
    if given is None and of_user.isdecimal():
        given = int(of_user)
    if given is not None:
        yield given
        return
    start = os.getpid() % len(DOMAINS)
    for domain in [*DOMAINS[start:], *DOMAINS[:start]]:
        lock = Path(tempfile.gettempdir()) / f"space_robot_domain_{domain}_{os.getuid()}.lock"
        with lock.open("w") as held:
            try:
                fcntl.flock(held, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except OSError:
                continue
            if _in_use(domain):
                continue
            yield domain
            return
    raise FlightError("no free ROS domain between 1 and 101: set ROS_DOMAIN_ID")


def _in_use(domain: int) -> bool:
    """Whether some participant has the domain's first unicast port (DDS-RTPS 9.6.2)."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.bind(("", 7410 + 250 * domain))
        except OSError:
            return True
    return False
