"""The variables of a campaign's file."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

from space_robot_msgs_py.config.validation import one_of, short
from space_robot_msgs_py.errors import InputError

from ..study import Study
from .changes import Nominal
from .fault_variables import fault_variables
from .names import parts_of
from .robot_variables import InertiaScale, robot_variables
from .setting_variables import gain_variables, node_variables, option_variables
from .variable import Variable

FAULTS = "faults"
NODES = ("plant", "controller", "mission")
GROUPS = ("robot", "scenario", *NODES, "gains", FAULTS)


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
