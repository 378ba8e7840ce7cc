"""Laws of a controller node, with their gains as parameters."""

from __future__ import annotations

from typing import Any

from rcl_interfaces.msg import ParameterDescriptor, SetParametersResult
from rclpy.parameter import Parameter

from space_robot_model.hardware.base_actuators import BaseActuatorSettings
from space_robot_model.robot import Robot
from space_robot_msgs_py.bag.law_history import LawChange
from space_robot_msgs_py.config.validation import one_of
from space_robot_msgs_py.errors import InputError, SpaceRobotError
from space_robot_msgs_py.ros.managed_node import ManagedNode
from space_robot_msgs_py.ros.parameters import overrides
from space_robot_msgs_py.samples import Reference, RobotState

from ..laws import ControlLaw
from ..laws.base import Array
from .controller import Controller
from .gains import NOMINAL, build_laws, check_gains, gain_lengths, gain_range, split_gains
from .law_choice import LawChoice
from .settings import ControllerNodeSettings
from .supervisor import Supervisor
from .swaps import parse_swaps


class LawSet:
    """The laws of the gain set as parameters: ``controller``, and ``<law>.<gain>`` for each."""

    def __init__(self, node: ManagedNode[Any], settings: ControllerNodeSettings, axes: int) -> None:
        """Build all laws and declare their gains.

        Raises:
            InputError: a law, a gain or a swap is invalid.
        """
        self._node, self._settings, self._axes = node, settings, axes
        _, gains = split_gains(overrides(node))
        self._laws = build_laws(settings, axes, gains)
        for law in self._laws.values():
            self._declare(law)
        swaps = [
            (tick, self._laws[one_of(name, self._laws, "controller", " of swaps")])
            for tick, name in parse_swaps(settings.swaps, settings.period)
        ]
        self.choice = LawChoice(next(iter(self._laws.values())), swaps)
        """The law in force."""
        descriptor = node.describe_parameter("controller")
        descriptor.additional_constraints = f"one of {', '.join(self._laws)}"
        node.set_descriptor("controller", descriptor)
        node.add_on_set_parameters_callback(self._on_set)

    def warm_up(self, robot: Robot, actuators: BaseActuatorSettings) -> None:
        """Load all compiled code, for all laws, so that first ticks and swaps are not late."""
        rest = RobotState.allocate(robot.n)
        for law in self._laws.values():
            controller = Controller(robot, law, self._settings.period, actuators=actuators)
            supervisor = Supervisor(controller, hold_ticks=0)
            supervisor.judge(rest.tick)
            supervisor.answer(rest, Reference.at_rest(robot.n))

    @property
    def laws(self) -> list[ControlLaw]:
        """All laws, that in force at the start first."""
        return list(self._laws.values())

    def tell(self, change: LawChange) -> None:
        """Log a change, and let the parameter ``controller`` follow a planned swap."""
        when = (
            f"from tick {change.law.tick} on (t = {change.law.tick * self._settings.period:.4f} s)"
        )
        self._node.log(f"controller: {change}, {when}")
        if self.choice.was_swapped:
            self.choice.was_swapped = False
            name = Parameter("controller", value=change.law.name)  # type: ignore[no-untyped-call]
            self._node.set_parameters([name])

    def close(self) -> None:
        """Stop accepting changes."""
        self._node.remove_on_set_parameters_callback(self._on_set)

    def _declare(self, law: ControlLaw) -> None:
        """Declare the gains of a law as parameters."""
        descriptions = law.gain_descriptions()
        for gain, values in law.gain_values.items():
            self._node.declare_parameter(
                f"{law.name}.{gain}",
                values.tolist(),
                ParameterDescriptor(
                    description=descriptions[gain],
                    additional_constraints=f"{gain_lengths(self._axes)}; {gain_range(gain)}",
                ),
                ignore_override=True,
            )

    def _on_set(self, parameters: list[Any]) -> SetParametersResult:
        """Check all changes first, then make them; the loop sees them at its next tick."""
        gains = {name: law.gain_values for name, law in self._laws.items()}
        chosen = self.choice.chosen
        try:
            for parameter in parameters:
                law_name, _, gain = parameter.name.partition(".")
                if parameter.name == "controller":
                    chosen = self._laws[one_of(parameter.value, self._laws, "controller")]
                elif law_name in gains and gain:
                    law = self._laws[law_name]
                    changed = {**gains[law_name], gain: list(parameter.value)}
                    gains[law_name] = check_gains(changed, type(law), self._axes, "parameter")
                    if gain == "h_bar":
                        _check_kind(law, gains[law_name]["h_bar"])
        except SpaceRobotError as error:
            return SetParametersResult(successful=False, reason=str(error))
        for name, law in self._laws.items():
            law.gain_values = gains[name]
        self.choice.choose(chosen)
        return SetParametersResult(successful=True)


def _check_kind(law: ControlLaw, h_bar: Array) -> None:
    """Check that a new h_bar is constant as the old one, or nominal as the old one.

    Raises:
        InputError: it is not; compiled code is that of one of the two.
    """
    if h_bar.any() != law.h_bar.any():
        before, after = ("a constant", NOMINAL) if law.h_bar.any() else (NOMINAL, "a constant")
        raise InputError(
            f"parameter {law.name}.h_bar cannot be changed from {before} to {after} in flight: "
            "start with that gain, or swap to another law"
        )
