"""Variables of settings: node parameters, gains, the mission's start, scenario options."""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from dataclasses import dataclass
from typing import Any

from space_robot_msgs_py.config.validation import one_of, short
from space_robot_msgs_py.errors import InputError

from ..study import check_option
from .changes import Changes, Nominal
from .distributions import Distribution, Value, read_distribution
from .names import ALL, NamePart, chosen
from .variable import Variable

START, START_PARAMETER = "start_deg", "initial_joints_deg"
BY_OPTION = (
    *("robot", "mission", "case", "sensors", "actuators", "orbit", "period", "controller"),
    "gains",
)
"""Parameters that select files or laws; scenario options set them."""


@dataclass(frozen=True)
class OfScenario(Variable):
    """An option of the scenario."""

    option: str

    @property
    def place(self) -> Hashable:
        """Return the key of the changed quantity."""
        return "scenario", self.option

    def apply(self, value: Value, changes: Changes) -> None:
        """Apply a value of the variable to a flight."""
        nominal = changes.nominal.scenario.given.get(self.option, 0.0)
        changes.options[self.option] = self.distribution.on(nominal, value)


@dataclass(frozen=True)
class OfNode(Variable):
    """A parameter of a node, or an element of one."""

    node: str
    parameter: str
    element: int | None = None

    @property
    def place(self) -> Hashable:
        """Return the key of the changed quantity."""
        return self.node, self.parameter, self.element

    @property
    def is_of_law(self) -> bool:
        """Return whether the variable changes the controller."""
        return self.node == "controller"

    def apply(self, value: Value, changes: Changes) -> None:
        """Apply a value of the variable to a flight."""
        nominal = changes.parameter(self.node, self.parameter)
        if self.element is None:
            number = self.distribution.on(nominal, value)
            changes.set_parameter(self.node, self.parameter, number)
        elif self.element < len(nominal):
            nominal[self.element] = self.distribution.on(nominal[self.element], value)
        else:
            raise InputError(f"{self.parameter} has {len(nominal)} elements here")


@dataclass(frozen=True)
class OfGains(Variable):
    """A gain on all axes or on one, for the laws that have it."""

    gain: str
    axis: int | None

    @property
    def place(self) -> Hashable:
        """Return the key of the changed quantity."""
        return "gains", self.gain, self.axis

    @property
    def is_of_law(self) -> bool:
        """Return whether the variable changes the controller."""
        return True

    def apply(self, value: Value, changes: Changes) -> None:
        """Apply a value of the variable to a flight."""
        if self.gain not in changes.nominal.gains:
            return
        values = changes.gain(self.gain)
        for axis in range(len(values)) if self.axis is None else (self.axis,):
            values[axis] = self.distribution.on(values[axis], value)


def option_variables(
    key: str, parts: list[NamePart], value: Any, where: str, nominal: Nominal
) -> list[Variable]:
    """Return the variable of ``scenario.<option>``.

    Raises:
        InputError: there is no such option, or it cannot be varied.
    """
    name = ".".join(part.word for part in parts)
    try:
        check_option(name)
    except ValueError as error:
        raise InputError(str(error)) from None
    if name == "gains":
        raise InputError("gain sets are chosen by laws: [LAW=SET, LAW=OTHER_SET]")
    if parts[-1].element or name in ("faults", "events", "swaps", "parameters"):
        raise InputError(f"the option {name} has no elements to vary; see faults, plant.*")
    distribution = read_distribution(value, where)
    has_number = type(nominal.scenario.given.get(name)) in (int, float)
    if (distribution.relative or distribution.offset) and not has_number:
        raise InputError(f"{where}: relative or offset, but scenario has no number {name}")
    return [OfScenario(f"scenario.{name}", key, distribution, name)]


def node_variables(
    key: str, parts: list[NamePart], content: Any, where: str, nominal: Nominal, node: str
) -> list[Variable]:
    """Return the variables of ``plant.*``, ``controller.*`` or ``mission.*``.

    Raises:
        InputError: there is no such parameter, or it cannot be varied.
    """
    name = ".".join(part.word for part in parts)
    if any(part.element for part in parts[:-1]):
        raise InputError("an element is allowed only at the end of the name")
    element = parts[-1].element if parts else ""
    distribution = read_distribution(content, where)
    if node == "mission" and name == START:
        names = nominal.robot.joint_names
        return [
            OfNode(
                f"mission.{START}[{joint}]",
                key,
                _numbers(distribution, where),
                "plant",
                START_PARAMETER,
                number,
            )
            for number, joint in chosen(element or ALL, names, "joint")
        ]
    if name in BY_OPTION:
        hint = "laws" if name in ("controller", "gains") else f"scenario.{name}"
        raise InputError(f"{name} applies to the whole flight: use {hint}")
    allowed = nominal.parameters[node]
    if name not in allowed:
        inner = [full for full in allowed if full.startswith(f"{name}.")]
        one_of(
            name,
            inner or [*allowed, *([START] if node == "mission" else [])],
            f"parameter of the {node}",
        )
    value = allowed[name]
    if not isinstance(value, list):
        if element:
            raise InputError(f"{name} has no elements, it is {short(value)}")
        if isinstance(value, (bool, str, type(None))) and (
            distribution.relative or distribution.offset
        ):
            raise InputError(f"{where}: relative or offset, but {name} is {short(value)}")
        return [OfNode(f"{node}.{name}", key, distribution, node, name)]
    if not element:
        one = f"{node}.{name}[1] to [{len(value)}] for one of them"
        raise InputError(f"{name} is a list: {node}.{name}[*] for all of it, or {one}")
    numbers = [str(number + 1) for number in range(len(value))]
    return [
        OfNode(f"{node}.{name}[{own}]", key, _numbers(distribution, where), node, name, number)
        for number, own in chosen(element, numbers, f"element of {name}")
    ]


def gain_variables(
    key: str, parts: list[NamePart], value: Any, where: str, nominals: Sequence[Nominal]
) -> list[Variable]:
    """Return the variables of ``gains.<gain>``: one for all axes, or one per axis.

    Raises:
        InputError: no law of the campaign has such a gain.
    """
    name = ".".join(part.word for part in parts)
    one_of(name, sorted({gain for own in nominals for gain in own.gains}), "gain", " of the laws")
    distribution = _numbers(read_distribution(value, where), where)
    if not (element := parts[-1].element):
        return [OfGains(f"gains.{name}", key, distribution, name, None)]
    return [
        OfGains(f"gains.{name}[{axis}]", key, distribution, name, number)
        for number, axis in chosen(element, nominals[0].names.axes, "axis")
    ]


def _numbers(distribution: Distribution, where: str) -> Distribution:
    if not distribution.is_number:
        raise InputError(f"{where}: numbers were expected")
    return distribution
