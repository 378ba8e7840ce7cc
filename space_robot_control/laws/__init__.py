"""The control laws, one file each.

A new law is a class derived from `ControlLaw` and a YAML file of its gains. The law of a file in
this folder is selected by its ``name``, a class in any other file as ``path/file.py:Class``, one
on PYTHONPATH as ``module:Class``.
"""

from __future__ import annotations

import importlib
import os.path
import pkgutil
from abc import ABCMeta
from functools import cache
from inspect import isabstract

from space_robot_msgs_py.config.choices import choices
from space_robot_msgs_py.config.text import one_line_of
from space_robot_msgs_py.config.validation import one_of, short
from space_robot_msgs_py.errors import InputError, explained_by

from .base import ControlLaw, LawGains, LawMemory
from .compiled import CompiledLaw
from .law_file import ENDING, import_file, importable_name, law_file
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

LONGEST_REASON = 200
"""Maximum length, in characters, of an error of a law's own code in a message."""


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
    module, separator, attribute = name.rpartition(":")
    if not separator:
        raise InputError(f"unknown controller {short(name)}: {advice}")
    file = law_file(name)
    try:
        imported = importlib.import_module(module) if file is None else import_file(file)
        if file and not hasattr(imported, attribute):
            own = [key for key, value in vars(imported).items() if _is_law(value)]
            if not own:
                raise InputError(f"{file} has no class that is derived from ControlLaw")
            one_of(attribute, own, "class", f" of {file}")
        law = getattr(imported, attribute)
    except InputError as error:
        where = "" if file is None or file.is_absolute() else " (paths are from the current folder)"
        raise InputError(f"controller {short(name)}: {error}{where}") from None
    except (Exception, SystemExit) as error:  # a user's module may raise anything
        why = one_line_of(error)
        why = why if len(why) <= LONGEST_REASON else f"{why[:LONGEST_REASON]}..."
        advice = _advice(module, attribute, error) or advice
        raise InputError(f"controller {short(name)} cannot be imported ({why}): {advice}") from None
    if not _is_law(law):
        raise InputError(f"controller {short(name)} is not a ControlLaw: {advice}")
    law_class: type[ControlLaw] = law
    return law_class


def _advice(module: str, attribute: str, error: BaseException) -> str:
    """Return advice for a module that was not found; empty for any other error."""
    if not isinstance(error, ModuleNotFoundError):
        return ""
    own = f"{module.replace('.', '/')}{ENDING}"
    if error.name and module.startswith(error.name) and os.path.isfile(own):
        return f"the current folder is not searched for modules: name the file, {own}:{attribute}"
    return "modules are searched for on PYTHONPATH; a file is named by its path, file.py:Class"


def _is_law(value: object) -> bool:
    return isinstance(value, ABCMeta) and issubclass(value, ControlLaw) and not isabstract(value)
