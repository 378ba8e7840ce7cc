"""Software and input files of a campaign: versions, and digests of sources and files."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

from space_robot_control.laws.names import law_file

from ...flight.plan import Flight
from ...processes.software import versions

DECIDE = ("python", "space_robot", "numpy", "scipy", "numba", "llvmlite")
"""Packages whose version may affect the bits of a row."""
SUFFIXES = (".yaml", ".yml", ".urdf", ".xacro", ".py", ".csv", ".parquet")
"""Suffixes of files that a campaign's file may refer to."""
ROOT = Path(__file__).resolve().parents[3]
"""The project's packages."""


@cache
def software() -> dict[str, str | None]:
    """Return the version of each package that rows depend on, and a digest of the sources."""
    known = versions()
    return {**{name: known[name] for name in DECIDE}, "sources": source_digest(ROOT)}


def file_digests(values: Any) -> dict[str, str]:
    """Return the digest of every file named in a campaign file's content, by name."""
    names = {str(law_file(text.partition("=")[0]) or text) for text in texts_of(values)}
    return {
        name: digest(Path(name).read_bytes())
        for name in sorted(names)
        if name.endswith(SUFFIXES) and "\0" not in name and Path(name).is_file()
    }


def flight_digest(flight: Flight) -> str:
    """Return a digest of a flight's resolved scenario: of every number, and of no file's name.

    Gains of laws that it does not fly do not count.
    """
    flown = {flight.law.name, *(law.name for _, law in flight.swaps)}
    tree = dict(flight.scenario.tree)
    tree["gains"] = {name: gains for name, gains in tree["gains"].items() if name in flown}
    content = json.dumps(_without_meshes(tree), sort_keys=True, default=str)
    return digest(content.encode())


def _without_meshes(value: Any) -> Any:
    """Return a tree without the names of mesh files."""
    if isinstance(value, dict):
        return {key: _without_meshes(inner) for key, inner in value.items() if key != "mesh"}
    return [_without_meshes(inner) for inner in value] if isinstance(value, list) else value


def digest(data: bytes) -> str:
    """Return 32 hexadecimal digits of SHA-256."""
    return hashlib.sha256(data).hexdigest()[:32]


def source_digest(root: Path) -> str:
    """Return a digest of the project's Python files below ``root``, with their relative paths."""
    packages = (
        "space_robot_msgs_py",
        "space_robot_model",
        "space_robot_sim",
        "space_robot_control",
        "space_robot",
    )
    files = sorted(file for name in packages for file in (root / name).rglob("*.py"))
    whole = hashlib.sha256()
    for file in files:
        whole.update(f"{file.relative_to(root)}\0".encode() + file.read_bytes() + b"\0")
    return whole.hexdigest()[:32]


def texts_of(value: Any) -> Iterator[str]:
    """Yield all texts in a file's content, including the keys of mappings."""
    if isinstance(value, str):
        yield value
    elif isinstance(value, dict):
        for key, inner in value.items():
            yield from texts_of(key)
            yield from texts_of(inner)
    elif isinstance(value, list):
        for inner in value:
            yield from texts_of(inner)
