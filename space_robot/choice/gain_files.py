"""Gain files of candidates, and the set that a robot flies by default."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from space_robot_control.controller.settings import DEFAULT_SETS, OTHERS, SET_FILE
from space_robot_control.laws import find_law

from ..console.files import make_folder, write_text
from ..tuning.gain_file import gain_text, set_text
from .search_space import GainPoint
from .trials import Score

CHOSEN = "chosen"
"""Name of the set."""


def write_gains(
    controller: str, point: GainPoint, folder: Path, command: str, score: Score
) -> Path:
    """Write the gains of a law as a set of its own; return the folder.

    Args:
        controller: the law, see `find_law`.
        point: its gains.
        folder: of the set.
        command: the user's command, for the header.
        score: of its trials.

    Raises:
        InputError: the folder cannot be created or written.
    """
    law = find_law(controller).name
    make_folder(folder)
    comments = [
        f"Made by `{command}`.",
        f"In trials with a light and a heavy robot: error {score.error:.3g}, ripple "
        f"{score.ripple:.2%} of the largest torque.",
    ]
    write_text(gain_text(comments, law, point.gains), folder / f"{law}.yaml", replace=True)
    write_text(set_text(comments, point.corner_hz), folder / SET_FILE, replace=True)
    return folder


def install(files: Sequence[Path], set_file: Path, law: str, gains: Path) -> Path:
    """Make a law with its gains the default of a robot.

    Args:
        files: of the set's laws.
        set_file: `SET_FILE` with the low-pass of all of them.
        law: the default law.
        gains: folder of the robot's gains.

    Returns:
        The set's folder.

    Raises:
        InputError: a file cannot be written.
    """
    folder = gains / CHOSEN
    make_folder(folder)
    for older in folder.glob("*.yaml"):  # the set has one low-pass, perhaps another one now
        older.unlink()
    for file in files:
        write_text(file.read_text("utf-8"), folder / file.name, replace=True)
    line = f"    controller: {law}  # flown unless another is named\n"
    write_text(set_file.read_text("utf-8") + line, folder / SET_FILE, replace=True)
    make_default(CHOSEN, gains)
    return folder


def make_default(name: str, gains: Path) -> None:
    """Make a set the default of all laws.

    Raises:
        InputError: the file cannot be written.
    """
    write_text(f"# The set of each law.\n{OTHERS}: {name}\n", gains / DEFAULT_SETS, replace=True)
