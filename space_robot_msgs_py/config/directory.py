"""The ``config/`` folder. Light imports only, since the help of commands lists its files."""

from __future__ import annotations

from functools import cache
from pathlib import Path

from ..errors import InputError

GRAPH_FILE = "space_robot.yaml"
"""File with the defaults of the graph, in the config folder."""


@cache
def config_directory() -> Path:
    """Return the ``config/`` folder of the source tree, or the one installed under ``share/``.

    Raises:
        InputError: the installation is incomplete.
    """
    for parent in Path(__file__).resolve().parents:
        for folder in (parent / "config", parent / "share/space_robot/config"):
            if (folder / GRAPH_FILE).is_file():
                return folder
    raise InputError("the package's config folder is not installed: reinstall space_robot")
