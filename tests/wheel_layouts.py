"""Layouts of wheels, and their tables."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from space_robot_control.allocation.wheel_set import WheelSet, tabulate
from space_robot_msgs_py.samples import MOST_WHEELS

Array = NDArray[np.float64]

PYRAMID = np.array([[1, 0, 0.7], [0, 1, 0.7], [-1, 0, 0.7], [0, -1, 0.7]])


def wheel_set(axes: Array, loads: Array | None = None, out: tuple[int, ...] = ()) -> WheelSet:
    """Tables of wheels with some axes (of any length) and full loads, but for those ``out``."""
    wheels, axis, count = WheelSet.allocate(1), np.zeros((MOST_WHEELS, 3)), len(axes)
    axis[:count] = axes / np.linalg.norm(axes, axis=1, keepdims=True)
    wheels.full_load[:] = 1.0
    wheels.full_load[:count] = 1.0 if loads is None else loads
    wheels.takes_part[:count] = 1.0
    wheels.takes_part[list(out)] = 0.0
    tabulate(wheels, axis, count)
    return wheels


def unit(axes: Array) -> Array:
    return np.asarray(axes / np.linalg.norm(axes, axis=1, keepdims=True))
