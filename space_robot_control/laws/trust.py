"""Checks of file and module names in bags and campaign folders, which may come from anyone.

Names of shipped files and laws are always allowed. A path to a file, or a ``module:Class`` or
``file.py:Class`` to import, is opened only if the user gave it, or trusts the bag or campaign.
"""

from __future__ import annotations

from space_robot_msgs_py.errors import InputError

from . import laws

_LONGEST_NAME = 100
FILES = (".yaml", ".yml", ".urdf", ".xacro", ".csv", ".parquet")


class NotTrustedError(InputError):
    """A bag or campaign that is not trusted refers to a file or module."""


def is_plain(name: str) -> bool:
    """Return True if a name can only be that of a shipped file, and False for a path."""
    is_path = "/" in name or name.endswith(FILES) or name in (".", "..")
    return name.isprintable() and not is_path and len(name) <= _LONGEST_NAME


def check_file(what: str, name: str, where: str = "bag") -> None:
    """Check that a name from an untrusted source refers to a shipped file.

    Args:
        what: kind of file, for the error.
        name: to be checked.
        where: source of the name, for the error.

    Raises:
        NotTrustedError: it is a path.
    """
    if not is_plain(name):
        raise NotTrustedError(
            f"the {where} refers to a file as its {what}, {_short(name)}: read only with --trust"
        )


def check_law(name: str, where: str = "bag") -> None:
    """Check that a law's name from an untrusted source is that of a shipped law.

    Args:
        name: of the law.
        where: source of the name, for the error.

    Raises:
        NotTrustedError: it is not the name of a shipped law.
    """
    if name not in laws():
        raise NotTrustedError(
            f"the {where} uses the law {_short(name)}, which is not a shipped one: --trust imports "
            "a module:Class or file.py:Class, which runs its code"
        )


def _short(name: str) -> str:
    text = repr(name)
    return text if len(text) <= 80 else f"{text[:77]}..."
