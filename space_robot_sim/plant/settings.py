"""Settings of the plant node: the plant's own, and how it is paced."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, ClassVar

from pydantic import Field
from typing_extensions import Self

from space_robot_model.robot.find import mission_layers
from space_robot_model.robot.mission_document import mission_layer
from space_robot_msgs_py import topics
from space_robot_msgs_py.config.files import Tree, named_layers
from space_robot_msgs_py.config.settings import NodeSettings, Texts

from ..environment.disturbance_table import table_text
from ..environment.orbit import orbit_layers
from .plant import PlantSettings

MOST_TICKS = 10**10
"""Largest number of ticks of a flight."""


class PlantNodeSettings(PlantSettings, NodeSettings):
    """Parameters of plant_node."""

    node: ClassVar[str] = "plant"
    selectors: ClassVar[tuple[str, ...]] = (
        "robot",
        "mission",
        "case",
        "sensors",
        "actuators",
        "orbit",
    )
    sends: ClassVar[tuple[topics.Topic, ...]] = (
        *topics.STATES,
        topics.CLOCK,
        *topics.TRUTH,
        topics.TRUTH_ORBIT,
        *topics.SCENE,
        topics.PLANT_DESCRIPTION,
    )

    mission: str = Field(
        "", description="a mission of config/missions, or a path to its YAML (empty: the robot's)"
    )
    case: str = Field("1", description="a case of config/cases, or a path to its YAML")
    sensors: str = Field(
        "ideal", description="a set of sensors of config/sensors, or a path to its YAML"
    )
    actuators: str = Field(
        "ideal",
        description="the base's actuators: a name of config/actuators, or a path to a YAML file",
    )
    orbit: str = Field("none", description="an orbit of config/orbits, or a path to its YAML")
    ticks: Annotated[int, Field(ge=0, le=MOST_TICKS)] = Field(
        0, description="ticks to fly, then exit (0: until stopped)"
    )
    realtime: bool = Field(
        False, description="step by the wall clock, without waiting for commands (false: lockstep)"
    )
    paused: bool = Field(
        False, description="start paused at tick 0, until a call of ~/resume or ~/step"
    )
    reset_with: Texts = Field(
        [""],
        description="names of the nodes that are reset with the plant (service ~/reset), in the "
        "order in which they are activated",
    )
    clock_decimation: Annotated[int, Field(ge=1, le=10**6)] = Field(
        20, description="ticks between two messages on /clock"
    )
    hold_ticks: Annotated[int, Field(ge=0, le=10**6)] = Field(
        200, description="ticks for which the last valid command is held; then the torque is zero"
    )
    silence_timeout: Annotated[float, Field(ge=0.0, le=1e6)] = Field(
        3.0,
        description="longest time that a tick waits for its command in lockstep, s of the wall "
        "clock (0: no limit)",
    )
    own_controller: bool = Field(
        False,
        description="the controller is a node that others start: wait for it, and end with an "
        "error when it is silent for silence_timeout (false: fly on without commands)",
    )
    join_timeout: Annotated[float, Field(ge=0.0, le=1e6)] = Field(
        0.0,
        description="longest wait for a controller's first command, s of the wall clock "
        "(0: no limit)",
    )
    base_topics_rate: Annotated[float, Field(ge=0.0, le=1e6)] = Field(
        100.0,
        description="messages per simulated second on each of base/odometry, base/imu and "
        "base/wrench that has a subscriber (0: none)",
    )
    wait_for: Texts = Field(
        [""],
        description="subscribers to wait for before the first tick: NODE:TOPIC, or NODE for all "
        "topics",
    )

    @property
    def events_folder(self) -> Path:
        """The folder of the mission's file, or the current folder."""
        return next((file.parent for file in mission_layers(self.robot, self.mission)), Path())

    @classmethod
    def layers(cls, selected: Mapping[str, str]) -> list[Path]:
        """Add mission (where the arm starts), case (what disturbs it), hardware and orbit."""
        return [
            *super().layers(selected),
            *mission_layers(selected["robot"], selected["mission"]),
            *named_layers("cases", selected["case"]),
            *named_layers("sensors", selected["sensors"]),
            *named_layers("actuators", selected["actuators"]),
            *orbit_layers(selected["orbit"]),
        ]

    @classmethod
    def resolve(cls, overrides: Mapping[str, Any]) -> Self:
        """Read the settings as `NodeSettings.resolve`; those of a table of disturbances, too.

        Raises:
            InputError: also if something is set that needs an orbit, without one.
        """
        settings = super().resolve(overrides)
        settings.check_orbit(f"{cls.node} parameters")
        return settings.with_table(table_text(settings.disturbance.table))

    def with_table(self, text: str) -> Self:
        """Return the same settings with another table of disturbances, see `DisturbanceTable`."""
        if text == self.disturbance.table:
            return self
        disturbance = self.disturbance.model_copy(update={"table": text})
        return self.model_copy(update={"disturbance": disturbance})

    @classmethod
    def read_layer(cls, path: Path, selected: Mapping[str, str]) -> Tree:
        """Read a parameter file, a mission's document, or a trajectory.

        Raises:
            InputError: the file cannot be read, or a key in it is wrong.
        """
        layer = mission_layer(path, cls.node, selected["robot"])
        disturbance = layer.get("disturbance")
        if isinstance(disturbance, dict) and isinstance(text := disturbance.get("table"), str):
            layer["disturbance"] = {**disturbance, "table": table_text(text, path.parent)}
        return layer
