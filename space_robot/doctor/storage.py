"""Memory, disk space, and the folder of compiled kernels."""

from __future__ import annotations

import shutil
import tempfile
from pathlib import Path

from .checked_item import CheckedItem

LEAST_MEMORY = 1 << 30
"""Memory with which kernels can be compiled and a graph flown, bytes."""
LEAST_DISK = 1 << 30
"""Free space for bags of some flights of 30 s (about 30 MB each), bytes."""
MEMORY_TABLE = Path("/proc/meminfo")


def check_memory(table: Path = MEMORY_TABLE) -> CheckedItem:
    """Report the memory that is available.

    Args:
        table: file in the format of ``/proc/meminfo``.
    """
    try:
        lines = [line.split() for line in table.read_text("ascii").splitlines()]
        sizes = {words[0].rstrip(":"): 1024 * int(words[1]) for words in lines}
        total, available = sizes["MemTotal"], sizes["MemAvailable"]
    except (OSError, LookupError, ValueError):
        return CheckedItem("memory", "warning", f"unknown: {table} cannot be read")
    text = f"{_gigabytes(available)} of {_gigabytes(total)} available"
    values = {"total_bytes": total, "available_bytes": available}
    if available < LEAST_MEMORY:
        advice = "close other programs: the first flight compiles kernels, which takes about 1 GB"
        return CheckedItem("memory", "warning", text, advice, values)
    return CheckedItem("memory", "ok", text, values=values)


def check_disk(folder: Path) -> CheckedItem:
    """Report the free space where bags would be recorded.

    Args:
        folder: the working folder.
    """
    free = shutil.disk_usage(folder).free
    text = f"{_gigabytes(free)} free in {folder}"
    values = {"folder": str(folder), "free_bytes": free}
    if free < LEAST_DISK:
        advice = "free some space, or record elsewhere with --bag: 30 s of flight make about 30 MB"
        return CheckedItem("disk", "warning", text, advice, values)
    return CheckedItem("disk", "ok", text, values=values)


def check_kernels(folder: Path, mark: Path, temporary: Path | None = None) -> CheckedItem:
    """Report the folder of compiled kernels, and if those of this version are there.

    Args:
        folder: of this version's kernels.
        mark: file that is there once all of them are compiled.
        temporary: folder that is emptied when the machine starts; None: the system's.
    """
    temporary = temporary or Path(tempfile.gettempdir())
    values = {"folder": str(folder), "is_compiled": mark.exists()}
    try:
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        text = f"{folder} cannot be written ({error.strerror})"
        advice = "set NUMBA_CACHE_DIR to a folder that can be written"
        return CheckedItem("kernels", "missing", text, advice, values, is_required=True)
    if folder.is_relative_to(temporary):
        advice = (
            "set NUMBA_CACHE_DIR to a folder that stays: what is compiled is lost at the next boot"
        )
        text = f"in the temporary folder {folder}"
        return CheckedItem("kernels", "warning", text, advice, values, is_required=True)
    if not mark.exists():
        text = f"not compiled yet for this version; they will be kept in {folder}"
        advice = "nothing: the first flight compiles them, in one to five minutes"
        return CheckedItem("kernels", "warning", text, advice, values, is_required=True)
    text = f"compiled for this version, in {folder}"
    return CheckedItem("kernels", "ok", text, values=values, is_required=True)


def _gigabytes(size: int) -> str:
    return f"{size / 1e9:.1f} GB"
