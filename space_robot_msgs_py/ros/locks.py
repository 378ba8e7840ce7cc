"""Locks of ROS domains and nodes, released by the kernel when their holder ends.

Two plants or two controllers in one domain would answer each other's ticks. Discovery is too slow
to prevent that, and lists a killed node for another 20 s. Each lock is a file in the temporary
folder with the name of its holder; the file remains after the release.
"""

from __future__ import annotations

import fcntl
import os
import tempfile
import time
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import NamedTuple

from ..errors import InputError
from ..topics import ROOT
from .process import starter

TRIES, PAUSE_S = 5, 0.01
"""Time to retry: a lock that is only being inspected is free again at once."""


class Holder(NamedTuple):
    """Holder of a lock."""

    name: str
    """Name with pid."""
    starter: int
    """Pid of the process that holds its lifeline; 0: none."""


class HeldError(InputError):
    """Another process holds the lock."""

    def __init__(self, path: Path, holder: Holder) -> None:
        super().__init__(f"{path} is held by {holder.name}")
        self.holder = holder


def node_lock(domain: int, node: str) -> Path:
    """Return the lock file of a node, given by full name."""
    # ROS names contain neither dots nor @, so all nodes have different files
    return _path(f"{domain}@{node.replace('/', '.')}")


def domain_lock(domain: int, namespace: str = ROOT) -> Path:
    """Return the lock file of the command that started a graph in a domain and namespace."""
    return _path(f"{domain}" if namespace == ROOT else f"{domain}+{namespace.replace('/', '.')}")


def _path(name: str) -> Path:
    return Path(tempfile.gettempdir()) / f"space_robot_{name}.lock"


class FileLock:
    """A lock, held until `release` or the end of the process."""

    def __init__(self, path: Path, name: str) -> None:
        """Acquire the lock as ``name``.

        Raises:
            HeldError: another process holds it.
            InputError: the file cannot be locked.
        """
        self._descriptor = _open(path)
        for _ in range(TRIES):
            if _try(self._descriptor, fcntl.LOCK_EX):
                break
            time.sleep(PAUSE_S)
        else:
            holder = _holder(self._descriptor)
            self.release()
            raise HeldError(path, holder)
        os.ftruncate(self._descriptor, 0)
        os.pwrite(self._descriptor, f"{name} (pid {os.getpid()})\n{starter()}".encode(), 0)

    def release(self) -> None:
        """Release the lock."""
        os.close(self._descriptor)


def commands_in(domain: int) -> list[Holder]:
    """Return the commands that started graphs in a domain, in any namespace."""
    lone, others = domain_lock(domain), domain_lock(domain, "/*")
    return _holders([lone, *lone.parent.glob(others.name)])


def nodes_in(domain: int, namespace: str = ROOT) -> list[Holder]:
    """Return the nodes of this project in a namespace of a domain, without nested namespaces."""
    wanted = node_lock(domain, f"{namespace.rstrip('/')}/*")
    files = wanted.parent.glob(wanted.name)
    return _holders([path for path in files if path.name.count(".") == wanted.name.count(".")])


def living_nodes(name: str, namespace: str = "") -> Iterator[tuple[int, str]]:
    """Yield domain and namespace of this machine's nodes, the newest first.

    Nodes have the ``name`` (without namespace) and the ``namespace``; empty: any.
    """
    start, end = _path("").stem, f".{name}.lock"
    files = _path("").parent.glob(f"{start}*@*{end}")
    for path in sorted(files, key=lambda file: file.stat().st_mtime, reverse=True):
        domain, _, dotted = path.name.removeprefix(start).removesuffix(end).partition("@")
        own_namespace = dotted.replace(".", "/") or ROOT
        if domain.isdecimal() and namespace in ("", own_namespace) and is_held(path):
            yield int(domain), own_namespace


def _holders(paths: Iterable[Path]) -> list[Holder]:
    holders = []
    for path in sorted(paths):
        try:
            descriptor = _open(path)
        except InputError:
            continue
        if not _try(descriptor, fcntl.LOCK_SH):
            holders.append(_holder(descriptor))
        os.close(descriptor)
    return holders


def is_held(path: Path) -> bool:
    """Return True if a lock is held."""
    return bool(_holders([path]))


def _try(descriptor: int, kind: int) -> bool:
    try:
        fcntl.flock(descriptor, kind | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    return True


def _holder(descriptor: int) -> Holder:
    text = os.pread(descriptor, 1000, 0).decode(errors="replace")
    name, _, started_by = text.partition("\n")
    return Holder(name or "another process", int(started_by) if started_by.isdecimal() else 0)


def _open(path: Path) -> int:
    # for all users: the whole machine shares a domain
    flags = os.O_RDWR | os.O_NOFOLLOW
    try:
        if path.exists():  # Linux refuses O_CREAT for other users' files in /tmp
            return os.open(path, flags)
        descriptor = os.open(path, flags | os.O_CREAT, 0o666)
        os.fchmod(descriptor, 0o666)  # independent of the umask
        return descriptor
    except OSError as error:
        raise InputError(f"{path}: cannot be locked ({error.strerror})") from None
