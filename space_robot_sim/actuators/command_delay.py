"""Delay of commands between controller and actuators."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from space_robot_msgs_py.compiled.kernels import kernel
from space_robot_msgs_py.config.validation import StrictModel

Array = NDArray[np.float64]


class CommandDelaySettings(StrictModel):
    """Settings of the delay of commands."""

    command_latency_ticks: Annotated[int, Field(ge=0, le=1000)] = Field(
        0, description="ticks by which a command is applied late"
    )


def ring_of(latency: Array) -> Array:
    """Return a ring buffer (ticks, c) of commands in transit, filled with zeros.

    Args:
        latency: (c,) ticks by which each number of a command is late.
    """
    longest = int(latency.max(initial=0.0))
    return np.zeros((longest + 1 if longest else 0, latency.size))


@kernel
def delay_command(latency: Array, ring: Array, command: Array, tick: int, out: Array) -> None:
    """Store ``command`` (c,) in the ring at ``tick``; write the command due into ``out``.

    ``latency`` holds the ticks by which each number is late; before the first command is none.
    """
    rows = ring.shape[0]
    for i in range(command.size):
        due = command[i]
        if rows > 0:
            ring[tick % rows, i] = command[i]
            due = ring[(tick - int(latency[i])) % rows, i]
        out[i] = due
