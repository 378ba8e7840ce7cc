"""All sensors of one robot."""

from __future__ import annotations

import zlib
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from space_robot_model.elementary.normal import normal_numbers
from space_robot_model.hardware.sensors import SensorSettings
from space_robot_msgs_py.compiled.kernels import kernel
from space_robot_msgs_py.compiled.lanes import uniform
from space_robot_msgs_py.compiled.records import Record, assign, nested, shaped
from space_robot_msgs_py.errors import InputError
from space_robot_msgs_py.samples import State

from ..faults.schedule import BLOCK_TICKS, PartFault
from .encoders import EncoderFault, Encoders, read_encoders, see_motors
from .gyro import Gyro, GyroFault, read_gyro
from .star_tracker import StarTracker, StarTrackerFault, track_stars

Array = NDArray[np.float64]


class Sensors(Record):
    """Record of the sensors of one robot, for the plant's kernels."""

    star_tracker: StarTracker = nested(StarTracker)
    gyro: Gyro = nested(Gyro)
    encoders: Encoders = nested(Encoders)
    are_ideal: float = shaped(lambda n: (), uniform=True)
    """1 if all sensors are without error."""
    seed: float = shaped(lambda n: ())
    """Of the random numbers."""
    drawn: float = shaped(lambda n: (), uniform=True)
    """The block of ticks whose random numbers have been drawn; -1: none yet."""

    @classmethod
    def build(
        cls,
        n: int,
        settings: SensorSettings,
        period: float,
        truth: State,
        is_prismatic: Sequence[bool] | NDArray[np.bool_] = (),
        seed: int = 0,
        motors: Sequence[int] = (),
    ) -> Sensors:
        """Read the numbers of the settings for a robot of ``n`` joints, at rest at ``truth``.

        ``is_prismatic`` (n,): which joints slide (empty: none); ``seed``: of the random numbers,
        below 2**32; ``motors`` (n,): see `Encoders`.

        Raises:
            InputError: they do not fit one another or the period.
        """
        sensors = cls.allocate(n)
        try:
            assign(
                sensors,
                star_tracker=StarTracker.build(n, settings.star_tracker, period, truth),
                gyro=Gyro.build(n, settings.gyro, period, truth),
                encoders=Encoders.build(n, settings.encoders, period, truth, is_prismatic, motors),
                are_ideal=all(getattr(settings, name) == default for name, default in IDEAL),
                seed=seed,
                drawn=-1.0,
            )
        except InputError as error:
            file = getattr(settings, "sensors", "given")  # the plant node's settings name it
            raise InputError(f"sensors {file}: {error}") from None
        return sensors


IDEAL = [(name, getattr(SensorSettings(), name)) for name in SensorSettings.model_fields]
"""The settings of each sensor without error."""

STAR_TRACKER, GYRO, ENCODERS = (
    zlib.crc32(name.encode()) for name in ("star_tracker", "gyro", "encoders")
)
"""Keys of the sensors' random numbers."""
FAULTS: dict[str, type[PartFault]] = {
    "star_tracker": StarTrackerFault,
    "gyro": GyroFault,
    "encoders": EncoderFault,
}
"""The faults of each field of `Sensors`."""


@kernel
def sense(sensors: Sensors, truth: State, tick: int, period: float, measured: State) -> None:
    """Write the measurements of ``truth`` at ``tick`` into ``measured``; call once a tick.

    The torques in ``measured`` are left alone; position and velocity of the base, the speeds of its
    wheels, the motion of joints without motors and of motors behind gears, and what there is to
    know of an orbit have no error.
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
        measured.quaternion[:] = truth.quaternion
        measured.omega_base[:] = truth.omega_base
        measured.joint_positions[:] = truth.joint_positions
        measured.joint_velocities[:] = truth.joint_velocities
        see_motors(sensors.encoders, truth, measured)
    else:
        _draw(sensors, tick)
        track_stars(sensors.star_tracker, truth, tick, measured)
        read_gyro(sensors.gyro, truth, tick, period, measured)
        read_encoders(sensors.encoders, truth, tick, period, measured)


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
