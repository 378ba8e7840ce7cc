"""Manifest of a campaign: all that its rows depend on, so that rows are never mixed."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field

from space_robot_control.laws.names import law_file
from space_robot_msgs_py.config.validation import StrictModel, short
from space_robot_msgs_py.errors import InputError

from ...flight.plan import Flight
from ...processes.software import versions
from ...scenario.recorded import differences
from ..row.row import Columns
from ..study import NOT_TO_BE_EXTENDED

DECIDE = ("python", "space_robot", "numpy", "scipy", "numba", "llvmlite")
"""Packages whose version may affect the bits of a row."""
SUFFIXES = (".yaml", ".yml", ".urdf", ".xacro", ".py", ".csv", ".parquet")
"""Suffixes of files that a campaign's file may refer to."""
ROOT = Path(__file__).resolve().parents[3]
"""The project's packages."""
NEW_FOLDER = "choose another folder for this one"


class Manifest(StrictModel):
    """The campaign of a folder."""

    seed: Annotated[int, Field(ge=0)]
    runs: Annotated[int, Field(ge=1)]
    """Number of runs to be flown."""
    study: dict[str, Any]
    """Content of the campaign's file without ``runs``."""
    software: dict[str, str | None]
    """Version of each package that the rows depend on, and a digest of the sources."""
    commit: str | None
    """Commit, for information; the digest of the sources is what is compared."""
    files: dict[str, str]
    """Digests of the files that the campaign's file refers to, by name."""
    flights: dict[str, str]
    """Digest of the nominal flight of each law."""
    table: Columns

    def check_same(self, other: Manifest, where: Path) -> None:
        """Check that the one to be flown now is the same campaign, possibly with more runs."""
        for what, before, now in (
            ("seed", self.seed, other.seed),
            ("file", self.study, other.study),
            ("software", self.software, other.software),
            ("named file", self.files, other.files),
            ("flight", self.flights, other.flights),
            ("columns", self.table.model_dump(), other.table.model_dump()),
        ):
            for key, old, new in differences(before, now):
                raise InputError(
                    f"{where}: was started with another {what}: {key + ': ' if key else ''}"
                    f"{short(old)} then, {short(new)} now: {NEW_FOLDER}"
                )
        if other.runs == self.runs:
            return
        begun = f"{where}: was started with {self.runs} runs, {other.runs} are requested"
        if other.runs < self.runs:
            raise InputError(f"{begun}: request {self.runs} or more, or {NEW_FOLDER}")
        if (design := self.study.get("design")) in NOT_TO_BE_EXTENDED:
            raise InputError(f"{begun}, and a {design} design cannot be extended: {NEW_FOLDER}")
        if self.study.get("fixed_runs"):
            raise InputError(f"{begun}, but its file has fixed_runs: true: {NEW_FOLDER}")


@cache
def software() -> dict[str, str | None]:
    """Return the version of each package that rows depend on, and a digest of the sources."""
    known = versions()
    return {**{name: known[name] for name in DECIDE}, "sources": source_digest(ROOT)}


def file_digests(values: Any) -> dict[str, str]:
    """Return the digest of every file named in a campaign file's content, by name."""
    names = {str(law_file(text.partition("=")[0]) or text) for text in all_texts(values)}
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


def all_texts(value: Any) -> Iterator[str]:
    """Yield all texts in a file's content, including the keys of mappings."""
    if isinstance(value, str):
        yield value
    elif isinstance(value, dict):
        for key, inner in value.items():
            yield from all_texts(key)
            yield from all_texts(inner)
    elif isinstance(value, list):
        for inner in value:
            yield from all_texts(inner)
