"""A folder that is whole or not there: written beside its place, then renamed."""

from __future__ import annotations

import shutil
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from pathlib import Path
from secrets import token_hex

from space_robot_model.robot.find import OWN_GAINS, OWN_MISSION
from space_robot_msgs_py.errors import InputError

from ...console.files import make_folder


def check_replaceable(folder: Path, force: bool, files: Collection[str]) -> None:
    """Check that a folder can be made there, before any work is done for it.

    Args:
        folder: to be made.
        force: whether one that is there may be replaced.
        files: those that tell the robot; they, mission and gains may be lost then.

    Raises:
        InputError: something is there that is not to be lost.
    """
    if not folder.exists() and not folder.is_symlink():
        return
    if not force:
        raise InputError(f"{folder}: exists already: name another with --out, or give --force")
    if not folder.is_dir():
        raise InputError(f"{folder}: exists, and is no folder; it is not replaced")
    known = {*files, OWN_MISSION, OWN_GAINS}
    if others := sorted(entry.name for entry in folder.iterdir() if entry.name not in known):
        raise InputError(f"{folder}: holds {others[0]!r} as well: it is not replaced")


@contextmanager
def whole_folder(folder: Path) -> Iterator[Path]:
    """Give a folder to write in, which takes the place of ``folder`` once all has gone well.

    Raises:
        InputError: it cannot be written.
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
