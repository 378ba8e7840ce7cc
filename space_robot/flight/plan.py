"""A flight: the plant, the controller and the mission of a resolved scenario."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from functools import cached_property
from typing import Any

from space_robot_control.controller.controller import Controller
from space_robot_control.controller.law_choice import NoLaw
from space_robot_control.controller.supervisor import Supervisor
from space_robot_control.flight_code.supervisors import make_supervisor
from space_robot_control.laws import ControlLaw
from space_robot_msgs_py.errors import InputError
from space_robot_sim.plant.plant import Plant

from ..processes.software import commit, versions
from ..scenario.resolve import resolve
from ..scenario.resolved import ResolvedScenario
from ..scenario.scenario import NO_FRICTION, Scenario
from .mission_demand import check_mission_demand, held_base_remark
from .start_step import sentence, start_step

__all__ = ["NO_FRICTION", "Flight", "Scenario", "resolve"]


class Flight:
    """Plant, controller and mission built from a scenario alone."""

    def __init__(self, scenario: ResolvedScenario) -> None:
        """Build the plant, the mission and the controller."""
        scenario.reference.check_until(scenario.ticks * scenario.plant.period)
        check_mission_demand(scenario)
        self.scenario = scenario
        self.plant_settings = scenario.plant
        self.controller_settings = scenario.controller
        self.mission_settings = scenario.mission
        self.period = scenario.plant.period
        self.timebase = scenario.plant.timebase
        self.robot = scenario.robots.plant
        """Robot of the plant."""
        self.laws, self.swaps = scenario.laws, scenario.swaps
        self.law = scenario.law
        """Law in force at the start."""
        self.plant = Plant(self.robot, scenario.plant, self.period)
        self.mission = scenario.reference
        self.controller = self.build_controller(self.law)
        self.ticks = scenario.ticks

    def build_controller(self, law: ControlLaw) -> Controller:
        """Build a controller without memory, with ``law`` in force."""
        robot, actuators = self.scenario.robots.controller, self.scenario.assumed_actuators
        return Controller.from_settings(robot, law, self.controller_settings, actuators)

    def stretches(self, longest: int) -> Iterator[tuple[int, int]]:
        """Yield first tick and end of stretches of at most ``longest`` ticks without a swap."""
        swaps = (tick for tick, _ in self.swaps if tick < self.ticks)
        return itertools.pairwise(sorted({*range(0, self.ticks, longest), *swaps, self.ticks}))

    @property
    def controls_base(self) -> bool:
        """True if the base has actuators; else it floats freely."""
        return self.plant_settings.controls_base

    @property
    def controller_name(self) -> str:
        """Name of the law in force at the start, or of a controller that is not this project's."""
        return "own_controller" if "controller" in self.scenario.options.without else self.law.name

    @property
    def flies_by_messages(self) -> bool:
        """True if the controller has to answer as a node does, state by state."""
        is_plain = self.controller_settings.answers_in_python
        return self.plant_settings.has_message_faults or not is_plain

    @cached_property
    def supervisor(self) -> Supervisor:
        """What answers the states, where the controller has to answer as a node does.

        The flight code in C is compiled, or the flight computer greeted, at the first request.
        """
        return make_supervisor(self.controller, self.laws.values(), self.controller_settings)

    def check_in_process(self) -> None:
        """Check that the flight can run in one process: no option needs a graph of nodes."""
        plant, faults = self.plant_settings, self.scenario.process_faults
        asked = [f"faults {[str(fault) for fault in faults]}"] if faults else []
        asked += self.scenario.options.graph_options
        asked += [name for name in ("realtime", "paused", "fifo_priority") if getattr(plant, name)]
        asked += ["fifo_priority"] if self.controller_settings.fifo_priority else []
        if asked:
            raise InputError(f"{asked[0]}: that needs the graph of nodes: use `fly`")

    @cached_property
    def start_step(self) -> dict[str, Any] | None:
        """`StartStep` of a start away from the mission's; None: small, or no law flies."""
        if self.law.name == NoLaw.name:
            return None
        step = start_step(self.robot, self.plant_settings, self.mission)
        return step and step._asdict()

    @property
    def remarks(self) -> list[str]:
        """What a user should know of start and base before the flight, a sentence each."""
        step = self.start_step
        remarks = [sentence(step) if step else "", held_base_remark(self.scenario)]
        return [remark for remark in remarks if remark]

    @property
    def brief(self) -> dict[str, Any]:
        """What metrics and reports need of `description`; a hundred times faster."""
        if self.mission.leads_tool:  # its path is in the scenario
            return self.description
        return self.scenario.brief(self.plant, {}) | self._beginning

    @property
    def _beginning(self) -> dict[str, Any]:
        return {"start_step": self.start_step} if self.start_step else {}

    @property
    def description(self) -> dict[str, Any]:
        """Description of the flight for its bag, sufficient to repeat it on any machine."""
        return {
            **self.scenario.description(self.plant),
            **self._beginning,
            "versions": versions(),
            "commit": commit(),
        }
