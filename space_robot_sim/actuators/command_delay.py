"""Commands that take some ticks from the controller to the actuators."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from space_robot_msgs_py.compiled.kernels import kernel
from space_robot_msgs_py.config.validation import StrictModel

Array = NDArray[np.float64]


class CommandDelaySettings(StrictModel):
    """How late commands are applied."""

    command_latency_ticks: Annotated[int, Field(ge=0, le=1000)] = Field(
        0, description="ticks by which a command is applied late"
    )


def command_delay_buffer(settings: CommandDelaySettings, n: int) -> Array:
    """Return the ring (ticks, n+3) of the commands on their way, N m; before the first is none."""
    return np.zeros((settings.command_latency_ticks, n + 3))


@kernel
def delay_command(buffer: Array, command: Array, tick: int, out: Array) -> None:
    """Put ``command`` (n+3,) into the ring at ``tick``; write what is due there into ``out``."""
    latency = buffer.shape[0]
    for i in range(out.size):
        due = command[i]
        if latency > 0:
            due = buffer[tick % latency, i]
            buffer[tick % latency, i] = command[i]
        out[i] = due
