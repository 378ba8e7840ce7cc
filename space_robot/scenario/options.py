"""Options of a flight, as names, paths or objects."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import AfterValidator, ByteSize, Field

from space_robot_control.navigation.settings import NavigationMode
from space_robot_msgs_py.bag.writer import Compression
from space_robot_msgs_py.config.validation import StrictModel, full_namespace
from space_robot_msgs_py.errors import explained_by
from space_robot_sim.faults.grammar import Kinds, parse_faults
from space_robot_sim.plant.faults import PLANT_KINDS

from .disturbances import table_parameters
from .faults import KINDS
from .objects import (
    Actuators,
    AssumedActuators,
    Case,
    DisturbanceGiven,
    EventText,
    Gains,
    LawGiven,
    MissionGiven,
    OrbitGiven,
    RobotGiven,
    Sensors,
    gains_of,
    law_parameter,
    mission_of,
    numbers_of,
    resolve_law,
    robot_setting,
)
from .option_table import option

NO_FRICTION = {"friction.coulomb": 0.0, "friction.viscous": 0.0}


def of(name: str) -> Any:
    """Return the pydantic field of an option of the table."""
    entry = option(name)
    if entry.kind == "texts":
        return Field(default_factory=list, description=entry.help_text)
    return Field(**entry.field)


class FlightPlan(StrictModel):
    """The options of ``fly`` and ``simulate``."""

    controller: LawGiven = of("controller")
    """Unless it is set, that of the gain set's ``controller.yaml``, if there is one. Also a
    `ControlLaw` class or object; a function, see
    `space_robot_control.controller.law_choice`; None: none, on the bench."""
    case: Case = of("case")
    disturbance: DisturbanceGiven = of("disturbance")
    """A table's file; also its columns, numbers by name, or a function of time that is sampled at
    100 Hz, see `space_robot.scenario.disturbances.sampled`."""
    gains: Gains = of("gains")
    """Also numbers by gain (or by law, then gain), over the default set."""
    sensors: Sensors = of("sensors")
    actuators: Actuators = of("actuators")
    """Actuators of the base."""
    orbit: OrbitGiven = of("orbit")
    assumed_actuators: AssumedActuators | None = of("assumed_actuators")
    """Actuators that the flight software assumes (None: as in their file)."""
    robot: RobotGiven = of("robot")
    plant_robot: RobotGiven | None = of("plant_robot")
    """True robot of the plant; controller and mission know ``robot`` (None: the same)."""
    mission: MissionGiven = of("mission")
    duration: float | None = of("duration")
    period: float | None = of("period")
    substeps: int | None = of("substeps")
    navigation: NavigationMode | None = of("navigation")
    command_latency_ticks: int = of("command_latency_ticks")
    friction: bool = of("friction")
    realtime: bool = of("realtime")
    paused: bool = of("paused")
    fifo_priority: int = of("fifo_priority")
    faults: list[str] = of("faults")
    events: list[EventText] = of("events")
    seed: int = of("seed")
    swaps: list[str] = of("swaps")
    controller_code: str = of("controller_code")
    shadow: Literal["none", "c"] = of("shadow")
    restart_controller: bool = of("restart_controller")
    without: list[Literal["controller", "mission"]] = of("without")
    """Nodes that are not started: others' take their places."""
    join_timeout: float = of("join_timeout")
    composed: bool = of("composed")
    domain: int | None = of("domain")
    namespace: Annotated[str, AfterValidator(full_namespace)] = of("namespace")
    compression: Compression | None = of("compression")
    split_size: ByteSize | None = of("split_size")
    parameters: dict[str, dict[str, Any]] = Field(default_factory=dict)
    """Further parameters by node, dotted names."""

    @property
    def has_chosen_law(self) -> bool:
        """Whether the user set the law."""
        own = self.parameters.get("controller", {})
        return "controller" in self.model_fields_set or "controller" in own

    @explained_by("disturbances")
    def faults_of(self, kinds: Kinds) -> list[str]:
        """Return the texts of the faults of the given ``kinds``.

        Raises:
            InputError: a fault is invalid.
        """
        return [str(f) for f in parse_faults(self.faults, KINDS) if f.kind.name in kinds]

    def options(self) -> dict[str, dict[str, Any]]:
        """Return the parameters of each node set by the options, by dotted name."""
        robot = robot_setting(self.robot)
        mission, waypoints, start = mission_of(self.mission)
        (case, world), (sensors, errors), (actuators, hardware), (orbit, place) = (
            numbers_of(value) for value in (self.case, self.sensors, self.actuators, self.orbit)
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
                **({} if orbit == "none" else {"orbit": orbit}),
                **start,
                **world,
                **table_parameters(self.disturbance),
                **place,
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
                **({"controller": law_parameter(law)} if self.has_chosen_law else {}),
                "gains": gains,
                **values,
                "fifo_priority": self.fifo_priority,
                "swaps": self.swaps,
                **(
                    {}
                    if self.controller_code == "python"
                    else {"controller_code": self.controller_code}
                ),
                **({} if self.shadow == "none" else {"shadow": self.shadow}),
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
