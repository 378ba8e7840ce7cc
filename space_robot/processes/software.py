"""Commit and package versions of the running software."""

from __future__ import annotations

import platform
import subprocess
from functools import cache
from pathlib import Path

from space_robot_msgs_py.config.installation import config_directory

PACKAGES = ("space_robot", "numpy", "scipy", "numba", "llvmlite", "matplotlib", "mcap", "rosbags")


@cache
def commit() -> str | None:
    """Return the commit, with ``-dirty`` if a file was changed since; None outside a checkout."""
    root = Path(__file__).resolve().parents[2]
    if not (root / ".git").exists() or root != config_directory().parent:
        return None
    try:
        done = subprocess.run(
            # no tag matches, so it prints the hash
            ["git", "describe", "--always", "--abbrev=40", "--exclude=*", "--dirty"],
            cwd=root,
            capture_output=True,
            text=True,
            timeout=10,
            check=True,
        )
    except (OSError, subprocess.SubprocessError):
        return None
    return done.stdout.strip()


@cache
def versions() -> dict[str, str | None]:
    """Return the versions of Python and the packages (None: not installed as a package)."""
    return {
        "python": platform.python_version(),
        **{name: installed_version(name) for name in PACKAGES},
    }


def installed_version(package: str) -> str | None:
    """Return the version of an installed package, or None."""
    from importlib.metadata import PackageNotFoundError, version  # slow

    try:
        return version(package)
    except PackageNotFoundError:
        return None
