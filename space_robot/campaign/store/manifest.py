"""The manifest of a campaign's folder: of what its rows are, so that no others come among them."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Annotated, Any, Final, Literal

from pydantic import Field

from space_robot_msgs_py.config.validation import StrictModel, short, validate
from space_robot_msgs_py.config.yaml_text import read_file
from space_robot_msgs_py.errors import InputError

from ...console.files import whole_file
from ..study import NOT_TO_BE_EXTENDED
from .schema import Schema

NEW_FOLDER = "choose another folder for this one"
FORMAT: Final = 2
"""Version of the folder; the first one had neither digests nor the grid."""
SHA256 = "sha256"
"""Key of the digest of all else in the file."""


class Manifest(StrictModel):
    """What was begun in a folder."""

    format: Literal[2] = FORMAT
    seed: Annotated[int, Field(ge=0)]
    runs: Annotated[int, Field(ge=1)]
    """To be flown; of a design they are all its points."""
    study: dict[str, Any]
    """The campaign's file, checked, without its ``runs``."""
    software: dict[str, str | None]
    """See `software.software`."""
    commit: str | None
    """For the reader: the sources' digest decides."""
    files: dict[str, str]
    """Digests of the files that the campaign's file names."""
    flights: dict[str, str]
    """Digests of what the nominal flight of each law is."""
    table: Schema
    """The columns."""

    @property
    def laws(self) -> list[str]:
        """Return the laws of the campaign, in their order."""
        return [str(law) for law in self.study["laws"]]

    @property
    def campaign(self) -> str:
        """Return a digest of all that the rows depend on: more runs are the same campaign."""
        content = self.model_dump(exclude={"format", "commit", "runs"})
        if self.study.get("design") in NOT_TO_BE_EXTENDED:
            content["runs"] = self.runs
        return _digest(content)

    def write(self, path: Path) -> None:
        """Write it with its digest.

        Raises:
            InputError: it cannot be written.
        """
        content = self.model_dump()
        text = json.dumps({**content, SHA256: _digest(content)}, indent=1)
        with whole_file(path, replace=True) as file:
            file.write(text.encode() + b"\n")

    def check_same(self, other: Manifest, where: Path) -> None:
        """Check that ``other``, what is to be flown now, is what was begun, or more runs of it.

        Args:
            other: now.
            where: the folder, for the error.

        Raises:
            InputError: it is not; says in one line what differs.
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
                    f"{where}: was begun with another {what}: {key + ': ' if key else ''}"
                    f"{short(old)} then, {short(new)} now: {NEW_FOLDER}"
                )
        self._check_runs(other.runs, where)

    def _check_runs(self, runs: int, where: Path) -> None:
        if runs < self.runs:
            raise InputError(
                f"{where}: was begun with {self.runs} runs, {runs} are asked for: "
                f"give {self.runs} or more, or {NEW_FOLDER}"
            )
        design = self.study.get("design")
        if runs > self.runs and design in NOT_TO_BE_EXTENDED:
            raise InputError(
                f"{where}: was begun with {self.runs} runs, {runs} are asked for, and a "
                f"{design} design cannot be extended: {NEW_FOLDER}"
            )
        if runs > self.runs and self.study.get("fixed_runs"):
            raise InputError(
                f"{where}: was begun with {self.runs} runs, {runs} are asked for, but its file has "
                f"fixed_runs: true: {NEW_FOLDER}"
            )


def read_manifest(path: Path) -> Manifest:
    """Read a manifest and check its digest.

    Raises:
        InputError: it is missing, damaged, or of another version.
    """
    try:
        content = json.loads(read_file(path))
    except (ValueError, RecursionError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"{path}: damaged: no JSON ({error})") from None
    if not isinstance(content, dict):
        raise InputError(f"{path}: damaged: a mapping was expected, got {short(content)}")
    sha256 = content.pop(SHA256, None)
    if content.get("format") == FORMAT - 1:
        raise InputError(f"{path}: of version 0.7 or older, which can read it: {NEW_FOLDER}")
    if sha256 != _digest(content):
        raise InputError(f"{path}: damaged or edited: its content does not have its {SHA256}")
    manifest = validate(Manifest, content, str(path))
    if not manifest.study.get("laws"):
        raise InputError(f"{path}: study.laws: missing")
    return manifest


def _digest(content: Mapping[str, Any]) -> str:
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


def differences(before: Any, now: Any, key: str = "") -> Iterator[tuple[str, Any, Any]]:
    """Yield the keys whose values differ, with both; None stands for one that is not there.

    Of the variables (``vary``) the order counts, too: draws follow it.
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
