"""Laws by name: shipped ones, a user's own code, and those that a bag may name.

A user's own code is selected by path and name, ``./my_laws.py:ADRC``, or as ``module:ADRC``. The
file is imported under a unique module name, so that it cannot be confused with a module of another
folder; its folder is not added to the search path.

Bags and campaign folders may come from anyone. Names of shipped files and laws are always allowed;
a path to a file, or code to import, is opened only if the user gave it, or trusts the source.
"""

from __future__ import annotations

import hashlib
import importlib.util
import os.path
import pkgutil
import sys
from abc import ABCMeta
from collections.abc import Callable
from functools import cache
from inspect import isabstract
from pathlib import Path
from types import ModuleType
from typing import Any

from space_robot_msgs_py.config.text import choices, one_line_of
from space_robot_msgs_py.config.validation import one_of, short
from space_robot_msgs_py.config.yaml_text import check_readable
from space_robot_msgs_py.errors import InputError, explained_by

from .base import ControlLaw

ENDING = ".py"
LONGEST_REASON = 200
"""Maximum length, in characters, of an error of a user's own code in a message."""
LONGEST_NAME = 100
FILES = (".yaml", ".yml", ".urdf", ".xacro", ".csv", ".parquet")
_NAMES: dict[str, str] = {}
"""Path of each module imported here, by the module's name."""


def _modules() -> tuple[str, ...]:
    room = importlib.import_module(__package__)
    return tuple(module.name for module in pkgutil.iter_modules(room.__path__))


def _laws_in(module: str) -> dict[str, type[ControlLaw]]:
    values = vars(importlib.import_module(f"{__package__}.{module}")).values()
    return {value.name: value for value in values if _is_law(value)}


@cache
def laws() -> dict[str, type[ControlLaw]]:
    """Return every law of this folder by name."""
    return {name: law for module in _modules() for name, law in _laws_in(module).items()}


@explained_by("own-law")
def find_law(name: str) -> type[ControlLaw]:
    """Return the law class by name, by ``path/file.py:Class``, or by ``module:Class``."""
    own = _laws_in(name) if name in _modules() else {}
    if shipped := own.get(name) or laws().get(name):
        return shipped
    if name.endswith(ENDING):
        raise InputError(f"controller {short(name)}: name the class as well, {name}:CLASS")
    advice = choices(name, sorted(laws()), ", or file.py:Class or module:Class of your own")
    if ":" not in name:
        raise InputError(f"unknown controller {short(name)}: {advice}")
    law: type[ControlLaw] = import_named(
        name, f"controller {short(name)}", "class", _is_law, advice, " derived from ControlLaw"
    )
    if not _is_law(law):
        raise InputError(f"controller {short(name)} is not a ControlLaw: {advice}")
    return law


def _is_law(value: object) -> bool:
    return isinstance(value, ABCMeta) and issubclass(value, ControlLaw) and not isabstract(value)


def law_file(name: str) -> Path | None:
    """Return the file of a law's name ``PATH.py:Class``; None for a name of another form."""
    path, colon, _ = name.rpartition(":")
    return Path(path) if colon and path.endswith(ENDING) else None


def import_file(path: Path) -> ModuleType:
    """Import a Python file, once per process; its code may raise anything."""
    check_readable(path)
    digest = hashlib.sha256(str(path.resolve()).encode()).hexdigest()[:12]
    name = f"{path.stem}_{digest}"
    if name not in sys.modules:
        spec = importlib.util.spec_from_file_location(name, path.resolve())
        assert spec
        assert spec.loader
        # in sys.modules while it is executed: dataclasses and pickle look there
        sys.modules[name] = module = importlib.util.module_from_spec(spec)
        try:
            spec.loader.exec_module(module)
        except BaseException:
            del sys.modules[name]
            raise
        _NAMES[name] = str(path)
    return sys.modules[name]


def import_named(
    name: str,
    what: str,
    kind: str,
    is_wanted: Callable[[object], bool],
    advice: str,
    derived: str = "",
) -> Any:
    """Return an object of a user's own code.

    Args:
        name: ``path/file.py:NAME`` or ``module:NAME``.
        what: the name as the user knows it, for errors: "controller './mine.py:Mine'".
        kind: of the object, for errors: "class".
        is_wanted: True for an object of this kind.
        advice: how to name one, for errors.
        derived: what all of this kind have in common, for errors: " derived from ControlLaw".
    """
    module, _, attribute = name.rpartition(":")
    file = law_file(name)
    try:
        imported = importlib.import_module(module) if file is None else import_file(file)
        if file and not hasattr(imported, attribute):
            own = [key for key, value in vars(imported).items() if is_wanted(value)]
            if not own:
                raise InputError(f"{file} has no {kind}{derived}")
            one_of(attribute, own, kind, f" of {file}")
        value = getattr(imported, attribute)
    except InputError as error:
        where = "" if file is None or file.is_absolute() else " (paths are from the current folder)"
        raise InputError(f"{what}: {error}{where}") from None
    except (Exception, SystemExit) as error:  # a user's module may raise anything
        why = one_line_of(error)
        why = why if len(why) <= LONGEST_REASON else f"{why[:LONGEST_REASON]}..."
        advice = _advice(module, attribute, error) or advice
        raise InputError(f"{what} cannot be imported ({why}): {advice}") from None
    return value


def _advice(module: str, attribute: str, error: BaseException) -> str:
    if not isinstance(error, ModuleNotFoundError):
        return ""
    own = f"{module.replace('.', '/')}{ENDING}"
    if error.name and module.startswith(error.name) and os.path.isfile(own):
        return f"the current folder is not searched for modules: name the file, {own}:{attribute}"
    return "modules are searched for on PYTHONPATH; a file is named by its path, file.py:NAME"


def importable_name(own: Any) -> str:
    """Return the name by which another process imports a class or function of a user.

    It is ``module:NAME``, or has the path of a file that `import_file` has imported.
    """
    return f"{_NAMES.get(own.__module__, own.__module__)}:{own.__qualname__}"


class NotTrustedError(InputError):
    """A bag or campaign that is not trusted refers to a file or module."""


def is_plain(name: str) -> bool:
    """Return True if a name can only be that of a shipped file, and False for a path."""
    is_path = "/" in name or name.endswith(FILES) or name in (".", "..")
    return name.isprintable() and not is_path and len(name) <= LONGEST_NAME


def require_shipped_file(what: str, name: str, where: str = "bag") -> None:
    """Raise `NotTrustedError` for a file's name that is a path; ``what`` is the kind of file."""
    if not is_plain(name):
        raise NotTrustedError(
            f"the {where} refers to a file as its {what}, {short(name)}: read only with --trust"
        )


def require_shipped_law(name: str, where: str = "bag") -> None:
    """Raise `NotTrustedError` for a law's name that is not that of a shipped law."""
    if name not in laws():
        raise NotTrustedError(
            f"the {where} uses the law {short(name)}, which is not a shipped one: --trust "
            "imports a module:Class or file.py:Class, which runs its code"
        )
