"""All actuators of one robot: a new effect is a line in each list.

What a command passes on its way to the robot, axis by axis:

    command -> delay -> limits -+-> quantisation, dead band -> lag -> scale, bias -+-> given
                                |                                                  |
                                +-- torque_echo: command ---+--- torque_echo: given
                                                            |
                                          echo's scale, bias -> reported

What is reported is all that the flight software is told of it. By default that is the command
behind delay and limits: what the drives make of it stays unknown.

That is the way of joints, and of a base whose torque is ideal. A base with hardware is turned by
its wheels and thrusters, each by a number of the command: limits and drives of base axes do
nothing. What wheels and thrusters gave is its torque given, which the echo's scale and bias make
the one reported. A base without actuators gets nothing.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from space_robot_model.hardware.base_actuators import BaseActuatorSettings
from space_robot_model.hardware.drives import DriveSettings
from space_robot_model.robot import Robot
from space_robot_msgs_py.compiled.kernels import kernel
from space_robot_msgs_py.compiled.records import Record, assign, nested, shaped
from space_robot_msgs_py.errors import InputError
from space_robot_msgs_py.samples import MOST_THRUSTERS, MOST_WHEELS, State

from ..faults.schedule import PartFault, Schedule
from .command_delay import CommandDelaySettings, delay_command, ring_of
from .drive import Drive, WrongDrive, drive_torque
from .thrusters import StuckThruster, Thrusters, fire
from .torque_echo import TorqueEcho, TorqueEchoSettings, WrongEcho, report_torque
from .torque_limit import (
    SATURATE_BASE,
    TorqueLimit,
    TorqueLimitSettings,
    WeakActuators,
    limit_torque,
)
from .wheels import DeadWheel, Wheels, drive_wheels

Array = NDArray[np.float64]


class ActuatorSettings(
    BaseActuatorSettings,
    TorqueEchoSettings,
    DriveSettings,
    TorqueLimitSettings,
    CommandDelaySettings,
):
    """Settings of the actuators."""

    def check(self, robot: Robot, file: str) -> None:
        """See that the numbers fit, see `BaseActuatorSettings.check`.

        Raises:
            InputError: they do not.
        """
        super().check(robot, file)
        if self.base_actuation != "ideal" and self.base_torque_limit:
            raise InputError(
                f"base_torque_limit is for base_actuation ideal, got {self.base_actuation!r} "
                f"(actuators {file}): wheels have max_torque"
            )


class Actuators(Record):
    """The actuators of one robot, as the plant's kernels read them."""

    torque_limit: TorqueLimit = nested(TorqueLimit)
    drive: Drive = nested(Drive)
    torque_echo: TorqueEcho = nested(TorqueEcho)
    wheels: Wheels = nested(Wheels)
    thrusters: Thrusters = nested(Thrusters)
    base_is_ideal: float = shaped(lambda n: ())
    """1 if the base gets the torque that is commanded; 0 if only what its hardware gives."""
    saturated_ticks: float = shaped(lambda n: ())
    """Ticks so far in which a torque was at its limit."""
    latency: Array = shaped(lambda n: (n + 3 + MOST_WHEELS + MOST_THRUSTERS,))
    """Ticks by which each number of a command is late."""
    due: Array = shaped(lambda n: (n + 3 + MOST_WHEELS + MOST_THRUSTERS,))
    """The command that is due at the current tick, as long as that is."""
    base_wrench: Array = shaped(lambda n: (6,))
    """Force, N, and torque, N m, on base axes, of all that acts on the base but the wheels."""

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
            wheels=Wheels.build(n, settings.wheels),
            thrusters=Thrusters.build(n, settings.thrusters, period),
            base_is_ideal=settings.base_actuation == "ideal",
            latency=settings.command_latency_ticks,
        )
        if settings.thruster_count:
            first = n + 3 + settings.wheel_count
            delays = settings.thrusters.ticks("delay", period)
            actuators.latency[first : first + settings.thruster_count] += delays
        return actuators


FAULTS: dict[str, type[PartFault]] = {
    "torque_limit": WeakActuators,
    "drive": WrongDrive,
    "torque_echo": WrongEcho,
    "wheels": DeadWheel,
    "thrusters": StuckThruster,
}
"""The faults of each field of `Actuators`."""


def check_faults(schedule: Schedule, settings: BaseActuatorSettings) -> None:
    """See that the actuators of a base can fail as a flight's faults say.

    Raises:
        InputError: the torque of a base that is not ideal is to be limited.
    """
    if settings.base_actuation != "ideal" and schedule.of(SATURATE_BASE):
        raise InputError(
            f"fault {SATURATE_BASE.name} is for base_actuation ideal, got "
            f"{settings.base_actuation!r}: wheels and thrusters have faults of their own"
        )


def reports_given(actuators: Actuators) -> bool:
    """Return whether sound actuators report exactly the torque that they give."""
    echo = actuators.torque_echo
    return bool(echo.is_exact and (echo.is_of_given or actuators.drive.is_exact))


def command_delay_buffer(actuators: Actuators, names: int) -> Array:
    """Return the ring (ticks, names) of commands of so many numbers that are on their way."""
    return ring_of(actuators.latency[:names])


@kernel
def actuate(
    actuators: Actuators,
    command_delay_buffer: Array,
    command: Array,
    tick: int,
    period: float,
    truth: State,
    measured: State,
) -> None:
    """Write what ``command`` makes the actuators give from ``tick`` to the next.

    Args:
        actuators: of the robot; ``base_wrench`` is written.
        command_delay_buffer: ring of the commands on their way.
        command: (n+3+A,) N m: base x, y, z (base frame), then joints; then of the base's hardware:
            torques of wheels' motors, N m, forces of thrusters, N.
        tick: at which it is given.
        period: of a tick, s.
        truth: ``wheel_velocities`` at ``tick`` are read; ``applied_torque`` (the one that acts on
            the robot), ``wheel_torques`` and ``thrusts`` are written.
        measured: the same are written, ``applied_torque`` being what the flight software is told.
    """
    applied, reported = truth.applied_torque, measured.applied_torque
    due, wrench = actuators.due, actuators.base_wrench
    delay_command(actuators.latency, command_delay_buffer, command, tick, due)
    reported[:] = due[: reported.size]
    if actuators.base_is_ideal == 0.0:
        reported[:3] = 0.0
    saturated = limit_torque(actuators.torque_limit, reported)
    drive_torque(actuators.drive, reported, applied)
    if actuators.base_is_ideal == 0.0:
        wrench[:] = 0.0
        wheels, axes = int(actuators.wheels.count), applied.size
        fire(actuators.thrusters, due[axes + wheels :], period, truth.thrusts, wrench)
        applied[:3] = wrench[3:]
        saturated += drive_wheels(
            actuators.wheels,
            due[axes:],
            truth.wheel_velocities,
            period,
            truth.wheel_torques,
            applied,
        )
        reported[:3] = applied[:3]
        measured.wheel_torques[:] = truth.wheel_torques
        measured.thrusts[:] = truth.thrusts
    else:
        wrench[3:] = applied[:3]
    actuators.saturated_ticks += min(saturated, 1.0)
    report_torque(actuators.torque_echo, applied, reported)
