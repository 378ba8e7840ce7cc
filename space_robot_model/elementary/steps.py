"""Quantisation: numbers in whole steps."""

from __future__ import annotations

import numpy as np

from space_robot_msgs_py.compiled.kernels import kernel
from space_robot_msgs_py.compiled.lanes import any_lane, where


@kernel
def in_steps(value: float, step: float) -> float:
    """Round ``value`` to the nearest whole multiple of ``step``; a step of 0 is none."""
    if not any_lane(step > 0.0):
        return value
    spacing = where(step > 0.0, step, 1.0)
    rounded: float = spacing * np.floor(value / spacing + 0.5)
    return where(step > 0.0, rounded, value)
