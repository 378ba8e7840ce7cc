"""Temporary folders. Folders of killed processes are removed by the next process."""

from __future__ import annotations

import fcntl
import os
import shutil
import stat
import tempfile
import time
import weakref
from contextlib import suppress
from pathlib import Path

PREFIX = "space_robot_scratch_"
NEW_S = 60.0
"""Age below which a folder may not be locked by its process yet, s."""


class ScratchFolder(tempfile.TemporaryDirectory[str]):
    """`TemporaryDirectory` locked by its process and its children while they run."""

    def __init__(self) -> None:
        """Make a folder, and remove those of processes that were killed."""
        remove_stale_folders()
        super().__init__(prefix=PREFIX)
        lock = os.open(self.name, os.O_RDONLY | os.O_DIRECTORY)
        weakref.finalize(self, os.close, lock)
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)


def remove_stale_folders() -> None:
    """Remove the folders of this user that no running process has locked."""
    for folder in Path(tempfile.gettempdir()).glob(f"{PREFIX}*"):
        with suppress(OSError):  # of somebody else, in use, or gone by now
            status = folder.lstat()
            is_own = stat.S_ISDIR(status.st_mode) and status.st_uid == os.geteuid()
            if not is_own or time.time() < status.st_mtime + NEW_S:
                continue
            lock = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW)
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
                shutil.rmtree(folder, ignore_errors=True)
            finally:
                os.close(lock)
