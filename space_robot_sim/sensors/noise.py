"""Rows of the sensors' random numbers, which are drawn in blocks of ticks."""

from __future__ import annotations

from space_robot_msgs_py.compiled.kernels import kernel

from ..faults.schedule import BLOCK_TICKS


@kernel
def row_of(tick: int) -> int:
    """Return the row of a tick in its block of random numbers."""
    return tick % BLOCK_TICKS
