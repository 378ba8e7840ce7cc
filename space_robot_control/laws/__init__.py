"""The control laws, one file each.

A new law is a class derived from `ControlLaw` and a YAML file of its gains. The law of a file in
this folder is selected by its ``name``, a class in any other file as ``path/file.py:Class``, one
on PYTHONPATH as ``module:Class``.
"""

from __future__ import annotations

import importlib
import pkgutil
from abc import ABCMeta
from functools import cache
from inspect import isabstract

from space_robot_msgs_py.config.text import choices
from space_robot_msgs_py.config.validation import short
from space_robot_msgs_py.errors import InputError, explained_by

from .base import ControlLaw, LawGains, LawMemory
from .compiled import CompiledLaw
from .law_file import ENDING, import_named, importable_name
from .signals import Signals, per_axis

__all__ = [
    "CompiledLaw",
    "ControlLaw",
    "LawGains",
    "LawMemory",
    "Signals",
    "find_law",
    "importable_name",
    "laws",
    "per_axis",
]


@cache
def laws() -> dict[str, type[ControlLaw]]:
    """Return every law of this folder by name."""
    laws: dict[str, type[ControlLaw]] = {}
    for module in pkgutil.iter_modules(__path__):
        for value in vars(importlib.import_module(f"{__name__}.{module.name}")).values():
            if _is_law(value):
                laws[value.name] = value
    return laws


@explained_by("own-law")
def find_law(name: str) -> type[ControlLaw]:
    """Return the law class by name, by ``path/file.py:Class``, or by ``module:Class``.

    Raises:
        InputError: there is no such law.
    """
    if name in laws():
        return laws()[name]
    if name.endswith(ENDING):
        raise InputError(f"controller {short(name)}: name the class as well, {name}:CLASS")
    advice = choices(name, sorted(laws()), ", or file.py:Class or module:Class of your own")
    if ":" not in name:
        raise InputError(f"unknown controller {short(name)}: {advice}")
    law = import_named(
        name, f"controller {short(name)}", "class", _is_law, advice, " derived from ControlLaw"
    )
    if not _is_law(law):
        raise InputError(f"controller {short(name)} is not a ControlLaw: {advice}")
    law_class: type[ControlLaw] = law
    return law_class


def _is_law(value: object) -> bool:
    return isinstance(value, ABCMeta) and issubclass(value, ControlLaw) and not isabstract(value)
