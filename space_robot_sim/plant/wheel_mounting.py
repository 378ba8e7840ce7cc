"""The wheels of a plant's base, put into its model, its friction and its state."""

from __future__ import annotations

from typing import TYPE_CHECKING

from space_robot_msgs_py.compiled.records import assign

from ..actuators.wheels import WheelSettings
from ..environment.friction import Friction

if TYPE_CHECKING:
    from .plant import PlantMemory


def mount_wheels(memory: PlantMemory, wheels: WheelSettings) -> None:
    """Let the plant's base carry ``wheels``, which turn as they do at tick 0."""
    count = wheels.count
    if not count:
        return
    model, friction = memory.model, memory.environment.friction
    assign(model, wheel_count=count)
    model.wheel_axis[:count] = wheels.unit_axes
    model.wheel_inertia[:count] = wheels.values("rotor_inertia")
    Friction.add_wheels(friction, wheels.values("coulomb"), wheels.values("viscous"))
    n = memory.truth.joint_positions.size
    memory.x[13 + 2 * n :][:count] = wheels.values("initial_speed")
