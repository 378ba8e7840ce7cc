"""Manifest of a campaign's folder: all that its rows depend on, so that rows are never mixed."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Annotated, Any, Final, Literal

from pydantic import Field

from space_robot_msgs_py.config.text import parse_json
from space_robot_msgs_py.config.validation import StrictModel, short, validate
from space_robot_msgs_py.config.yaml_text import read_file
from space_robot_msgs_py.errors import InputError

from ...console.files import atomic_file
from ..study import NOT_TO_BE_EXTENDED
from .schema import Schema

NEW_FOLDER = "choose another folder for this one"
FORMAT: Final = 2
"""Version of the folder's format; version 1 had neither digests nor the grid."""
SHA256 = "sha256"
"""Key of the digest of all other content of the file."""


class Manifest(StrictModel):
    """The campaign of a folder."""

    format: Literal[2] = FORMAT
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
    table: Schema
    """Columns of the table."""

    @property
    def laws(self) -> list[str]:
        """Return the laws of the campaign, in order."""
        return [str(law) for law in self.study["laws"]]

    @property
    def campaign(self) -> str:
        """Return a digest of all that the rows depend on, without the number of runs."""
        content = self.model_dump(exclude={"format", "commit", "runs"})
        if self.study.get("design") in NOT_TO_BE_EXTENDED:
            content["runs"] = self.runs
        return _digest(content)

    def write(self, path: Path) -> None:
        """Write the manifest with its digest.

        Raises:
            InputError: the file cannot be written.
        """
        content = self.model_dump()
        text = json.dumps({**content, SHA256: _digest(content)}, indent=1)
        with atomic_file(path, replace=True) as file:
            file.write(text.encode() + b"\n")

    def check_same(self, other: Manifest, where: Path) -> None:
        """Check that ``other`` is the same campaign, possibly with more runs.

        Args:
            other: manifest of the campaign to be flown now.
            where: the folder, for the error.

        Raises:
            InputError: the first difference, in one line.
        """
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
        self._check_runs(other.runs, where)

    def _check_runs(self, runs: int, where: Path) -> None:
        if runs < self.runs:
            raise InputError(
                f"{where}: was started with {self.runs} runs, {runs} are requested: "
                f"request {self.runs} or more, or {NEW_FOLDER}"
            )
        design = self.study.get("design")
        if runs > self.runs and design in NOT_TO_BE_EXTENDED:
            raise InputError(
                f"{where}: was started with {self.runs} runs, {runs} are requested, and a "
                f"{design} design cannot be extended: {NEW_FOLDER}"
            )
        if runs > self.runs and self.study.get("fixed_runs"):
            raise InputError(
                f"{where}: was started with {self.runs} runs, {runs} are requested, but its file "
                f"has fixed_runs: true: {NEW_FOLDER}"
            )


def read_manifest(path: Path) -> Manifest:
    """Read a manifest and check its digest.

    Raises:
        InputError: the file is missing, damaged, or of another version.
    """
    try:
        content = parse_json(read_file(path))
    except ValueError as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"{path}: damaged: not JSON ({error})") from None
    if not isinstance(content, dict):
        raise InputError(f"{path}: damaged: a mapping was expected, got {short(content)}")
    sha256 = content.pop(SHA256, None)
    if content.get("format") == FORMAT - 1:
        raise InputError(f"{path}: written by version 0.7 or older: use that one, or {NEW_FOLDER}")
    if sha256 != _digest(content):
        raise InputError(f"{path}: damaged or edited: its {SHA256} does not match its content")
    manifest = validate(Manifest, content, str(path))
    if not manifest.study.get("laws"):
        raise InputError(f"{path}: study.laws: missing")
    return manifest


def _digest(content: Mapping[str, Any]) -> str:
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


def differences(before: Any, now: Any, key: str = "") -> Iterator[tuple[str, Any, Any]]:
    """Yield the keys whose values differ, with both values; None for a missing one.

    The order of the variables (``vary``) is compared, too: the draws depend on it.
    """
    if isinstance(before, Mapping) and isinstance(now, Mapping):
        for name in dict.fromkeys((*before, *now)):
            inner = f"{key}.{name}" if key else str(name)
            yield from differences(before.get(name), now.get(name), inner)
        is_ordered = key.rpartition(".")[2] == "vary"
        if is_ordered and list(before) != list(now) and sorted(before) == sorted(now):
            yield f"order of {key}", ", ".join(before), ", ".join(now)
    elif before != now:
        yield key, before, now
