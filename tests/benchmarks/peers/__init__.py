"""Other programs that fly the same robot: MuJoCo, Pinocchio, Basilisk."""

from __future__ import annotations

import importlib.util


def is_installed(module: str) -> bool:
    """Whether a peer's module can be imported."""
    return importlib.util.find_spec(module) is not None
