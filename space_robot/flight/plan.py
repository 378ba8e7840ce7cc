"""A flight: the plant, the controller and the mission of a resolved scenario."""

from __future__ import annotations

from functools import cached_property
from typing import Any

from space_robot_control.controller.controller import Controller
from space_robot_control.guidance.mission import Mission
from space_robot_control.laws import ControlLaw
from space_robot_msgs_py.errors import InputError
from space_robot_sim.plant.plant import Plant

from ..processes.software import commit, versions
from ..scenario.options import NO_FRICTION, FlightPlan
from ..scenario.resolve import resolve
from ..scenario.resolved import ResolvedScenario
from .start_step import start_step

__all__ = ["NO_FRICTION", "Flight", "FlightPlan", "resolve"]


class Flight:
    """The objects that fly a scenario; nothing but the scenario is read for them."""

    def __init__(self, scenario: ResolvedScenario) -> None:
        """Make the plant, the mission and the controller.

        Raises:
            InputError: the numbers do not fit together.
        """
        self.scenario = scenario
        self.plant_settings = scenario.plant
        self.controller_settings = scenario.controller
        self.mission_settings = scenario.mission
        self.period = scenario.plant.period
        self.timebase = scenario.plant.timebase
        self.robot = scenario.robots.plant
        """The plant's."""
        self.laws, self.swaps = scenario.laws, scenario.swaps
        self.law = scenario.law
        """In force at the start."""
        self.plant = Plant(self.robot, scenario.plant, self.period)
        self.mission = Mission(self.robot, scenario.mission, self.period)
        self.controller = self.build_controller(self.law)
        self.ticks = scenario.ticks

    def build_controller(self, law: ControlLaw) -> Controller:
        """Build a controller that remembers nothing, with ``law`` in force."""
        settings = self.controller_settings
        return Controller(
            self.scenario.robots.controller,
            law,
            self.period,
            settings.acceleration_filter_hz,
            settings.filter_settings,
            self.scenario.assumed_actuators,
            settings.allocation,
        )

    @property
    def controls_base(self) -> bool:
        """True if anything turns the base; else it floats freely."""
        return self.plant_settings.controls_base

    def check_in_process(self) -> None:
        """See that the flight does without a graph of nodes.

        Raises:
            InputError: it asks for something that only nodes have.
        """
        if self.scenario.process_faults:
            asked = f"faults {[str(fault) for fault in self.scenario.process_faults]}"
        elif self.plant_settings.realtime:
            asked = "realtime"
        elif self.plant_settings.paused:
            asked = "paused"
        elif self.plant_settings.fifo_priority or self.controller_settings.fifo_priority:
            asked = "fifo_priority"
        else:
            return
        raise InputError(f"{asked}: that needs the graph of nodes: use `fly`")

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

    @property
    def description(self) -> dict[str, Any]:
        """The flight as a bag tells it; enough to fly it again.

        The same plan with the same software gives the same one: it tells no time and no machine.
        """
        return {
            **self.scenario.description(self.plant),
            **({"start_step": self.start_step} if self.start_step else {}),
            "versions": versions(),
            "commit": commit(),
        }
