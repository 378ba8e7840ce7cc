"""The manifest of a campaign's folder: of what its rows are, so that no others come among them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field

from space_robot_msgs_py.config.validation import StrictModel, read_yaml, short, validate
from space_robot_msgs_py.errors import InputError

from ..study import NOT_TO_BE_EXTENDED
from .schema import Schema

NEW_FOLDER = "choose another folder for this one"


class Manifest(StrictModel):
    """What was begun in a folder."""

    format: Literal[1] = 1
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

    def check_same(self, other: Manifest, where: Path) -> None:
        """See that ``other``, what is to be flown now, is what was begun, or more runs of it.

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
            for key, old, new in _differences(before, now):
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
    """Read a manifest.

    Raises:
        InputError: it is not there, or is none of this version.
    """
    return validate(Manifest, read_yaml(path), str(path))


def _differences(before: Any, now: Any, key: str = "") -> Iterator[tuple[str, Any, Any]]:
    """Yield the keys whose values differ, with both; None stands for one that is not there."""
    if isinstance(before, Mapping) and isinstance(now, Mapping):
        for name in dict.fromkeys((*before, *now)):
            inner = f"{key}.{name}" if key else str(name)
            yield from _differences(before.get(name), now.get(name), inner)
        if list(before) != list(now) and sorted(before) == sorted(now):
            yield f"order of {key}", ", ".join(before), ", ".join(now)
    elif before != now:
        yield key, before, now
