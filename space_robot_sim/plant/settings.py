"""Settings of the plant, of its faults, and of its node: how it is paced."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, ClassVar

from pydantic import AfterValidator, Field
from typing_extensions import Self

from space_robot_model.hardware.sensors import SensorSettings
from space_robot_model.robot import Robot
from space_robot_model.robot.find import mission_layers
from space_robot_model.robot.mission_document import Rates, mission_layer
from space_robot_msgs_py import topics
from space_robot_msgs_py.config.files import Tree, named_layers
from space_robot_msgs_py.config.settings import NodeSettings, Texts, WaitFor
from space_robot_msgs_py.config.validation import StrictModel
from space_robot_msgs_py.errors import InputError
from space_robot_msgs_py.samples import RobotNames

from ..actuators.actuators import Actuators, ActuatorSettings
from ..component import kinds_of
from ..environment.disturbance_table import table_text
from ..environment.environment import Environment, EnvironmentSettings
from ..environment.orbit import orbit_layers
from ..faults.grammar import Fault, by_name, parse_faults
from ..faults.messages import MESSAGE_KINDS
from ..faults.schedule import Schedule
from ..sensors.sensors import Sensors
from .mounting import MOST_SUBSTEPS

PLANT_KINDS = by_name(
    *MESSAGE_KINDS.values(),
    *(kind for record in (Sensors, Actuators, Environment) for kind in kinds_of(record)),
)
"""All kinds of faults caused by the plant."""


def _readable(texts: list[str]) -> list[str]:
    parse_faults(texts, PLANT_KINDS)
    return texts


class FaultSettings(StrictModel):
    """Settings of the faults of the plant."""

    faults: Annotated[Texts, AfterValidator(_readable)] = Field(
        [""], description="faults of the flight, each `KIND@T[-END][:ARGUMENT]`, see docs/manual"
    )
    fault_seed: Annotated[int, Field(ge=0, le=2**31 - 1)] = Field(
        0, description="seed of the random numbers of faults and sensors"
    )

    @property
    def parsed_faults(self) -> list[Fault]:
        """The faults, without the empty texts."""
        return parse_faults(self.faults, PLANT_KINDS)

    @property
    def has_message_faults(self) -> bool:
        """True if messages between plant and controller have faults."""
        return any(fault.kind.name in MESSAGE_KINDS for fault in self.parsed_faults)

    def schedule(self, names: RobotNames, period: float) -> Schedule:
        """Place the faults in ticks of ``period`` s, in a flight of a robot with these names."""
        return Schedule(self.parsed_faults, self.fault_seed, period, names)


class PlantSettings(ActuatorSettings, EnvironmentSettings, SensorSettings, FaultSettings):
    """Settings of the plant's world, beside the robot's own file."""

    initial_joints_deg: list[float] = Field(
        [0.0],
        description="positions of the actuated joints at tick 0, degrees (prismatic joints: m)",
    )
    initial_quaternion: Annotated[list[float], Field(min_length=4, max_length=4)] = Field(
        [1.0, 0.0, 0.0, 0.0], description="base attitude at tick 0: w, x, y, z"
    )
    initial_rate_deg_s: Rates = Field(
        [0.0, 0.0, 0.0],
        description="angular velocity of the base at tick 0, degrees/s, base axes; the robot turns "
        "as one body about its centre of mass, which is at rest",
    )
    substeps: Annotated[int, Field(ge=1, le=MOST_SUBSTEPS)] = Field(
        1, description="integration steps per tick; the command is held over all of them"
    )

    def check(self, robot: Robot, file: str) -> None:
        """Check the actuators and what they need, see `ActuatorSettings.check`."""
        super().check(robot, file)
        if self.torquer_count and not (self.has_orbit and self.magnetism.strength):
            raise InputError(
                f"actuators {file}: magnetic_torquers need an orbit with a magnetic field: "
                "--orbit NAME, with magnetism.strength above 0"
            )


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
    wait_for: WaitFor = Field([""])

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
        """Read the settings as `NodeSettings.resolve`, and the file of a table of disturbances."""
        settings = super().resolve(overrides)
        settings.check_orbit(f"{cls.node} parameters")
        # its numbers in place of its path: bags and nodes need no file
        table = settings.disturbance.table
        return settings.with_table(table_text(table)) if table else settings

    def with_table(self, text: str) -> Self:
        """Return the same settings with another table of disturbances, see `DisturbanceTable`."""
        if text == self.disturbance.table:
            return self
        disturbance = self.disturbance.model_copy(update={"table": text})
        return self.model_copy(update={"disturbance": disturbance})

    @classmethod
    def read_layer(cls, path: Path, selected: Mapping[str, str]) -> Tree:
        """Read a parameter file, a mission's document, or a trajectory."""
        layer = mission_layer(path, cls.node, selected["robot"])
        disturbance = layer.get("disturbance")
        if isinstance(disturbance, dict) and isinstance(text := disturbance.get("table"), str):
            layer["disturbance"] = {**disturbance, "table": table_text(text, path.parent)}
        return layer
