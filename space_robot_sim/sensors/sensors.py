"""All sensors of one robot."""

from __future__ import annotations

import zlib

import numpy as np
from numpy.typing import NDArray

from space_robot_model.elementary.normal import normal_numbers
from space_robot_model.hardware.sensors import SensorSettings
from space_robot_msgs_py.compiled.kernels import kernel
from space_robot_msgs_py.compiled.lanes import uniform
from space_robot_msgs_py.compiled.records import nested, shaped
from space_robot_msgs_py.samples import State

from ..component import Component
from ..faults.schedule import BLOCK_TICKS
from .encoders import Encoders, read_encoders, read_motors
from .gyro import Gyro, read_gyro
from .magnetometer import Magnetometer, read_magnetometer
from .star_tracker import StarTracker, track_stars

Array = NDArray[np.float64]


IDEAL = [(name, getattr(SensorSettings(), name)) for name in SensorSettings.model_fields]
"""The settings of each sensor without error."""


class Sensors(Component):
    """Record of the sensors of one robot, for the plant's kernels."""

    star_tracker: StarTracker = nested(StarTracker)
    gyro: Gyro = nested(Gyro)
    encoders: Encoders = nested(Encoders)
    magnetometer: Magnetometer = nested(Magnetometer)
    are_ideal: float = shaped(
        lambda n: (),
        uniform=True,
        source=lambda s, at: all(getattr(s, name) == default for name, default in IDEAL),
    )
    """1 if all sensors are without error."""
    seed: float = shaped(lambda n: (), source=lambda s, at: at.seed)
    """Of the random numbers."""
    drawn: float = shaped(lambda n: (), uniform=True, source=lambda s, at: -1.0)
    """The block of ticks whose random numbers have been drawn; -1: none yet."""


STAR_TRACKER, GYRO, ENCODERS = (
    zlib.crc32(name.encode()) for name in ("star_tracker", "gyro", "encoders")
)
"""Keys of the sensors' random numbers."""


@kernel
def sense(sensors: Sensors, truth: State, tick: int, period: float, measured: State) -> None:
    """Write the measurements of ``truth`` at ``tick`` into ``measured``; call once a tick.

    The torques in ``measured`` are left alone; position and velocity of the base, the speeds of its
    wheels, the motion of joints without motors and of motors behind gears, place and velocity in an
    orbit and torques from outside have no error.
    """
    measured.base_position[:] = truth.base_position
    measured.base_velocity[:] = truth.base_velocity
    measured.wheel_velocities[:] = truth.wheel_velocities
    measured.passive_positions[:] = truth.passive_positions
    measured.passive_velocities[:] = truth.passive_velocities
    measured.motor_positions[:] = truth.motor_positions
    measured.motor_velocities[:] = truth.motor_velocities
    measured.orbit_position[:] = truth.orbit_position
    measured.orbit_velocity[:] = truth.orbit_velocity
    measured.magnetic_field[:] = truth.magnetic_field
    measured.external_torques[:] = truth.external_torques
    if uniform(sensors.are_ideal) == 1.0:
        # no random number is drawn, and no arithmetic changes a bit
        measured.quaternion[:] = truth.quaternion
        measured.omega_base[:] = truth.omega_base
        measured.joint_positions[:] = truth.joint_positions
        measured.joint_velocities[:] = truth.joint_velocities
        read_motors(sensors.encoders, truth, measured)
    else:
        _draw(sensors, tick)
        track_stars(sensors.star_tracker, truth, tick, measured)
        read_gyro(sensors.gyro, truth, tick, period, measured)
        read_encoders(sensors.encoders, truth, tick, period, measured)
        read_magnetometer(sensors.magnetometer, sensors.seed, truth, tick, measured)


@kernel
def _draw(sensors: Sensors, tick: int) -> None:
    """Draw the random numbers of the block of ticks that ``tick`` is in, unless they are drawn.

    They are a function of seed, sensor and tick alone: a flight repeats exactly, in any number of
    processes, and no sensor's numbers depend on the sensors beside it.
    """
    block = tick // BLOCK_TICKS
    if uniform(sensors.drawn) == block:
        return
    sensors.drawn = block
    normal_numbers(sensors.star_tracker.draws, sensors.seed, STAR_TRACKER, block)
    normal_numbers(sensors.gyro.draws, sensors.seed, GYRO, block)
    normal_numbers(sensors.encoders.draws, sensors.seed, ENCODERS, block)
