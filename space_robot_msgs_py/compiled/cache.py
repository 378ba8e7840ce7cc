"""Where compiled code is kept on disk; the folder's name is a digest of the source."""

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
"""Size that a whole cache needs, with room to spare."""


@cache
def cache_directory() -> Path:
    """Folder of the compiled kernels: ``NUMBA_CACHE_DIR`` or the user's cache, by source digest.

    Where that cannot be written, a folder of the user's own among the temporary files.
    """
    here = Path(__file__).resolve()
    root = here.parents[2]
    digest = hashlib.sha256(str(root).encode())  # Numba keeps installations apart, so do we
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
        f"space_robot: compiled code is kept in {other}: {wanted} cannot be used ({why})\n"
    )
    os.environ["NUMBA_CACHE_DIR"] = str(other)  # the processes that this one starts share it
    return other / name


def _unusable(folder: Path) -> str:
    """Why no cache can be kept there; empty if it can, or if there is one already."""
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
    """A folder that is nobody else's: what is in it is run."""
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
