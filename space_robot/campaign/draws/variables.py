"""The variables of a campaign's file."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Hashable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

from space_robot_msgs_py.config.validation import one_of, short
from space_robot_msgs_py.errors import InputError
from space_robot_msgs_py.samples import RobotNames
from space_robot_sim.faults.grammar import About, Kind, axes_of
from space_robot_sim.plant.faults import PLANT_KINDS

from ..study import Study
from .changes import Changes, Nominal
from .distributions import Value, read_distribution
from .names import parts_of
from .robot_variables import InertiaScale, robot_variables
from .setting_variables import gain_variables, node_variables, option_variables
from .variable import Variable

FAULTS = "faults"
NODES = ("plant", "controller", "mission")
GROUPS = ("robot", "scenario", *NODES, "gains", FAULTS)


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


def variables_of(study: Study, nominals: Sequence[Nominal]) -> list[Variable]:
    """Return all variables, in the file's order; ``*`` gives one variable per element.

    Args:
        study: the file.
        nominals: the nominal flight of each law.

    Raises:
        InputError: names the key of ``vary`` that is wrong.
    """
    variables: list[Variable] = []
    for key, value in study.vary.items():
        where = f"{study.where}: vary.{key}"
        if key == FAULTS:
            variables += _faults(value, where, nominals[0])
            continue
        with told_at(where):
            variables += _of_key(key, value, where, nominals)
    _check_places(study, variables)
    return variables


@contextmanager
def told_at(where: str) -> Iterator[None]:
    """Prefix errors with file and key."""
    try:
        yield
    except InputError as error:
        text = str(error)
        raise InputError(text if text.startswith(where) else f"{where}: {text}") from None


def _of_key(key: str, value: Any, where: str, nominals: Sequence[Nominal]) -> Sequence[Variable]:
    parts = parts_of(key)
    group = one_of(parts[0].word, GROUPS, "group")
    if parts[0].element or group == FAULTS:
        raise InputError(f"{group} has no elements")
    nominal, inner = nominals[0], parts[1:]
    if not inner:
        raise InputError(f"a name was expected, as in {group}.NAME")
    if group == "robot":
        return robot_variables(key, inner, value, where, nominal.robot)
    if group == "scenario":
        return option_variables(key, inner, value, where, nominal)
    if group == "gains":
        return gain_variables(key, inner, value, where, nominals)
    return node_variables(key, inner, value, where, nominal, group)


def _faults(value: Any, where: str, nominal: Nominal) -> list[Variable]:
    if not isinstance(value, dict):
        raise InputError(f"{where}: a mapping of faults was expected, got {short(value)}")
    faults: list[Variable] = []
    for text, distribution in value.items():
        own = f"{where}.{text}"
        with told_at(own):
            faults += fault_variables(str(text), distribution, own, nominal.names)
    return faults


def _check_places(study: Study, variables: Sequence[Variable]) -> None:
    for what, count in Counter(variable.place for variable in variables).items():
        if count > 1:
            twice = [variable for variable in variables if variable.place == what]
            raise InputError(
                f"{study.where}: vary.{twice[1].key}: {twice[1].name} is varied by "
                f"{twice[0].key} already"
            )
    whole = {(v.place) for v in variables if isinstance(v, InertiaScale)}
    for variable in variables:
        if isinstance(variable.place, tuple) and variable.place[:2] in whole - {variable.place}:
            raise InputError(
                f"{study.where}: vary.{variable.key}: {variable.name} is part of an inertia that "
                "is varied as a whole"
            )
    if any(v.key.startswith("robot.") for v in variables):
        for variable in variables:
            if variable.name == "scenario.robot":
                raise InputError(
                    f"{study.where}: vary.scenario.robot: cannot be varied together with robot.*"
                )
