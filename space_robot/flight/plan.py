"""The flight that options make, checked before anything starts."""

from __future__ import annotations

import math
from functools import cached_property
from typing import Any

from space_robot_control.allocation.assumed_actuators import assumed_actuators
from space_robot_control.controller.controller import Controller
from space_robot_control.controller.gains import build_laws
from space_robot_control.controller.plain_laws import NoLaw
from space_robot_control.controller.settings import DEFAULT
from space_robot_control.controller.swaps import parse_swaps
from space_robot_control.guidance.mission import Mission
from space_robot_control.laws import ControlLaw
from space_robot_model.hardware.base_actuators import BaseActuatorSettings
from space_robot_model.robot.find import robot_files
from space_robot_msgs_py.config.files import GIVEN
from space_robot_msgs_py.config.validation import one_of, validate
from space_robot_msgs_py.errors import InputError
from space_robot_sim.environment.friction import coefficients
from space_robot_sim.faults.grammar import parse_faults
from space_robot_sim.plant.description import actuators, plant_description
from space_robot_sim.plant.faults import PLANT_KINDS
from space_robot_sim.plant.plant import Plant
from space_robot_sim.plant.settings import MOST_TICKS

from ..processes.software import commit, versions
from ..scenario.faults import KINDS, PROCESS_KINDS
from ..scenario.node_settings import FlightSettings
from ..scenario.objects import resolve_law
from ..scenario.options import NO_FRICTION, FlightPlan
from ..scenario.resolved import ROBOTS, resolved_options
from ..scenario.robots import Robots
from .start_step import start_step

__all__ = ["NO_FRICTION", "Flight", "FlightPlan"]


class Flight:
    """A checked plan: the settings of every node and the objects they make.

    The settings count, not the options of the ``plan``: single parameters come over them.

    Raises:
        InputError: anything the plan names does not exist or does not fit together.
    """

    def __init__(self, plan: FlightPlan) -> None:
        self.plan = plan
        settings = FlightSettings.resolve(plan.options(), plan.parameters)
        self.plant_settings = settings.plant
        self.controller_settings = settings.controller
        self.mission_settings = settings.mission
        self.recorder_settings = settings.recorder
        self.has_chosen_gains = settings.controller.gains != DEFAULT or bool(settings.gains)
        """True unless the gains are the default set's."""
        self.period = settings.plant.period
        self.timebase = settings.plant.timebase
        self._robots = Robots(settings, plan.robot, plan.plant_robot)
        self.robot = self._robots.plant
        mission = settings.mission
        self._mission_name = mission.mission or robot_files(mission.robot).name
        axes = self.robot.n + 3
        laws: dict[str, ControlLaw] = {NoLaw.name: NoLaw({}, self.period, axes)}
        if plan.controller is not None:
            own = resolve_law(plan.controller)
            laws = build_laws(settings.controller, axes, settings.gains, own or "")
        self.swaps = [
            (tick, laws[one_of(name, laws, "controller", " of swaps")])
            for tick, name in parse_swaps(settings.controller.swaps, self.period)
        ]
        """Ticks and the laws in force from there on."""
        self.parameters = settings.parameters(laws)
        """The parameters of every node over its files, by dotted name."""
        self.orchestrator_faults = parse_faults(plan.faults_of(PROCESS_KINDS), KINDS)
        self._check_composed()
        self.laws = laws
        """All that the gain set covers, by name: the first is in force at the start."""
        self.law = next(iter(laws.values()))
        """In force at the start."""
        self.plant = Plant(self.robot, settings.plant, self.period)
        self.mission = Mission(self.robot, settings.mission, self.period)
        self.assumed_actuators = self._assumed_actuators()
        """The base's actuators as the controller knows them."""
        self._check_actuators()
        self.controller = self.build_controller(self.law)
        self.ticks = self._ticks()

    def _assumed_actuators(self) -> BaseActuatorSettings:
        name, robot = self.controller_settings.actuators, self._robots.controller
        if self.plan.assumed_actuators is not None:
            own = self.plan.assumed_actuators
            assumed = validate(BaseActuatorSettings, own, "assumed_actuators")
            assumed.check(robot, GIVEN)
            return assumed
        if name != GIVEN:
            return assumed_actuators(name, robot)
        numbers = self.plan.actuators if isinstance(self.plan.actuators, dict) else {}
        own = {key: numbers[key] for key in BaseActuatorSettings.model_fields if key in numbers}
        actuators = validate(BaseActuatorSettings, own, "actuators")
        actuators.check(robot, GIVEN)
        return actuators

    def build_controller(self, law: ControlLaw) -> Controller:
        """Build a controller that remembers nothing, with ``law`` in force."""
        settings = self.controller_settings
        return Controller(
            self._robots.controller,
            law,
            self.period,
            settings.acceleration_filter_hz,
            settings.filter_settings,
            self.assumed_actuators,
            settings.allocation,
        )

    def _ticks(self) -> int:
        duration = self.mission.duration if self.plan.duration is None else self.plan.duration
        if duration <= 0.0:
            raise InputError("the mission has a single waypoint: give a duration")
        ticks = max(1, math.floor(duration / self.period + 1e-6))
        if ticks > MOST_TICKS:
            raise InputError(
                f"duration must be at most {MOST_TICKS * self.period:g} s "
                f"({MOST_TICKS} ticks of {self.period:g} s), got {duration:g} s"
            )
        return ticks

    def _check_composed(self) -> None:
        if not self.plan.composed:
            return
        asked = [f"fault {fault}" for fault in self.plan.faults_of(PROCESS_KINDS)]
        if self.plan.restart_controller:
            asked.append("restart_controller")
        if asked:
            raise InputError(
                f"{', '.join(asked)}: that needs a process for each node: fly without --composed"
            )

    @property
    def controls_base(self) -> bool:
        """True if anything turns the base; else it floats freely."""
        return self.plant_settings.controls_base

    def _check_actuators(self) -> None:
        flown, assumed = self.plant_settings, self.assumed_actuators
        both = [(s.base_actuation, s.wheel_count, s.thruster_count) for s in (flown, assumed)]
        if both[0] != both[1]:
            said = "; ".join(
                f"{node} {actuation}, {wheels} wheels, {thrusters} thrusters"
                for node, (actuation, wheels, thrusters) in zip(
                    ("plant", "controller"), both, strict=True
                )
            )
            raise InputError(f"plant and controller must have the same actuators, got {said}")

    def check_in_process(self) -> None:
        """See that the flight does without a graph of nodes.

        Raises:
            InputError: it asks for something that only nodes have.
        """
        if self.orchestrator_faults:
            asked = f"faults {[str(fault) for fault in self.orchestrator_faults]}"
        elif self.plant_settings.realtime:
            asked = "realtime"
        elif self.plant_settings.paused:
            asked = "paused"
        elif self.plant_settings.fifo_priority or self.controller_settings.fifo_priority:
            asked = "fifo_priority"
        else:
            return
        raise InputError(f"{asked}: that needs the graph of nodes: use `fly`")

    @property
    def faults(self) -> list[str]:
        """The texts of all faults."""
        in_plant = [text for text in self.plant_settings.faults if text.strip()]
        if in_plant == self.plan.faults_of(PLANT_KINDS):
            return self.plan.faults
        return [*in_plant, *self.plan.faults_of(PROCESS_KINDS)]

    @property
    def has_friction(self) -> bool:
        """True if the joints have friction."""
        return bool(coefficients(self.robot, self.plant_settings.friction).any())

    @property
    def gains_used(self) -> dict[str, list[float]]:
        """The numbers of the gains of the law in force at the start, an axis each."""
        return {name: row.tolist() for name, row in self.law.gain_values.items()}

    @property
    def _navigation(self) -> dict[str, Any]:
        """The numbers of the navigation filter, whichever file or option they are of."""
        settings = self.controller_settings.filter_settings
        if settings is None:
            return {}
        return {"navigation": "filtered", "navigation_filter": settings.model_dump()}

    @property
    def _base_actuators(self) -> dict[str, Any]:
        """The numbers of the base's actuators that the controller believes, if they are others."""
        assumed = actuators(self.assumed_actuators)
        if self.plant_settings.base_actuation == "ideal":
            return {}
        is_same = assumed == actuators(self.plant_settings)
        return {} if is_same else {"controller_base_actuators": assumed}

    @cached_property
    def start_step(self) -> dict[str, Any] | None:
        """What a start away from the mission's asks of the law; None: nothing worth a remark.

        See `space_robot.flight.start_step.StartStep`.
        """
        step = start_step(
            self.robot,
            self.plant_settings,
            self.mission,
            self.law,
            self.build_controller,
            self.period,
            self.ticks,
        )
        return step and step._asdict()

    @cached_property
    def resolved(self) -> dict[str, Any]:
        """The options of this flight with every number, and no file left to read."""
        return resolved_options(
            self.plan,
            FlightSettings(
                self.plant_settings,
                self.controller_settings,
                self.mission_settings,
                self.recorder_settings,
                {},
                {},
            ),
            self._robots,
            self.laws,
            self.assumed_actuators,
            self.ticks,
            self.faults,
        )

    @property
    def description(self) -> dict[str, Any]:
        """The flight as a bag tells it; enough to fly it again.

        The same plan with the same software gives the same one: it tells no time and no machine.
        """
        controller, robots = self.controller_settings, self._robots.description
        plant = plant_description(self.robot, robots["robot_file"], self.plant, self.plant_settings)
        swaps = [text for text in controller.swaps if text.strip()]
        return {
            "controller": self.law.name,
            **plant,
            **self._base_actuators,
            "gains": controller.gains,
            "mission": self._mission_name,
            "ticks": self.ticks,
            **self._navigation,
            **({"faults": self.faults} if self.faults else {}),
            **({"swaps": swaps} if swaps else {}),
            **({"restart_controller": True} if self.plan.restart_controller else {}),
            "parameters": self.parameters,
            "scenario": {k: v for k, v in self.resolved.items() if k not in ROBOTS},
            "gains_used": self.gains_used,
            **({"start_step": self.start_step} if self.start_step else {}),
            **robots,
            "versions": versions(),
            "commit": commit(),
        }
