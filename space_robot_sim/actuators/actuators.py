"""All actuators of one robot: a new one is a line in each list."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.compiled.kernels import kernel
from space_robot_msgs_py.compiled.records import Record, assign, nested

from ..faults.schedule import PartFault
from .command_delay import CommandDelaySettings, delay_command
from .torque_limit import TorqueLimit, TorqueLimitSettings, WeakActuators, limit_torque

Array = NDArray[np.float64]


class ActuatorSettings(TorqueLimitSettings, CommandDelaySettings):
    """Settings of the actuators."""


class Actuators(Record):
    """The actuators of one robot, as the plant's kernels read them."""

    torque_limit: TorqueLimit = nested(TorqueLimit)

    @classmethod
    def build(cls, n: int, settings: ActuatorSettings) -> Actuators:
        """Read the numbers of the settings for a robot of ``n`` joints."""
        actuators = cls.allocate(n)
        assign(actuators, torque_limit=TorqueLimit.build(n, settings))
        return actuators


FAULTS: dict[str, type[PartFault]] = {"torque_limit": WeakActuators}
"""The faults of each field of `Actuators`."""


@kernel
def actuate(
    actuators: Actuators, command_delay_buffer: Array, command: Array, tick: int, out: Array
) -> None:
    """Write into ``out`` (n+3,) the torque, N m, that ``command`` (n+3,) makes from ``tick`` on."""
    delay_command(command_delay_buffer, command, tick, out)
    limit_torque(actuators.torque_limit, out)
