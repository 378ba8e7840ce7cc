"""The options of a flight: names and paths, or the objects themselves."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import AfterValidator, ByteSize, Field

from space_robot_control.navigation.settings import Mode
from space_robot_msgs_py.bag.mcap_file import Compression
from space_robot_msgs_py.config.namespace import full_namespace
from space_robot_msgs_py.config.validation import StrictModel
from space_robot_msgs_py.topics import ROOT
from space_robot_sim.faults.grammar import Kinds, parse_faults
from space_robot_sim.plant.faults import PLANT_KINDS

from .faults import KINDS
from .objects import (
    Actuators,
    Case,
    EventText,
    Gains,
    LawGiven,
    MissionGiven,
    RobotGiven,
    Sensors,
    gains_of,
    law_parameter,
    mission_of,
    numbers_of,
    resolve_law,
    robot_setting,
)

NO_FRICTION = {"friction.coulomb": 0.0, "friction.viscous": 0.0}


class FlightPlan(StrictModel):
    """The options of ``fly`` and ``simulate``."""

    controller: LawGiven = "tde_stc"
    """Its name, file.py:Class or module:Class; a `ControlLaw` class or object; a function, see
    `space_robot_control.controller.plain_laws`; None: none, on the bench."""
    case: Case = "1"
    gains: Gains = "default"
    """Name or path of the set; or numbers by gain (or by law, then gain), over the default set."""
    sensors: Sensors = "ideal"
    actuators: Actuators = "ideal"
    """Of the base."""
    robot: RobotGiven = "paper"
    plant_robot: RobotGiven | None = None
    """What the plant is in truth; controller and mission know ``robot`` (None: that it is)."""
    mission: MissionGiven = ""
    """Empty: the robot's own."""
    duration: Annotated[float | None, Field(gt=0.0, le=1e6)] = None
    period: float | None = None
    """Length of a tick of every node, s (None: that of the files)."""
    substeps: int | None = None
    """Integration steps of the plant in a tick (None: that of the files)."""
    navigation: Mode | None = None
    """What the laws see (None: what the files say)."""
    command_latency_ticks: int = 0
    friction: bool = True
    realtime: bool = False
    paused: bool = False
    """Begin paused, until a service call lets the plant go on."""
    fifo_priority: int = 0
    faults: list[str] = Field(default_factory=list)
    """The faults, each as ``KIND@T[-END][:ARGUMENT]``, see `space_robot.scenario.faults`."""
    events: list[EventText] = Field(default_factory=list)
    """What is captured and released, see `space_robot_sim.environment.events`; none: what the
    mission says."""
    seed: Annotated[int, Field(ge=0)] = 0
    """Seed of the random numbers of faults and sensors."""
    swaps: list[str] = Field(default_factory=list)
    """Laws to swap to in flight, each as ``T:LAW``."""
    restart_controller: bool = False
    """Start a controller again that died or hangs."""
    composed: bool = False
    """Put all nodes into one process, stepped in turn."""
    domain: Annotated[int | None, Field(ge=0, le=232)] = None
    """ROS domain to fly in (None: ROS_DOMAIN_ID, or a free one)."""
    namespace: Annotated[str, AfterValidator(full_namespace)] = ROOT
    """ROS namespace of the nodes and their topics."""
    compression: Compression | None = None
    """Compression of the bag (None: the recorder's own)."""
    split_size: ByteSize | None = None
    """Bytes after which the bag goes on in another file (None: the recorder's own)."""
    parameters: dict[str, dict[str, Any]] = Field(default_factory=dict)
    """Further parameters by node, dotted names."""

    def faults_of(self, kinds: Kinds) -> list[str]:
        """Return the texts of the faults that are of some ``kinds``.

        Raises:
            InputError: a fault that cannot be.
        """
        return [str(f) for f in parse_faults(self.faults, KINDS) if f.kind.name in kinds]

    def options(self) -> dict[str, dict[str, Any]]:
        """Return what the options, without ``parameters``, say to each node, by dotted name."""
        robot = robot_setting(self.robot)
        mission, waypoints, start = mission_of(self.mission)
        (case, world), (sensors, errors), (actuators, hardware) = (
            numbers_of(value) for value in (self.case, self.sensors, self.actuators)
        )
        law = resolve_law(self.controller)
        gains, values = gains_of(self.gains, law)
        period = {} if self.period is None else {"period": self.period}
        return {
            "plant": {
                **period,
                **({} if self.substeps is None else {"substeps": self.substeps}),
                "robot": robot,
                "mission": mission,
                "case": case,
                "sensors": sensors,
                "actuators": actuators,
                **start,
                **world,
                **errors,
                **hardware,
                "realtime": self.realtime,
                **({"paused": True} if self.paused else {}),
                "command_latency_ticks": self.command_latency_ticks,
                "fifo_priority": self.fifo_priority,
                "faults": self.faults_of(PLANT_KINDS),
                "fault_seed": self.seed,
                **({"events": self.events} if self.events else {}),
                **({} if self.friction else NO_FRICTION),
            },
            "controller": {
                **period,
                "robot": robot,
                "controller": law_parameter(law),
                "gains": gains,
                **values,
                "fifo_priority": self.fifo_priority,
                "swaps": self.swaps,
                **({} if self.navigation is None else {"navigation": self.navigation}),
            },
            "mission": {**period, "robot": robot, "mission": mission, **waypoints},
            "recorder": {
                **period,
                **({} if self.compression is None else {"compression": self.compression}),
                **({} if self.split_size is None else {"split_size": int(self.split_size)}),
            },
        }

    def with_parameters(self, node: str, values: dict[str, Any]) -> FlightPlan:
        """Return the same plan with further parameters of a node, by dotted name."""
        parameters = {**self.parameters, node: {**self.parameters.get(node, {}), **values}}
        return self.model_copy(update={"parameters": parameters})
