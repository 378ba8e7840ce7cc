"""A payload on the last link, unknown to the controller."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from space_robot_model.robot import Robot
from space_robot_model.robot.inertia import Inertia
from space_robot_msgs_py.config.validation import StrictModel


class PayloadSettings(StrictModel):
    """A payload as the last link's new mass and inertia; unknown to every controller."""

    mass: Annotated[float, Field(ge=0.0, le=1e6)] = Field(
        0.0, description="mass of the last link with its payload, kg (0: nominal)"
    )
    inertia: Inertia = Field(
        [1.0, 1.0, 1.0, 0.0, 0.0, 0.0],
        description="Ixx, Iyy, Izz, Ixy, Ixz, Iyz of the last link with payload, kg m2",
    )


def with_payload(robot: Robot, payload: PayloadSettings) -> Robot:
    """Return the robot that the plant integrates: nominal, or loaded on its last link."""
    return robot.with_last_link(payload.mass, payload.inertia) if payload.mass else robot
