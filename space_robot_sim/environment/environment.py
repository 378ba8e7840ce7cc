"""Environment of the robot: friction, disturbances, payload and events."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from pydantic import Field

from space_robot_model.robot import Robot
from space_robot_model.robot.inertia import Inertia
from space_robot_msgs_py.compiled.records import nested
from space_robot_msgs_py.config.validation import StrictModel

from ..component import Component
from .disturbance import Disturbance, DisturbanceSettings
from .events import Event, EventTexts, parse_events
from .friction import Friction, FrictionSettings
from .loads import PrescribedLoads
from .orbit import Orbit, OrbitSettings
from .surfaces import Surfaces


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


class EnvironmentSettings(OrbitSettings):
    """Settings of the environment, in an orbit or not."""

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


class Environment(Component):
    """Record of the environment of one robot, for the plant's kernels."""

    friction: Friction = nested(Friction)
    disturbance: Disturbance = nested(Disturbance)
    orbit: Orbit = nested(Orbit)
    surfaces: Surfaces = nested(Surfaces)
    loads: PrescribedLoads = nested(PrescribedLoads)
