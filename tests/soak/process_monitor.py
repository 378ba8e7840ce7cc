"""The processes that a flight starts, counted and weighed from outside."""

from __future__ import annotations

import re
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from threading import Event, Thread

import psutil

from space_robot.processes.node_modules import MODULES

SAMPLE_S = 0.25
GRACE_S = 2.0
"""Processes have that long to go when a flight is over."""
SHARED_MEMORY = Path("/dev/shm")


class ProcessMonitor:
    """Watches this process' descendants until the context is left, but those of before."""

    def __init__(self) -> None:
        self.peak_mb: dict[str, float] = {}
        """Largest resident set of each node."""
        self.left_behind: list[str] = []
        """Processes that still ran when the flight was over (they are killed), with their pid."""
        self._seen: dict[psutil.Process, str] = {}
        self._before = set(psutil.Process().children(recursive=True))
        """Such as the server that forks the nodes of all flights."""
        self._over = Event()
        self._thread = Thread(target=self._watch, daemon=True)

    def __enter__(self) -> ProcessMonitor:
        self._thread.start()
        return self

    def __exit__(self, *exception: object) -> None:
        self._over.set()
        self._thread.join()
        _, alive = psutil.wait_procs(list(self._seen), timeout=GRACE_S)
        for process in alive:
            self.left_behind.append(f"{self._seen[process]} (pid {process.pid})")
            with suppress(psutil.Error):
                process.kill()

    def _watch(self) -> None:
        this = psutil.Process()
        while not self._over.wait(SAMPLE_S):
            for process in set(this.children(recursive=True)) - self._before:
                with suppress(psutil.Error):
                    self._weigh(process)

    def _weigh(self, process: psutil.Process) -> None:
        if self._seen.get(process) not in MODULES:  # seen before it became the node, it still may
            words = process.cmdline()
            self._seen[process] = node_of(words) or " ".join(words[:3])
        name, mb = self._seen[process], process.memory_info().rss / 1e6
        if name in MODULES:
            self.peak_mb[name] = max(mb, self.peak_mb.get(name, 0.0))


def node_of(command: Sequence[str]) -> str:
    """Return the node that a command line runs, as a module or a script; empty if none."""
    for node in MODULES:
        if any(re.search(rf"(?:^|[./]){node}_node$", word) for word in command):
            return node
    return ""


def shared_memory_files() -> int:
    """Count the files of Fast DDS in shared memory; killed processes leave theirs behind."""
    return sum(1 for _ in SHARED_MEMORY.glob("fastrtps_*"))
