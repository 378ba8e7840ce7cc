"""A control law in a Python file of the user's, named by the file's path: ``./my_laws.py:ADRC``.

The file is imported under a name of its own, so that no module of another folder is taken for it;
its folder is not searched for the modules that it imports.
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
"""Of each module imported here, by its name: the path it was imported by."""


def law_file(name: str) -> Path | None:
    """Return the file that a law's name, ``PATH.py:Class``, refers to; None if it names none."""
    path, colon, _ = name.rpartition(":")
    return Path(path) if colon and path.endswith(ENDING) else None


def import_file(path: Path) -> ModuleType:
    """Import a Python file, once a process.

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
    """Return the name by which another process imports a law: ``module:Class`` or a file's."""
    return f"{_NAMES.get(law.__module__, law.__module__)}:{law.__qualname__}"
