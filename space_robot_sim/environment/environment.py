"""Environment of the robot: friction, disturbances, payload and events."""

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
from .orbit import Orbit
from .orbit_settings import OrbitSettings
from .payload import PayloadSettings
from .prescribed_loads import PrescribedLoads
from .surfaces import Surfaces


class EnvironmentSettings(StrictModel):
    """Settings of the environment."""

    friction: FrictionSettings = FrictionSettings()
    disturbance: DisturbanceSettings = DisturbanceSettings()
    payload: PayloadSettings = PayloadSettings()
    events: EventTexts = Field(
        [""],
        description="captures and releases: capture@T:TARGET, release@T[:SPEED], see docs/manual",
    )

    @property
    def parsed_events(self) -> list[Event]:
        """Events in order of time; files of targets are read.

        Raises:
            InputError: see `parse_events`.
        """
        texts = [text for text in self.events if text.strip()]
        return parse_events(texts, self.events_folder) if texts else []

    @property
    def events_folder(self) -> Path:
        """Additional folder to search for files of targets."""
        return Path()


class Environment(Record):
    """Record of the environment of one robot, for the plant's kernels."""

    friction: Friction = nested(Friction)
    disturbance: Disturbance = nested(Disturbance)
    orbit: Orbit = nested(Orbit)
    surfaces: Surfaces = nested(Surfaces)
    loads: PrescribedLoads = nested(PrescribedLoads)

    @classmethod
    def build(
        cls, robot: Robot, settings: EnvironmentSettings, orbit: OrbitSettings
    ) -> Environment:
        """Read the numbers of the settings for a robot.

        Raises:
            InputError: see `Surfaces`.
        """
        environment = cls.allocate(robot.n)
        assign(
            environment,
            friction=Friction.build(robot, settings.friction),
            disturbance=Disturbance.build(robot.n, settings.disturbance),
            orbit=Orbit.build(robot.n, orbit),
            **({"surfaces": Surfaces.build(robot)} if orbit.has_surfaces else {}),
        )
        return environment


FAULTS: dict[str, type[PartFault]] = {"friction": StuckJoint}
"""The faults of each field of `Environment`."""
