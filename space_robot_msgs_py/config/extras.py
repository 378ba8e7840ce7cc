"""Commands that install the packages of an extra, for errors where one of them is missing."""

from __future__ import annotations

import re
import shlex
from collections.abc import Sequence

DISTRIBUTION = "space_robot"
"""Name of the installed project."""
_EXTRA = re.compile(r"extra\s*==\s*['\"]([\w-]+)['\"]")


def install_command(extra: str) -> str:
    """Return the command that installs the packages of an extra of ``setup.py``.

    It names the packages, as in ``pip install 'viser>=1.1'``: the project itself is on no index, so
    that ``pip install 'space_robot[view]'`` would work in no installation, and the packages do
    wherever the project was installed from. Where it runs without being installed, the extra is
    installed from its folder.
    """
    packages = extra_packages(extra)
    if not packages:
        return f"pip install -e '.[{extra}]' in the folder of space_robot"
    return install_packages(packages)


def install_packages(packages: Sequence[str]) -> str:
    """Return the command that installs packages, as ``viser>=1.1``."""
    return shlex.join(["pip", "install", *packages])


def extra_packages(extra: str) -> list[str]:
    """Return the requirements of an extra, as ``viser>=1.1``; none if nothing is installed."""
    return requirements().get(extra, [])


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
