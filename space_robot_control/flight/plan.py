"""What is to be flown, checked before anything starts."""

from __future__ import annotations

import math
from datetime import datetime, timezone
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Annotated, Any

from pydantic import ByteSize, Field

from space_robot_msgs_py.bag.mcap_file import Compression
from space_robot_msgs_py.configuration import named_file
from space_robot_msgs_py.errors import InputError
from space_robot_msgs_py.fault import KINDS, parse_faults
from space_robot_msgs_py.recorder_settings import RecorderNodeSettings
from space_robot_msgs_py.validation import Strict, read_yaml
from space_robot_sim.faults import PlantFaults
from space_robot_sim.plant import Plant
from space_robot_sim.plant_settings import PlantNodeSettings
from space_robot_sim.robot import Robot

from ..controller import Controller
from ..mission import Mission
from ..settings import ControllerNodeSettings, MissionNodeSettings, build_law
from ..software import commit, versions
from ..swaps import parse_swaps

NODES = tuple(
    settings.node
    for settings in (
        PlantNodeSettings, ControllerNodeSettings, MissionNodeSettings, RecorderNodeSettings,
    )
)  # fmt: skip


class FlightPlan(Strict):
    """The options of ``fly`` and ``simulate``."""

    controller: str = "tde_stc"
    case: str = "1"
    gains: str = "default"
    robot: str = "paper"
    mission: str = ""
    duration: Annotated[float | None, Field(gt=0.0, le=1e6)] = None
    command_latency_ticks: int = 0
    friction: bool = True
    realtime: bool = False
    fifo_priority: int = 0
    faults: list[str] = Field(default_factory=list)
    """What fails, each as ``KIND@T[-END][:ARGUMENT]``, see `space_robot_msgs_py.fault`."""
    seed: Annotated[int, Field(ge=0)] = 0
    """Of the faults' random numbers."""
    swaps: list[str] = Field(default_factory=list)
    """Laws to swap to in flight, each as ``T:LAW``."""
    restart_controller: bool = False
    """Whether a controller that died or hangs is started again."""
    domain: Annotated[int | None, Field(ge=0, le=232)] = None
    """ROS domain to fly in (None: ROS_DOMAIN_ID, or a free one)."""
    compression: Compression | None = None
    """Of the bag (None: the recorder's own)."""
    split_size: ByteSize | None = None
    """Bytes after which the bag goes on in another file (None: the recorder's own)."""
    parameters: dict[str, dict[str, Any]] = Field(default_factory=dict)
    """Further parameters by node, dotted names."""

    def faults_of(self, where: str) -> list[str]:
        """Those that ``where`` ("plant" or "orchestrator") brings about.

        Raises:
            InputError: a fault that cannot be.
        """
        return [str(f) for f in parse_faults(self.faults, KINDS) if KINDS[f.kind].where == where]

    def overrides(self, node: str) -> dict[str, Any]:
        """The parameters a node is given, by dotted name."""
        common: dict[str, Any] = {"robot": self.robot}
        specific: dict[str, dict[str, Any]] = {
            PlantNodeSettings.node: {
                "mission": self.mission,
                "case": self.case,
                "realtime": self.realtime,
                "command_latency_ticks": self.command_latency_ticks,
                "fifo_priority": self.fifo_priority,
                "faults": self.faults_of("plant") or [""],
                "fault_seed": self.seed,
                **({} if self.friction else {"friction.coulomb": 0.0, "friction.viscous": 0.0}),
            },
            ControllerNodeSettings.node: {
                "controller": self.controller,
                "gains": self.gains,
                "fifo_priority": self.fifo_priority,
                "swaps": self.swaps or [""],
                # by the wall clock there is no time to wait
                **({"reference_timeout": 0.0} if self.realtime else {}),
            },
            MissionNodeSettings.node: {"mission": self.mission},
            RecorderNodeSettings.node: {
                **({} if self.compression is None else {"compression": self.compression}),
                **({} if self.split_size is None else {"split_size": int(self.split_size)}),
            },
        }
        return {**common, **specific.get(node, {}), **self.parameters.get(node, {})}


class Flight:
    """A checked plan: the settings of every node and the objects they make.

    Raises:
        InputError: anything the plan names does not exist or does not fit together.
    """

    def __init__(self, plan: FlightPlan) -> None:
        self.plan = plan
        robot_file = named_file("robots", plan.robot)
        self._robot_content = read_yaml(robot_file)
        self.robot = Robot.from_dict(self._robot_content, where=str(robot_file))
        self.plant_settings = PlantNodeSettings.resolve(plan.overrides(PlantNodeSettings.node))
        self.controller_settings = ControllerNodeSettings.resolve(
            plan.overrides(ControllerNodeSettings.node)
        )
        self.mission_settings = MissionNodeSettings.resolve(
            plan.overrides(MissionNodeSettings.node)
        )
        self.recorder_settings = RecorderNodeSettings.resolve(
            plan.overrides(RecorderNodeSettings.node)
        )
        self.period = self.plant_settings.period
        self.timebase = self.plant_settings.timebase
        self.orchestrator_faults = parse_faults(plan.faults_of("orchestrator"), KINDS)
        self.plant, self.controller, self.mission = self._build()
        duration = self.mission.duration if plan.duration is None else plan.duration
        if duration <= 0.0:
            raise InputError("the mission has a single waypoint: give a duration")
        self.ticks = max(1, math.floor(duration / self.period + 1e-6))

    def _build(self) -> tuple[Plant, Controller, Mission]:
        plant = Plant(self.robot, self.plant_settings, self.period)
        PlantFaults(
            self.plant_settings.parsed_faults, self.plan.seed, self.robot, self.period
        )  # checks them before anything starts
        mission = Mission(self.robot.n, self.mission_settings, self.period)
        settings, axes = self.controller_settings, self.robot.n + 3
        law = build_law(self.plan.controller, settings, axes)
        self.swaps = [
            (swap.tick, build_law(swap.name, settings, axes))
            for swap in parse_swaps(settings.swaps, self.period)
        ]
        """Ticks and the laws in force from there on."""
        controller = Controller(self.robot, law, self.period, settings.acceleration_filter_hz)
        return plant, controller, mission

    @property
    def gains_used(self) -> dict[str, list[float]]:
        """The numbers of the law's gains, an axis each."""
        return {name: row.tolist() for name, row in self.controller.law.gains.items()}

    @property
    def description(self) -> dict[str, Any]:
        """What is flown, as it is stored in a bag; enough to fly it again.

        The same plan with the same software gives the same one: it tells no time and no machine.
        """
        plan = self.plan
        return {
            "controller": self.controller.law.name,
            "case": plan.case,
            "gains": plan.gains,
            "robot": self.robot.name,
            "mission": plan.mission or self.robot.name,
            "period": self.period,
            "ticks": self.ticks,
            "command_latency_ticks": self.plant_settings.command_latency_ticks,
            "friction": plan.friction,
            "realtime": plan.realtime,
            "seed": plan.seed,
            **({"faults": plan.faults} if plan.faults else {}),
            **({"swaps": plan.swaps} if plan.swaps else {}),
            **({"restart_controller": True} if plan.restart_controller else {}),
            "parameters": {node: plan.overrides(node) for node in NODES},
            "gains_used": self.gains_used,
            "robot_file": self._robot_content,
            "versions": versions(),
            "commit": commit(),
        }

    def default_bag(self) -> Path:
        """``flights/<controller>_case<case>_<time>`` below the current folder."""
        stamp = datetime.now(timezone.utc).strftime("%Y%m%d-%H%M%S")
        return (
            Path("flights") / f"{self.controller.law.name}_case{Path(self.plan.case).stem}_{stamp}"
        )


def check_bag_path(path: Path) -> None:
    """See that a bag can be made there, without making anything.

    Raises:
        InputError: it exists, or its nearest existing folder cannot be written.
    """
    if path.exists():
        raise InputError(f"{path}: exists already; a bag is never overwritten")
    parent = next(p for p in path.absolute().parents if p.exists())
    try:
        with TemporaryDirectory(dir=parent):
            pass
    except OSError as error:
        raise InputError(
            f"{path}: no bag can be written there ({parent}: {error.strerror})"
        ) from None
