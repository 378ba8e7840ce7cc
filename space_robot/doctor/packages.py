"""Python, the packages that are required, and those of the extras."""

from __future__ import annotations

import platform
import re
import sys
from collections.abc import Iterator, Mapping, Sequence
from importlib.metadata import PackageNotFoundError, version

from space_robot_msgs_py.config.installation import install_packages

from .checked_item import CheckedItem

OLDEST, NEWEST = (3, 10), (3, 13)
"""Versions of Python that setup.py admits."""
USES = {
    "ros": "fly, goto and sim",
    "campaign": "the tables of campaign",
    "view": "view",
    "parquet": "analyze --parquet",
    "xacro": "robots in xacro files",
    "gym": "Gymnasium environments",
    "dask": "campaign run --scheduler",
    "mpc": "the example of model predictive control",
    "notebooks": "the notebooks of the documentation",
}
"""Extras for users, and what needs them."""
_NAME = re.compile(r"[\w.-]+")


def check_python(python: tuple[int, int] = sys.version_info[:2]) -> CheckedItem:
    """Report the version of Python.

    Args:
        python: major and minor version.
    """
    text = f"{platform.python_version()} ({platform.python_implementation()}, {sys.executable})"
    values = {
        "version": platform.python_version(),
        "executable": sys.executable,
        "platform": platform.platform(),
    }
    if OLDEST <= python <= NEWEST:
        return CheckedItem("Python", "ok", text, values=values, is_required=True)
    versions = f"3.{OLDEST[1]} to 3.{NEWEST[1]}"
    advice = f"install Python {versions}, and space_robot into an environment of it"
    return CheckedItem("Python", "missing", text, advice, values, is_required=True)


def installed(packages: Sequence[str]) -> dict[str, str | None]:
    """Return the version of each required package by name; None if it is not installed."""
    versions: dict[str, str | None] = {}
    for requirement in packages:
        match = _NAME.match(requirement)
        name = match[0] if match else requirement
        try:
            versions[name] = version(name)
        except PackageNotFoundError:
            versions[name] = None
    return versions


def check_packages(required: Mapping[str, list[str]]) -> Iterator[CheckedItem]:
    """Report the required packages, and the extras one by one.

    Args:
        required: requirements of each extra; those without an extra under "".
    """
    packages = required.get("", [])
    if not packages:
        text = "space_robot is not installed; it runs from its folder"
        advice = "pip install -e . in the folder of space_robot, so that versions can be checked"
        yield CheckedItem("packages", "warning", text, advice)
    else:
        yield _check_required(packages)
    for extra, use in USES.items():
        yield _check_extra(extra, use, required.get(extra, []))


def _check_required(packages: Sequence[str]) -> CheckedItem:
    versions = installed(packages)
    lacking = _lacking(packages, versions)
    if lacking:
        text, advice = f"not installed: {', '.join(lacking)}", install_packages(lacking)
        return CheckedItem("packages", "missing", text, advice, versions, is_required=True)
    shown = ("numpy", "numba", "scipy", "pydantic", "matplotlib", "mcap")
    text = ", ".join(f"{name} {versions[name]}" for name in shown if name in versions)
    return CheckedItem("packages", "ok", text, values=versions, is_required=True)


def _check_extra(extra: str, use: str, packages: Sequence[str]) -> CheckedItem:
    versions = installed(packages)
    name = f"extra {extra}"
    lacking = _lacking(packages, versions)
    if lacking:
        text = f"{use}: not installed: {', '.join(lacking)}"
        return CheckedItem(
            name, "missing", text, f"{install_packages(lacking)}, if you need it", versions
        )
    if not packages:
        text = f"{use}: unknown, the installed space_robot does not list this extra"
        return CheckedItem(name, "warning", text, "install space_robot again")
    shown = ", ".join(f"{package} {number}" for package, number in versions.items())
    return CheckedItem(name, "ok", f"{use}: {shown}", values=versions)


def _lacking(packages: Sequence[str], versions: Mapping[str, str | None]) -> list[str]:
    """Return the requirements of packages that are not installed."""
    return [text for text, number in zip(packages, versions.values(), strict=True) if not number]
