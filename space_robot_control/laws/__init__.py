"""The control laws, one file each.

Your own: one class derived from `ControlLaw` and one YAML of its gains. A file put in this
folder is found by its law's ``name``; a class on PYTHONPATH is named
``module:Class`` wherever a controller's name is asked for.
"""

from __future__ import annotations

import importlib
import pkgutil
from abc import ABCMeta
from functools import cache
from inspect import isabstract

from space_robot_msgs_py.config.text import one_line_of
from space_robot_msgs_py.errors import InputError

from .base import ControlLaw, LawGains, LawMemory, Signals, per_axis
from .compiled import CompiledLaw

__all__ = [
    "CompiledLaw",
    "ControlLaw",
    "LawGains",
    "LawMemory",
    "Signals",
    "find_law",
    "laws",
    "per_axis",
]


@cache
def laws() -> dict[str, type[ControlLaw]]:
    """Every law of this folder by name."""
    found: dict[str, type[ControlLaw]] = {}
    for module in pkgutil.iter_modules(__path__):
        for value in vars(importlib.import_module(f"{__name__}.{module.name}")).values():
            if _is_law(value):
                found[value.name] = value
    return found


def find_law(name: str) -> type[ControlLaw]:
    """The law of a name, or of a ``module:Class``.

    Raises:
        InputError: there is no such law.
    """
    if name in laws():
        return laws()[name]
    allowed = f"choose one of {', '.join(sorted(laws()))}, or module:Class"
    module, separator, attribute = name.partition(":")
    if not separator:
        raise InputError(f"unknown controller {name!r}: {allowed}")
    try:
        law = getattr(importlib.import_module(module), attribute)
    except (Exception, SystemExit) as error:  # the module is the user's, and may raise anything
        why = one_line_of(error)
        raise InputError(f"controller {name!r} cannot be imported ({why}): {allowed}") from None
    if not _is_law(law):
        raise InputError(f"controller {name!r} is not a ControlLaw: {allowed}")
    found: type[ControlLaw] = law
    return found


def _is_law(value: object) -> bool:
    return isinstance(value, ABCMeta) and issubclass(value, ControlLaw) and not isabstract(value)
