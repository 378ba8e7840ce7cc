"""The folder of a new robot: what of an existing one may be replaced."""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path

from space_robot_model.robot.find import OWN_GAINS, OWN_MISSION
from space_robot_msgs_py.errors import InputError

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
