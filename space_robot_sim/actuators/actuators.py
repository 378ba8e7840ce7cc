"""All actuators of one robot.

Signal path of a command, for each axis:

    command -> delay -> limits -+-> quantisation, dead band -> lag -> scale, bias -+-> given
                                |                                                  |
                                +-- torque_echo: command ---+--- torque_echo: given
                                                            |
                                          echo's scale, bias -> reported

The flight software receives only the reported torque. By default that is the command after delay
and limits, so errors of the drives are unknown to it.

This path applies to joints, and to a base with ideal torque. A base with hardware is turned by
its wheels, thrusters and magnetic torquers, each with its own value in the command; limits and
drives of base axes have no effect. Their torque is then the given torque, from which the echo's
scale and bias make the reported one. A base without actuators receives no torque.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from space_robot_model.hardware.base_actuators import BaseActuatorSettings
from space_robot_model.hardware.drives import DriveSettings
from space_robot_model.robot import Robot
from space_robot_msgs_py.compiled.kernels import kernel
from space_robot_msgs_py.compiled.lanes import uniform, whole
from space_robot_msgs_py.compiled.records import nested, shaped
from space_robot_msgs_py.errors import InputError
from space_robot_msgs_py.samples import MOST_ACTUATORS, State

from ..component import Component, Installation
from ..faults.schedule import Schedule
from .drive import Drive, TorqueEcho, TorqueLimit, drive_torque, limit_torque, report_torque
from .magnetic_torquers import MagneticTorquers, magnetise
from .thrusters import Thrusters, fire
from .wheels import Wheels, drive_wheels

Array = NDArray[np.float64]


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
            due = ring[(tick - whole(latency[i])) % rows, i]
        out[i] = due


class ActuatorSettings(BaseActuatorSettings, DriveSettings):
    """Settings of the actuators."""

    def check(self, robot: Robot, file: str) -> None:
        """Check the settings, see `BaseActuatorSettings.check`."""
        super().check(robot, file)
        if self.base_actuation != "ideal" and self.base_torque_limit:
            raise InputError(
                f"base_torque_limit is for base_actuation ideal, got {self.base_actuation!r} "
                f"(actuators {file}): wheels have max_torque"
            )


def _latency(settings: ActuatorSettings, at: Installation) -> Array:
    latency = np.full(at.n + 3 + MOST_ACTUATORS, float(settings.command_latency_ticks))
    if settings.thruster_count:
        first = at.n + 3 + settings.wheel_count
        delays = settings.thrusters.ticks("delay", at.period)
        latency[first : first + settings.thruster_count] += delays
    return latency


class Actuators(Component):
    """Record of the actuators of one robot, for the plant's kernels."""

    torque_limit: TorqueLimit = nested(TorqueLimit)
    drive: Drive = nested(Drive)
    torque_echo: TorqueEcho = nested(TorqueEcho)
    wheels: Wheels = nested(Wheels)
    thrusters: Thrusters = nested(Thrusters)
    magnetic_torquers: MagneticTorquers = nested(MagneticTorquers)
    base_is_ideal: float = shaped(
        lambda n: (), uniform=True, source=lambda s, at: s.base_actuation == "ideal"
    )
    """1 if the base receives the commanded torque; 0 if it has hardware or no actuators."""
    saturated_ticks: float = shaped(lambda n: ())
    """Number of ticks in which a torque was at its limit."""
    latency: Array = shaped(lambda n: (n + 3 + MOST_ACTUATORS,), uniform=True, source=_latency)
    """Ticks by which each number of a command is late."""
    due: Array = shaped(lambda n: (n + 3 + MOST_ACTUATORS,))
    """The command due at the current tick."""
    base_wrench: Array = shaped(lambda n: (6,))
    """Force, N, and torque, N m, on base axes, of all that acts on the base but the wheels."""


def check_faults(schedule: Schedule, settings: BaseActuatorSettings) -> None:
    """Check that the actuators of a base can have the faults of a flight."""
    if settings.base_actuation != "ideal" and schedule.of("saturate_base"):
        raise InputError(
            f"fault saturate_base is for base_actuation ideal, got "
            f"{settings.base_actuation!r}: wheels and thrusters have faults of their own"
        )


def reports_given(actuators: Actuators) -> bool:
    """Return whether actuators without faults report exactly the torque that they give."""
    echo = actuators.torque_echo
    return bool(echo.is_exact and (echo.is_of_given or actuators.drive.is_exact))


def command_delay_buffer(actuators: Actuators, names: int) -> Array:
    """Return the ring buffer (ticks, names) of commands in transit, filled with zeros."""
    # a command that is due at once needs no row
    longest = int(actuators.latency[:names].max(initial=0.0))
    return np.zeros((longest + 1 if longest else 0, names))


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
    """Write the torque of the actuators from ``tick`` to the next for a ``command``.

    Args:
        actuators: of the robot; ``base_wrench`` is written.
        command_delay_buffer: ring buffer of commands in transit.
        command: (n+3+A,) N m: base x, y, z (base frame), then joints; then of the base's hardware:
            torques of wheels' motors, N m, forces of thrusters, N, dipoles of magnetic torquers,
            A m2.
        tick: at which it is given.
        period: of a tick, s.
        truth: ``wheel_velocities`` and ``magnetic_field`` at ``tick`` are read; ``applied_torque``
            (the one that acts on the robot), ``wheel_torques`` and ``thrusts`` are written.
        measured: the same are written; ``applied_torque`` is the reported torque.
    """
    applied, reported = truth.applied_torque, measured.applied_torque
    due, wrench = actuators.due, actuators.base_wrench
    delay_command(actuators.latency, command_delay_buffer, command, tick, due)
    reported[:] = due[: reported.size]
    if uniform(actuators.base_is_ideal) == 0.0:
        reported[:3] = 0.0
    # the echo of a command is that within its limits, before the errors of the drives
    saturated = limit_torque(actuators.torque_limit, reported)
    drive_torque(actuators.drive, reported, applied)
    if uniform(actuators.base_is_ideal) == 0.0:
        wrench[:] = 0.0
        wheels, axes = whole(actuators.wheels.count), applied.size
        fire(actuators.thrusters, due[axes + wheels :], period, truth.thrusts, wrench)
        behind = axes + wheels + whole(actuators.thrusters.count)
        magnetise(actuators.magnetic_torquers, due[behind:], truth.magnetic_field, wrench)
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
