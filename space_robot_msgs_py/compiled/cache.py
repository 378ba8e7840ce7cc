"""Folder of the compiled code on disk; its name is a digest of the sources."""

from __future__ import annotations

import hashlib
import os
import shutil
import stat
import sys
import tempfile
from functools import cache
from pathlib import Path

ROOM_BYTES = 16 << 20
"""Required free space for a complete cache, with reserve."""


@cache
def cache_directory() -> Path:
    """Return the folder of compiled kernels: ``NUMBA_CACHE_DIR`` or the user's cache, by digest.

    If it cannot be written, a private folder among the temporary files is used.
    """
    here = Path(__file__).resolve()
    root = here.parents[2]
    digest = hashlib.sha256(str(root).encode())  # one cache per installation, as in Numba
    for source in sorted(root.glob("space_robot*/**/*.py")):
        text = source.read_bytes()
        if b"@kernel" in text or b"@subroutine" in text or source.parent == here.parent:
            digest.update(text)
    home = os.environ.get("XDG_CACHE_HOME") or str(Path.home() / ".cache")
    base = os.environ.get("NUMBA_CACHE_DIR") or str(Path(home) / "space_robot")
    wanted, name = Path(base), digest.hexdigest()[:16]
    if not (why := _unusable(wanted / name)):
        return wanted / name
    other = _temporary_cache()
    sys.stderr.write(
        f"space_robot: compiled code is stored in {other}: {wanted} cannot be used ({why})\n"
    )
    os.environ["NUMBA_CACHE_DIR"] = str(other)  # for child processes
    return other / name


def _unusable(folder: Path) -> str:
    """Return why a folder cannot hold the cache; empty if it can, or already does."""
    try:
        is_new = not folder.is_dir()
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
        if is_new and shutil.disk_usage(folder).free < ROOM_BYTES:
            folder.rmdir()
            return "no space left"
    except OSError as error:
        return error.strerror or str(error)
    return ""


def _temporary_cache() -> Path:
    """Return a folder owned by this user only, since code in it is executed."""
    folder = Path(tempfile.gettempdir()) / f"space_robot_{os.getuid()}"
    try:
        folder.mkdir(mode=0o700, exist_ok=True)
        status = folder.lstat()
        if stat.S_ISDIR(status.st_mode) and status.st_uid == os.getuid():
            folder.chmod(0o700)
            return folder
    except OSError:
        pass
    return Path(tempfile.mkdtemp(prefix="space_robot_"))
