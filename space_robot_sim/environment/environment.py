"""What acts on the robot besides its actuators: friction, disturbances, payload (27), (61)."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from space_robot_msgs_py.compiled.kernels import kernel
from space_robot_msgs_py.compiled.records import Record, assign, shaped
from space_robot_msgs_py.config.validation import StrictModel

from ..robot import Robot
from ..robot.file import Inertia

Array = NDArray[np.float64]

NonNegative = Annotated[float, Field(ge=0.0, le=1e6)]
Frequencies = Annotated[list[float], Field(min_length=2, max_length=2)]


class FrictionSettings(StrictModel):
    """``f_f = f_C sign(thetadot) + f_V thetadot`` on every joint."""

    coulomb: NonNegative = Field(0.02, description="Coulomb friction f_C of each joint, N m")
    viscous: NonNegative = Field(0.2, description="viscous friction f_V of each joint, N m s/rad")


class DisturbanceSettings(StrictModel):
    """Disturbance torques: ``scale * amplitude * (sin(2 pi f1 t) + sin(2 pi f2 t))``, (61)."""

    scale: NonNegative = Field(0.0, description="factor on all disturbances, k of (61)-(63)")
    base_amplitude: NonNegative = Field(0.010, description="on base x, y, z, N m")
    base_frequencies: Frequencies = Field([0.5, 0.75], description="of its two sines, Hz (0: none)")
    inner_amplitude: NonNegative = Field(0.005, description="on joints 1 to 3, N m")
    inner_frequencies: Frequencies = Field(
        [0.25, 0.5], description="of its two sines, Hz (0: none)"
    )
    outer_amplitude: NonNegative = Field(0.002, description="on joints 4 and up, N m")
    outer_frequencies: Frequencies = Field(
        [0.25, 0.0], description="of its two sines, Hz (0: none)"
    )


class PayloadSettings(StrictModel):
    """A payload as the last link's new mass and inertia; unknown to every controller."""

    mass: NonNegative = Field(
        0.0, description="mass of the last link with payload, kg (0: nominal)"
    )
    inertia: Inertia = Field(
        [1.0, 1.0, 1.0, 0.0, 0.0, 0.0],
        description="Ixx, Iyy, Izz, Ixy, Ixz, Iyz of the last link with payload, kg m2",
    )


class Environment(Record):
    """Friction and disturbances of one robot, as the plant's kernel reads them."""

    coulomb: Array = shaped(lambda n: (n,))
    """N m."""
    viscous: Array = shaped(lambda n: (n,))
    """N m s/rad."""
    amplitude: Array = shaped(lambda n: (3,))
    """N m on the base (inertial axes), on joints 1 to 3, on joints 4 and up."""
    angular_frequency: Array = shaped(lambda n: (3, 2))
    """rad/s, of the same."""

    @classmethod
    def build(
        cls, n: int, friction: FrictionSettings, disturbance: DisturbanceSettings
    ) -> Environment:
        """For a robot of ``n`` joints."""
        d = disturbance
        amplitudes = [d.base_amplitude, d.inner_amplitude, d.outer_amplitude]
        frequencies = [d.base_frequencies, d.inner_frequencies, d.outer_frequencies]
        environment = cls.allocate(n)
        assign(
            environment, coulomb=friction.coulomb, viscous=friction.viscous,
            amplitude=d.scale * np.array(amplitudes),
            angular_frequency=2.0 * np.pi * np.array(frequencies),
        )  # fmt: skip
        return environment


def with_payload(robot: Robot, payload: PayloadSettings) -> Robot:
    """The robot the plant integrates: nominal, or with the payload on its last link."""
    return robot.with_last_link(payload.mass, payload.inertia) if payload.mass else robot


@kernel
def disturbance_torque(environment: Environment, time: float, out: Array) -> None:
    """Write into ``out`` (n+3,) ``f_d`` at ``time``: base on inertial axes, joints; N m."""
    frequency = environment.angular_frequency
    for group in range(3):
        first, last = 3 * group, out.size if group == 2 else min(3 * group + 3, out.size)
        amplitude, torque = environment.amplitude[group], 0.0
        if amplitude != 0.0:
            wave = np.sin(frequency[group, 0] * time) + np.sin(frequency[group, 1] * time)
            torque = amplitude * wave
        for i in range(first, last):
            out[i] = torque


@kernel
def friction_torque(environment: Environment, joint: int, rate: float) -> float:
    """``f_f`` of one joint turning at ``rate``, N m; it opposes the motion."""
    torque: float = environment.coulomb[joint] * np.sign(rate) + environment.viscous[joint] * rate
    return torque
