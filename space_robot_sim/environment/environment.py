"""All that acts on the robot besides its actuators: a new disturbance is a line in each list."""

from __future__ import annotations

from pathlib import Path

from pydantic import Field

from space_robot_model.robot import Robot
from space_robot_msgs_py.compiled.records import Record, assign, nested
from space_robot_msgs_py.config.validation import StrictModel

from ..faults.schedule import PartFault
from .disturbance import Disturbance, DisturbanceSettings
from .events import Event, EventTexts, parse_events
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

    @property
    def parsed_events(self) -> list[Event]:
        """The events, by their times; files of targets are read.

        Raises:
            InputError: see `parse_events`.
        """
        texts = [text for text in self.events if text.strip()]
        return parse_events(texts, self.events_folder) if texts else []

    @property
    def events_folder(self) -> Path:
        """The folder in which files of targets are looked for, beside the one we are in."""
        return Path()


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
