"""What exactly was flown: commit, versions, parameters."""

from __future__ import annotations

import platform
import subprocess
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from space_robot_msgs_py.configuration import config_directory

from ..flight.plan import Flight

PACKAGES = ("space_robot", "numpy", "scipy", "numba", "llvmlite", "matplotlib")


def provenance() -> dict[str, Any]:
    """Commit (None outside a checkout), whether it was changed since, versions, machine."""
    return {
        "commit": _git("rev-parse", "HEAD"),
        "changed_since": bool(_git("status", "--porcelain", "--untracked-files=no")),
        "python": platform.python_version(),
        "packages": {name: _version(name) for name in PACKAGES},
        "machine": f"{platform.system()} {platform.machine()}",
    }


def parameters(flight: Flight) -> dict[str, Any]:
    """All that plant, controller and mission are told in a flight."""
    return {
        "period_s": flight.period,
        "plant": flight.plant_settings.model_dump(exclude={"mission", "wait_for"}),
        "gains": {name: row.tolist() for name, row in flight.controller.law.gains.items()},
        "mission": {
            "waypoint_times_s": flight.mission_settings.waypoint_times,
            "waypoints_deg": flight.mission_settings.waypoints_deg,
        },
    }


def _git(*arguments: str) -> str | None:
    root = Path(__file__).resolve().parents[2]
    if not (root / ".git").exists() or root != config_directory().parent:
        return None
    try:
        done = subprocess.run(
            ["git", "-C", str(root), *arguments],
            capture_output=True, text=True, timeout=10, check=True,
        )  # fmt: skip
    except (OSError, subprocess.SubprocessError):
        return None
    return done.stdout.strip()


def _version(package: str) -> str | None:
    try:
        return version(package)
    except PackageNotFoundError:
        return None
