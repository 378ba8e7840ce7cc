"""The wheels of a plant's base, put into its model, its friction and its state."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from space_robot_model.dynamics.model import Model
from space_robot_model.hardware.wheels import WheelSettings
from space_robot_msgs_py.compiled.records import assign

from ..environment.friction import Friction

Array = NDArray[np.float64]


def mount_wheels(
    wheels: WheelSettings, model: Model, friction: Friction, velocities: Array
) -> None:
    """Mount ``wheels`` on a plant's base, with their velocities at tick 0.

    Args:
        wheels: which fit the base.
        model: of the plant's robot.
        friction: in which that of the wheels is put.
        velocities: (MOST_WHEELS,) of the wheels in the plant's state, rad/s.
    """
    count = wheels.count
    if not count:
        return
    assign(model, wheel_count=count)
    model.wheel_axis[:count] = wheels.unit_axes
    model.wheel_inertia[:count] = wheels.values("rotor_inertia")
    Friction.add_wheels(friction, wheels.values("coulomb"), wheels.values("viscous"))
    velocities[:count] = wheels.values("initial_speed")
