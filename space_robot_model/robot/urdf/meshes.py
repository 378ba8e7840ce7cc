"""Where the mesh files are that a URDF names; whether they are there matters to a viewer alone."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path
from urllib.parse import unquote

PACKAGE, FILE = ("package://", "model://"), "file://"


def mesh_path(name: str, folder: Path) -> str:
    """Return the path of a mesh file, or its name as it is if nobody knows where that is.

    Args:
        name: a path from the URDF's folder, or ``file://``, or ``package://NAME/...``: in an
            installed ROS package, in a folder called NAME that the URDF is in, or in one beside
            these.
        folder: the URDF's.
    """
    if name.startswith(FILE):
        return unquote(name.removeprefix(FILE))
    for scheme in PACKAGE:
        if name.startswith(scheme):
            package, _, rest = name.removeprefix(scheme).partition("/")
            return next((str(p) for p in _places(package, rest, folder) if _is_file(p)), name)
    return name if "://" in name else str(folder / name)


def _places(package: str, rest: str, folder: Path) -> Iterator[Path]:
    """Yield where a file of a package may be, the likeliest place first."""
    for above in (folder, *folder.parents):
        if above.name == package:
            yield above / rest
        yield above / package / rest
    for prefix in _paths("AMENT_PREFIX_PATH"):
        yield prefix / "share" / package / rest
    for source in _paths("ROS_PACKAGE_PATH"):
        yield source / package / rest


def _paths(variable: str) -> list[Path]:
    return [Path(text) for text in os.environ.get(variable, "").split(os.pathsep) if text]


def _is_file(path: Path) -> bool:
    try:
        return path.is_file()
    except (OSError, ValueError):  # no name that a file could have
        return False
