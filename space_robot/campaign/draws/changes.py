"""Nominal flight of a law, and the changes of a run."""

from __future__ import annotations

from typing import Any, NamedTuple

from typing_extensions import Self

from space_robot_model.robot import Robot
from space_robot_msgs_py.config.trees import flatten
from space_robot_msgs_py.samples import RobotNames

from ...api import Scenario
from ...scenario.node_settings import NODES
from .robot_arrays import RobotArrays


class Nominal(NamedTuple):
    """Nominal flight of a law, without variations."""

    scenario: Scenario
    robot: Robot
    names: RobotNames
    """Names of axes, wheels and thrusters."""
    parameters: dict[str, dict[str, Any]]
    """All parameters by node and dotted name."""
    law: str
    gains: dict[str, list[float]]
    """Gains of the law that is active at the start."""

    @classmethod
    def of(cls, scenario: Scenario) -> Self:
        """Resolve robot, parameters and gains of a scenario.

        Raises:
            InputError: it cannot be flown.
        """
        flight = scenario.check()
        settings = {node: getattr(flight.scenario, node) for node in NODES}
        return cls(
            scenario,
            flight.robot,
            flight.plant.names,
            {node: dict(flatten(own.model_dump())) for node, own in settings.items()},
            flight.law.name,
            flight.scenario.gains_used,
        )


class Changes:
    """Changes of one run, accumulated over the variables."""

    def __init__(self, nominal: Nominal) -> None:
        self.nominal = nominal
        self.options: dict[str, Any] = {}
        self.faults: list[str] = []
        self._parameters: dict[str, dict[str, Any]] = {}
        self._robot: RobotArrays | None = None

    def on(self, nominal: Nominal) -> Changes:
        """Return changes of the same options for another nominal flight."""
        changes = Changes(nominal)
        changes.options = self.options
        return changes

    @property
    def robot(self) -> RobotArrays:
        """The plant's robot; callers may change it."""
        if self._robot is None:
            self._robot = RobotArrays(self.nominal.robot)
        return self._robot

    def parameter(self, node: str, name: str) -> Any:
        """Return the present value of a node's parameter; callers may change a list."""
        changed = self._parameters.setdefault(node, {})
        if name not in changed:
            value = self.nominal.parameters[node][name]
            changed[name] = list(value) if isinstance(value, list) else value
        return changed[name]

    def set_parameter(self, node: str, name: str, value: Any) -> None:
        """Change a node's parameter."""
        self._parameters.setdefault(node, {})[name] = value

    def gain(self, name: str) -> list[float]:
        """Return a gain of the law, one number per axis; callers may change it."""
        key = f"{self.nominal.law}.{name}"
        own = self._parameters.setdefault("controller", {})
        if key not in own:
            own[key] = list(self.nominal.gains[name])
        gain: list[float] = own[key]
        return gain

    def scenario(self, **options: Any) -> Scenario:
        """Return the flight with these changes and further options."""
        options_written = self.nominal.scenario.given
        merged = {**options_written, **self.options, **options}
        if self._robot is not None:
            merged["plant_robot"] = self._robot.robot()
        if self.faults:
            merged["faults"] = [*options_written.get("faults", ()), *self.faults]
        if self._parameters:
            own = options_written.get("parameters", {})
            merged["parameters"] = {
                node: {**own.get(node, {}), **self._parameters.get(node, {})}
                for node in {**own, **self._parameters}
            }
        return Scenario(**merged)
