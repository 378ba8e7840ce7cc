"""Control laws in a user's Python file, selected by path and class: ``./my_laws.py:ADRC``.

The file is imported under a unique module name, so that it cannot be confused with a module of
another folder; its folder is not added to the search path.
"""

from __future__ import annotations

import hashlib
import importlib.util
import sys
from pathlib import Path
from types import ModuleType

from space_robot_msgs_py.config.yaml_text import check_file

ENDING = ".py"
_NAMES: dict[str, str] = {}
"""Path of each module imported here, by the module's name."""


def law_file(name: str) -> Path | None:
    """Return the file of a law's name ``PATH.py:Class``; None for a name of another form."""
    path, colon, _ = name.rpartition(":")
    return Path(path) if colon and path.endswith(ENDING) else None


def import_file(path: Path) -> ModuleType:
    """Import a Python file, once per process.

    Raises:
        InputError: there is no such file.
        Exception: whatever its code raises.
    """
    check_file(path)
    digest = hashlib.sha256(str(path.resolve()).encode()).hexdigest()[:12]
    name = f"{path.stem}_{digest}"
    if name not in sys.modules:
        spec = importlib.util.spec_from_file_location(name, path.resolve())
        assert spec
        assert spec.loader
        sys.modules[name] = module = importlib.util.module_from_spec(spec)
        try:
            spec.loader.exec_module(module)
        except BaseException:
            del sys.modules[name]
            raise
        _NAMES[name] = str(path)
    return sys.modules[name]


def importable_name(law: type) -> str:
    """Return the name by which another process imports a law: ``module:Class`` or with a path."""
    return f"{_NAMES.get(law.__module__, law.__module__)}:{law.__qualname__}"
