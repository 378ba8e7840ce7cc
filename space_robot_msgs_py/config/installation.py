"""What is installed: the ``config/`` folder, and the packages of extras.

Light imports only, since the help of commands lists the files of the folder.
"""

from __future__ import annotations

import re
import shlex
from collections.abc import Sequence
from functools import cache
from pathlib import Path

from ..errors import InputError

GRAPH_FILE = "space_robot.yaml"
"""File with the defaults of the graph, in the config folder."""
DISTRIBUTION = "space_robot"
"""Name of the installed project."""
_EXTRA = re.compile(r"extra\s*==\s*['\"]([\w-]+)['\"]")


@cache
def config_directory() -> Path:
    """Return the ``config/`` folder of the source tree, or the one installed under ``share/``."""
    for parent in Path(__file__).resolve().parents:
        for folder in (parent / "config", parent / "share/space_robot/config"):
            if (folder / GRAPH_FILE).is_file():
                return folder
    raise InputError("the package's config folder is not installed: reinstall space_robot")


def install_command(extra: str) -> str:
    """Return the command that installs the packages of an extra of ``setup.py``.

    It names them, as in ``pip install 'viser>=1.1'``: the project is on no index, so that ``pip
    install 'space_robot[view]'`` works only in its folder.
    """
    packages = requirements().get(extra)
    if not packages:
        return f"pip install -e '.[{extra}]' in the folder of space_robot"
    return install_packages(packages)


def install_packages(packages: Sequence[str]) -> str:
    """Return the command that installs packages, as ``viser>=1.1``."""
    return shlex.join(["pip", "install", *packages])


def requirements(lines: Sequence[str] | None = None) -> dict[str, list[str]]:
    """Return the requirements of each extra; those without an extra under "".

    Args:
        lines: as in a wheel's ``Requires-Dist``; None: those of the installed project, none where
            it is not installed.
    """
    from importlib.metadata import PackageNotFoundError, requires  # slow

    if lines is None:
        try:
            lines = requires(DISTRIBUTION) or []
        except PackageNotFoundError:
            lines = []
    by_extra: dict[str, list[str]] = {}
    for line in lines:
        package, _, marker = line.partition(";")
        extra = _EXTRA.search(marker)
        by_extra.setdefault(extra[1] if extra else "", []).append(package.strip())
    return by_extra
