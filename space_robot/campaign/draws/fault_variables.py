"""Variables of faults: a fault's text with a random number or time."""

from __future__ import annotations

import re
from collections.abc import Hashable
from dataclasses import dataclass
from typing import Any

from space_robot_msgs_py.config.validation import one_of, short
from space_robot_msgs_py.errors import InputError
from space_robot_msgs_py.samples import RobotNames
from space_robot_sim.faults.axes import About, axes_of
from space_robot_sim.faults.grammar import Kind
from space_robot_sim.plant.faults import PLANT_KINDS

from .changes import Changes
from .distributions import Value, read_distribution
from .variable import Variable

EACH = ":[*]"
"""End of a fault's text: one variable for each axis, wheel or thruster."""
_TIME = re.compile(r"(?<=@)T(?=$|:)")


@dataclass(frozen=True)
class OfFault(Variable):
    """A fault; ``{}`` in its text stands for the drawn number."""

    text: str

    @property
    def place(self) -> Hashable:
        """Return the key of the changed quantity."""
        return "fault", self.text

    def apply(self, value: Value, changes: Changes) -> None:
        """Apply a value of the variable to a flight."""
        changes.faults.append(self.text.replace("{}", _written(value)))


def fault_variables(key: str, value: Any, where: str, names: RobotNames) -> list[Variable]:
    """Return the variables of a fault.

    Args:
        key: the fault's text without its last number, or with ``T`` as its time.
        value: the distribution.
        where: file and key, for errors.
        names: of axes, wheels and thrusters.

    Raises:
        InputError: there is no such fault, or it has no number.
    """
    kind = PLANT_KINDS[
        one_of(key.partition("@")[0], PLANT_KINDS, "kind of fault", listing="--fault list")
    ]
    distribution = read_distribution(value, where)
    if distribution.relative or distribution.offset:
        raise InputError(f"{where}: a fault has no nominal value: relative and offset need one")
    if not distribution.is_number:
        raise InputError(f"{where}: numbers were expected")
    head, each, _ = key.partition(EACH)
    if not each:
        elements = [key]
    elif not kind.argument or not kind.argument.about or not key.endswith(EACH):
        raise InputError(f"{EACH} is allowed only at the end of a fault of axes or actuators")
    else:
        elements = [f"{head}:{name}" for name in _all(kind.argument.about, names)]
    return [
        OfFault(f"faults.{text}", f"faults.{key}", distribution, _template(text, kind))
        for text in elements
    ]


def _template(text: str, kind: Kind) -> str:
    if _TIME.search(text):
        return _TIME.sub("{}", text)
    if kind.argument is None or not kind.argument.symbol:
        raise InputError(f"{kind.name} has no number to draw; its time has: {kind.name}@T")
    if not kind.argument.about:
        if ":" in text:
            raise InputError(f"nothing may follow the colon: {short(text.partition(':')[0])}")
        return text + ":{}"
    _, colon, axis = text.partition(":")
    if not colon or not axis or "=" in axis:
        about = kind.argument.about.name
        raise InputError(f"the text up to its number was expected: {kind.name}@0:{about}")
    return text + "={}"


def _all(about: About, names: RobotNames) -> list[str]:
    match about:
        case About.WHEEL:
            return list(names.wheels)
        case About.THRUSTER:
            return list(names.thrusters)
        case About.AXIS:
            group = "all"
        case About.JOINT:
            group = "joints"
        case About.BASE_AXIS:
            group = "base"
    return [names.axes[number] for number in axes_of(group, about, names)]


def _written(value: Value) -> str:
    """Return a text that is read back as exactly the same number."""
    return repr(float(value)).removesuffix(".0")
