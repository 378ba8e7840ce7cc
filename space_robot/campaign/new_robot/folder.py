"""Atomic creation of a folder: written beside its destination, then renamed."""

from __future__ import annotations

import shutil
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from pathlib import Path
from secrets import token_hex

from space_robot_model.robot.find import OWN_GAINS, OWN_MISSION
from space_robot_msgs_py.errors import InputError

from ...console.files import make_folder
from .texts import CAMPAIGN_FILE


def check_replaceable(folder: Path, force: bool, files: Collection[str]) -> None:
    """Check that a folder can be created or replaced.

    Args:
        folder: to be created.
        force: True if an existing folder may be replaced.
        files: names of the robot's files; only these, mission, gains and campaign may be
            overwritten.

    Raises:
        InputError: something exists there that must not be overwritten.
    """
    if not folder.exists() and not folder.is_symlink():
        return
    if not force:
        raise InputError(f"{folder}: exists already: choose another with --out, or use --force")
    if not folder.is_dir():
        raise InputError(f"{folder}: exists and is not a folder; it is not replaced")
    known = {*files, OWN_MISSION, OWN_GAINS, CAMPAIGN_FILE}
    if others := sorted(entry.name for entry in folder.iterdir() if entry.name not in known):
        raise InputError(f"{folder}: also contains {others[0]!r}: it is not replaced")


@contextmanager
def whole_folder(folder: Path) -> Iterator[Path]:
    """Yield a temporary folder that replaces ``folder`` if the block ends without error.

    Raises:
        InputError: the folder cannot be written.
    """
    make_folder(folder.parent)
    place = folder.parent / f".{folder.name}.{token_hex(4)}"
    old = place.with_suffix(".old")
    try:
        place.mkdir()
        yield place
        if folder.exists():
            folder.rename(old)
        place.rename(folder)
    except OSError as error:
        raise InputError(f"{folder}: cannot be written ({error.strerror})") from None
    finally:
        if old.exists() and not folder.exists():
            old.rename(folder)
        for left in (place, old):
            shutil.rmtree(left, ignore_errors=True)
