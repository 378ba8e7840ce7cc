"""All that acts on the robot besides its actuators: a new disturbance is a line in each list."""

from __future__ import annotations

from pydantic import Field

from space_robot_msgs_py.compiled.records import Record, assign, nested
from space_robot_msgs_py.config.validation import StrictModel

from ..faults.schedule import PartFault
from ..robot import Robot
from .disturbance import Disturbance, DisturbanceSettings
from .events import EventTexts
from .friction import Friction, FrictionSettings, StuckJoint
from .payload import PayloadSettings


class EnvironmentSettings(StrictModel):
    """Settings of the environment."""

    friction: FrictionSettings = FrictionSettings()
    disturbance: DisturbanceSettings = DisturbanceSettings()
    payload: PayloadSettings = PayloadSettings()
    events: EventTexts = Field(
        [""],
        description="what is captured and released: capture@T:TARGET, release@T[:SPEED], see "
        "docs/manual",
    )


class Environment(Record):
    """The environment of one robot, as the plant's kernels read it."""

    friction: Friction = nested(Friction)
    disturbance: Disturbance = nested(Disturbance)

    @classmethod
    def build(cls, robot: Robot, settings: EnvironmentSettings) -> Environment:
        """Read the numbers of the settings for a robot."""
        environment = cls.allocate(robot.n)
        assign(
            environment,
            friction=Friction.build(robot, settings.friction),
            disturbance=Disturbance.build(robot.n, settings.disturbance),
        )
        return environment


FAULTS: dict[str, type[PartFault]] = {"friction": StuckJoint}
"""The faults of each field of `Environment`."""
