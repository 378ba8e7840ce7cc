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

from ...console.files import make_folder, whole_file
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
    """Hold a folder, made if it is not there, against all other processes.

    Half-written files of a process that was killed are put away.

    Args:
        folder: of the campaign.

    Raises:
        InputError: another process holds it, or something else is in it.
    """
    make_folder(folder)
    _check_own(folder)
    try:
        descriptor = os.open(folder / LOCK, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o644)
    except OSError as error:
        raise InputError(f"{folder}: cannot be written ({error.strerror})") from None
    try:
        try:
            # of this process alone: its workers, who may outlive it by a moment, do not hold it
            fcntl.lockf(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            raise InputError(f"{folder}: another process flies this campaign now") from None
        for file in (STUDY, MANIFEST, JOURNAL, TABLE):
            for unfinished in folder.glob(f".{file}.*"):
                unfinished.unlink(missing_ok=True)
        yield
    finally:
        os.close(descriptor)


def begin_or_resume(folder: Path, manifest: Manifest, study_text: str) -> list[str]:
    """Write down what is to be flown, or see that it is what was begun here.

    Args:
        folder: held.
        manifest: of what is to be flown now.
        study_text: the campaign's file.

    Returns:
        What was damaged and is written again, a line each.

    Raises:
        InputError: another campaign was begun here; or it cannot be written.
    """
    rows, study = [], folder / STUDY
    is_begun = any((folder / name).exists() for name in (MANIFEST, JOURNAL, TABLE, BAGS))
    if is_begun:
        rows = _resumed(folder, manifest)
        if changes := study_changes(study, manifest.study):
            rows.append(changes)
    if not is_begun or not study.exists():
        with whole_file(study, replace=True) as file:
            file.write(study_text.encode())
    manifest.write(folder / MANIFEST)  # last: it says that the campaign was begun
    return rows


def study_changes(file: Path, flown: Mapping[str, Any]) -> str:
    """Return in a line how a folder's copy of the study differs from what was flown, or empty.

    Args:
        file: of the folder.
        flown: see `Study.content`.
    """
    try:
        now = read_study(file.absolute()).content
    except InputError as error:
        return f"{error}; {MANIFEST} has the study that was flown"
    for key, old, new in differences(flown, now):
        what = f"{short(old)} was flown, {short(new)} is there now"
        return f"{file}: was changed after the campaign was begun: {key}: {what}"
    return ""


def _resumed(folder: Path, manifest: Manifest) -> list[str]:
    """Check that a folder was begun with a manifest; return what is damaged of its own.

    Raises:
        InputError: it was begun with another one, or nothing shows that it was not.
    """
    path = folder / MANIFEST
    damage = f"{path}: is gone"
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
        return [f"{damage}; written again, for the rows are of this campaign"]
    with suppress(InputError):
        check_table(folder / TABLE, manifest.campaign)
        return [f"{damage}; written again, for the table is of this campaign"]
    raise InputError(
        f"{damage}, and no row in the folder is of this campaign, so it holds something else: "
        f"{NEW_FOLDER}"
    )


def _check_own(folder: Path) -> None:
    """Check that nothing but a campaign is in a folder.

    Raises:
        InputError: something else is.
    """
    if (folder / MANIFEST).exists():
        return
    for path in folder.iterdir():
        if path.name != LOCK and not path.name.lstrip(".").startswith(_OWN):
            raise InputError(
                f"{folder}: has no {MANIFEST} but {path.name}, so it holds something else than a "
                f"campaign: {NEW_FOLDER}"
            )
