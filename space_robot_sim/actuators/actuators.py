"""All actuators of one robot: a new effect is a line in each list.

What a command passes on its way to the robot, axis by axis:

    command -> delay -> limits -+-> quantisation, dead band -> lag -> scale, bias -+-> given
                                |                                                  |
                                +-- torque_echo: command ---+--- torque_echo: given
                                                            |
                                          echo's scale, bias -> reported

What is reported is all that the flight software is told of it. By default that is the command
behind delay and limits: what the drives make of it stays unknown.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.compiled.kernels import kernel
from space_robot_msgs_py.compiled.records import Record, assign, nested

from ..faults.schedule import PartFault
from .base_actuation import BaseActuatorSettings
from .command_delay import CommandDelaySettings, delay_command
from .drive import Drive, DriveSettings, WrongDrive, drive_torque
from .torque_echo import TorqueEcho, TorqueEchoSettings, WrongEcho, report_torque
from .torque_limit import TorqueLimit, TorqueLimitSettings, WeakActuators, limit_torque

Array = NDArray[np.float64]


class ActuatorSettings(
    BaseActuatorSettings, TorqueEchoSettings, DriveSettings, TorqueLimitSettings,
    CommandDelaySettings,
):  # fmt: skip
    """Settings of the actuators."""


class Actuators(Record):
    """The actuators of one robot, as the plant's kernels read them."""

    torque_limit: TorqueLimit = nested(TorqueLimit)
    drive: Drive = nested(Drive)
    torque_echo: TorqueEcho = nested(TorqueEcho)

    @classmethod
    def build(cls, n: int, settings: ActuatorSettings, period: float) -> Actuators:
        """Read the numbers of the settings for a robot of ``n`` joints and ticks of ``period``, s.

        Raises:
            InputError: see `per_axis`.
        """
        actuators = cls.allocate(n)
        assign(
            actuators,
            torque_limit=TorqueLimit.build(n, settings),
            drive=Drive.build(n, settings, period),
            torque_echo=TorqueEcho.build(n, settings),
        )
        return actuators


FAULTS: dict[str, type[PartFault]] = {
    "torque_limit": WeakActuators,
    "drive": WrongDrive,
    "torque_echo": WrongEcho,
}
"""The faults of each field of `Actuators`."""


def reports_given(actuators: Actuators) -> bool:
    """Return whether sound actuators report exactly the torque that they give."""
    echo = actuators.torque_echo
    return bool(echo.is_exact and (echo.is_of_given or actuators.drive.is_exact))


@kernel
def actuate(
    actuators: Actuators, command_delay_buffer: Array, command: Array, tick: int, reported: Array,
    given: Array,
) -> None:  # fmt: skip
    """Write the torque, N m, that ``command`` (n+3,) makes from ``tick`` to the next.

    Args:
        actuators: of the robot.
        command_delay_buffer: ring of the commands on their way.
        command: (n+3,) N m: base x, y, z (base frame), then joints.
        tick: at which it is given.
        reported: (n+3,) the torque that the flight software is told of, written.
        given: (n+3,) the torque that acts on the robot, written.
    """
    delay_command(command_delay_buffer, command, tick, reported)
    limit_torque(actuators.torque_limit, reported)
    drive_torque(actuators.drive, reported, given)
    report_torque(actuators.torque_echo, given, reported)
