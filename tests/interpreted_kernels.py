"""A plugin of pytest that runs kernels as plain Python, so that coverage sees their lines.

    python -m pytest -p interpreted_kernels tests/sim/dynamics

Compiled code runs past every tracer. Here the decorators hand the functions back as they are,
before any module uses them; so it is a hundred times slower, and for short tests only.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from space_robot_msgs_py.compiled import kernels


def _as_it_is(function: Any, *_: Any) -> Any:
    return function


def _field_first(self: np.record, name: str) -> Any:
    """As in compiled code: a field's name counts before those of NumPy (``data``)."""
    fields = np.void.__getattribute__(self, "dtype").fields or {}
    return self[name] if name in fields else np.void.__getattribute__(self, name)


kernels.kernel = kernels.subroutine = kernels.function_pointer = _as_it_is  # type: ignore[assignment]
np.record.__getattribute__ = _field_first  # type: ignore[method-assign]
