"""The control laws, one file each.

Your own: one class derived from `ControlLaw` and one YAML of its gains. A file put in this
folder is found by its law's ``name``; a class anywhere on the Python path is named
``module:Class`` wherever a controller's name is asked for.
"""

from __future__ import annotations

import importlib
import pkgutil
from functools import cache

from space_robot_msgs_py.errors import InputError

from .base import ControlLaw, Signals

__all__ = ["ControlLaw", "Signals", "find_law", "laws"]


@cache
def laws() -> dict[str, type[ControlLaw]]:
    """Every law of this folder by name."""
    found: dict[str, type[ControlLaw]] = {}
    for module in pkgutil.iter_modules(__path__):
        for value in vars(importlib.import_module(f"{__name__}.{module.name}")).values():
            if (
                isinstance(value, type)
                and issubclass(value, ControlLaw)
                and value is not ControlLaw
            ):
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
    except (ImportError, AttributeError) as error:
        raise InputError(f"controller {name!r} cannot be imported ({error}): {allowed}") from None
    if not (isinstance(law, type) and issubclass(law, ControlLaw)):
        raise InputError(f"controller {name!r} is not a ControlLaw: {allowed}")
    return law
