"""Commands that install the packages of an extra, for errors where one of them is missing."""

from __future__ import annotations

import re
import shlex

DISTRIBUTION = "space_robot"
"""Name of the installed project."""


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
    return shlex.join(["pip", "install", *packages])


def extra_packages(extra: str) -> list[str]:
    """Return the requirements of an extra, as ``viser>=1.1``; none if nothing is installed."""
    from importlib.metadata import PackageNotFoundError, requires  # slow

    try:
        requirements = requires(DISTRIBUTION) or []
    except PackageNotFoundError:
        return []
    condition = re.compile(rf"extra\s*==\s*['\"]{re.escape(extra)}['\"]")
    parts = (text.partition(";") for text in requirements)
    return [package.strip() for package, _, marker in parts if condition.search(marker)]
