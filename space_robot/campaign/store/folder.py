"""Folder of a campaign: created, resumed, and locked by one process at a time."""

from __future__ import annotations

import fcntl
import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from space_robot_msgs_py.config.validation import short
from space_robot_msgs_py.errors import InputError

from ...console.files import atomic_file, make_folder
from ..study import read_study
from .journal_codec import JournalCodec
from .journal_file import whole_rows
from .manifest import NEW_FOLDER, Manifest, differences, read_manifest
from .table import check_table

LOCK, STUDY, MANIFEST, JOURNAL, TABLE = (
    ".lock",
    "campaign.yaml",
    "campaign.json",
    "journal.db",
    "table.parquet",
)
BAGS = "bags"
_OWN = STUDY, MANIFEST, JOURNAL, TABLE, BAGS


@contextmanager
def held_folder(folder: Path) -> Iterator[None]:
    """Lock a folder for this process; it is created if it does not exist.

    Incomplete files of a killed process are deleted.

    Args:
        folder: of the campaign.

    Raises:
        InputError: another process has locked it, or it contains other files.
    """
    make_folder(folder)
    check_regular(folder)
    _check_own(folder)
    try:
        descriptor = os.open(folder / LOCK, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o644)
    except OSError as error:
        raise InputError(f"{folder}: cannot be written ({error.strerror})") from None
    try:
        try:
            # not inherited by the workers, which may outlive this process for a moment
            fcntl.lockf(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            raise InputError(f"{folder}: another process is flying this campaign") from None
        for file in (STUDY, MANIFEST, JOURNAL, TABLE):
            for unfinished in folder.glob(f".{file}.*"):
                unfinished.unlink(missing_ok=True)
        yield
    finally:
        os.close(descriptor)


def check_regular(folder: Path) -> None:
    """Check that a campaign's files are files; a pipe with such a name would be read for ever.

    Raises:
        InputError: one is neither a file nor a folder.
    """
    for path in folder.iterdir():
        is_own = path.name == LOCK or path.name.startswith(_OWN)
        if is_own and not (path.is_file() or path.is_dir()):
            raise InputError(f"{path}: not a file")


def begin_or_resume(folder: Path, manifest: Manifest, study_text: str) -> list[str]:
    """Write the manifest of a new campaign, or check that an existing one is the same.

    Args:
        folder: locked by this process.
        manifest: of the campaign to be flown.
        study_text: text of the campaign's file.

    Returns:
        A line for each damaged file that was written again.

    Raises:
        InputError: the folder is another campaign's, or cannot be written.
    """
    rows, study = [], folder / STUDY
    is_begun = any((folder / name).exists() for name in (MANIFEST, JOURNAL, TABLE, BAGS))
    if is_begun:
        rows = _resumed(folder, manifest)
        if changes := study_changes(study, manifest.study):
            rows.append(changes)
    if not is_begun or not study.exists():
        with atomic_file(study, replace=True) as file:
            file.write(study_text.encode())
    manifest.write(folder / MANIFEST)  # last: it marks the folder as a campaign
    return rows


def study_changes(file: Path, flown: Mapping[str, Any]) -> str:
    """Return the difference of a folder's copy of the study from the flown one; empty if equal.

    Args:
        file: the copy in the folder.
        flown: content of the flown study, see `Study.content`.
    """
    try:
        now = read_study(file.absolute()).content
    except InputError as error:
        return f"{error}; {MANIFEST} has the study that was flown"
    for key, old, new in differences(flown, now):
        what = f"{short(old)} was flown, {short(new)} is in the file now"
        return f"{file}: was changed after the campaign was started: {key}: {what}"
    return ""


def _resumed(folder: Path, manifest: Manifest) -> list[str]:
    """Check that a folder has the same manifest; return the damage of its own one.

    Raises:
        InputError: the manifest is another one, or is damaged and no row proves it to be the same.
    """
    path = folder / MANIFEST
    damage = f"{path}: missing"
    if path.exists():
        try:
            before = read_manifest(path)
        except InputError as error:
            damage = str(error)
        else:
            before.check_same(manifest, folder)
            return []
    codec = JournalCodec(manifest.campaign, manifest.laws)
    if (folder / JOURNAL).exists() and next(whole_rows(folder / JOURNAL, codec), None):
        return [f"{damage}; written again, as the rows are of this campaign"]
    with suppress(InputError):
        check_table(folder / TABLE, manifest.campaign)
        return [f"{damage}; written again, as the table is of this campaign"]
    raise InputError(
        f"{damage}, and no row in the folder is of this campaign, so it is another one's: "
        f"{NEW_FOLDER}"
    )


def _check_own(folder: Path) -> None:
    """Check that a folder contains nothing but a campaign's files.

    Raises:
        InputError: it contains other files.
    """
    if (folder / MANIFEST).exists():
        return
    for path in folder.iterdir():
        if path.name != LOCK and not path.name.lstrip(".").startswith(_OWN):
            raise InputError(
                f"{folder}: contains {path.name} and no {MANIFEST}, so it is not a campaign "
                f"folder: {NEW_FOLDER}"
            )
