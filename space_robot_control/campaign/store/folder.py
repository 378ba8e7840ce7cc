"""The folder of a campaign: begun, found again, and held by one process at a time."""

from __future__ import annotations

import fcntl
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from space_robot_msgs_py.errors import InputError

from ...analysis.files import make_folder, whole_file
from .manifest import Manifest, read_manifest

LOCK, STUDY, MANIFEST, JOURNAL, TABLE = (
    ".lock", "campaign.yaml", "campaign.json", "journal.db", "table.parquet",
)  # fmt: skip
BAGS = "bags"


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
        for file in (STUDY, MANIFEST, TABLE):
            for unfinished in folder.glob(f".{file}.*"):
                unfinished.unlink(missing_ok=True)
        yield
    finally:
        os.close(descriptor)


def begin_or_resume(folder: Path, manifest: Manifest, study_text: str) -> bool:
    """Write down what is to be flown, or see that it is what was begun here.

    Args:
        folder: held.
        manifest: of what is to be flown now.
        study_text: the campaign's file.

    Returns:
        True if the campaign was begun before.

    Raises:
        InputError: another campaign was begun here; or it cannot be written.
    """
    path = folder / MANIFEST
    if is_begun := path.exists():
        read_manifest(path).check_same(manifest, folder)
    else:
        with whole_file(folder / STUDY, replace=True) as file:
            file.write(study_text.encode())
    with whole_file(path, replace=True) as file:  # last: it says that the campaign was begun
        file.write(manifest.model_dump_json(indent=1).encode() + b"\n")
    return is_begun


def _check_own(folder: Path) -> None:
    """See that nothing but a campaign is in a folder.

    Raises:
        InputError: something else is.
    """
    if (folder / MANIFEST).exists():
        return
    for path in folder.iterdir():
        if path.name not in (LOCK, STUDY) and not path.name.startswith(
            (f".{STUDY}.", f".{MANIFEST}.")
        ):
            raise InputError(
                f"{folder}: has no {MANIFEST} but {path.name}, so it holds something else than a "
                "campaign: choose another folder"
            )
