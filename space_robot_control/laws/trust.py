"""Which names are followed: a bag or a campaign's folder may be anybody's, and names files.

Names of what is shipped are looked up whoever says them. A path to a file, or a ``module:Class`` or
``file.py:Class`` that would be imported, is opened only if the user names it, or trusts the bag or
campaign.
"""

from __future__ import annotations

from space_robot_msgs_py.errors import InputError

from . import laws

_LONGEST_NAME = 100
FILES = (".yaml", ".yml", ".urdf", ".xacro")


class NotTrustedError(InputError):
    """A bag or campaign names a file or module, which is opened only if it is trusted."""


def is_plain(name: str) -> bool:
    """True if a name is looked up among what is shipped; else it is a path to somewhere."""
    is_path = "/" in name or name.endswith(FILES) or name in (".", "..")
    return name.isprintable() and not is_path and len(name) <= _LONGEST_NAME


def check_file(what: str, name: str, where: str = "bag") -> None:
    """Check that a name out of something that is not trusted opens no file but those shipped.

    Args:
        what: the name is of.
        name: to be checked.
        where: the name was read, for the error.

    Raises:
        NotTrustedError: it is a path.
    """
    if not is_plain(name):
        raise NotTrustedError(
            f"the {where} names a file as its {what}, {_short(name)}: read only with --trust"
        )


def check_law(name: str, where: str = "bag") -> None:
    """Check that a law's name out of something that is not trusted imports only what is shipped.

    Args:
        name: of the law.
        where: it was read, for the error.

    Raises:
        NotTrustedError: it is not the name of a shipped law.
    """
    if name not in laws():
        raise NotTrustedError(
            f"the {where} names the law {_short(name)}, which is none of those shipped: if it is "
            "module:Class or file.py:Class, --trust imports it, which runs its code"
        )


def _short(name: str) -> str:
    text = repr(name)
    return text if len(text) <= 80 else f"{text[:77]}..."
