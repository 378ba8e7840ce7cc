"""The variables of a campaign's file: paths, and the distributions of the numbers there."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Annotated, Any, NamedTuple

from pydantic import Field

from space_robot_msgs_py.config.files import Tree
from space_robot_msgs_py.config.validation import StrictModel, one_of, short, validate
from space_robot_msgs_py.errors import InputError
from space_robot_msgs_py.samples import RobotNames
from space_robot_sim.faults.grammar import About, Kind, axes_of
from space_robot_sim.plant.settings import PLANT_KINDS

from ..study import Study
from .distributions import Distribution, Normal, read_distribution
from .nominal import Nominal
from .paths import Path, matches, value_at
from .robot_numbers import LOG_FACTORS, ROTATIONS, is_always_consistent, least_factor

FAULTS = "faults"
MISSION_START = ("mission", "start_deg")
EACH_AXIS = ":[*]"
"""End of a fault's text: one variable for each axis, wheel or thruster."""
_TIME = re.compile(r"(?<=@)T(?=$|:)")


class Variable(NamedTuple):
    """A random number of a campaign, and the leaves of the scenario that it changes."""

    name: str
    """With the name of the element, such as ``robot.links[joint1].mass``."""
    key: str
    """Key of ``vary`` in the file."""
    distribution: Distribution
    paths: tuple[Path, ...]
    """Of a fault: ``faults`` and its text, in which ``{}`` stands for the number."""

    @property
    def group(self) -> str:
        """First key of its paths."""
        return self.paths[0][0]

    @property
    def is_always_consistent(self) -> bool:
        """True if every value can be flown."""
        return self.group == "robot" and is_always_consistent(self.paths[0][1:])


class InertiaSpread(StrictModel):
    """Entry ``{scale: 0.1, rotate_deg: 3}`` of an inertia."""

    scale: Annotated[float, Field(gt=0.0, le=1.0)] | None = None
    """Standard deviation of the logarithms of the second moments' factors."""
    rotate_deg: Annotated[float, Field(gt=0.0, le=30.0)] | None = None
    """Standard deviation of the rotation about each axis, degrees."""


@contextmanager
def errors_at(where: str) -> Iterator[None]:
    """Prefix errors with file and key."""
    try:
        yield
    except InputError as error:
        text = str(error)
        raise InputError(text if text.startswith(where) else f"{where}: {text}") from None


def read_variables(study: Study, nominals: Sequence[Nominal]) -> list[Variable]:
    """Return all variables, in the file's order, with the nominal flight of each law.

    ``[*]`` gives one variable for each element.
    """
    gains = {gain: own for nominal in nominals[::-1] for gain, own in nominal.tree["gains"].items()}
    tree = {**nominals[0].tree, "gains": gains, FAULTS: {}}
    variables: list[Variable] = []
    for key, value in study.vary.items():
        where = f"{study.where}: vary.{key}"
        with errors_at(where):
            if key == FAULTS:
                variables += _all_faults(value, where, nominals[0].names)
            else:
                variables += _variables(tree, key, value, where)
    _check_overlaps(study, variables)
    return variables


def _variables(tree: Tree, key: str, value: Any, where: str) -> Iterator[Variable]:
    is_spread = isinstance(value, dict) and bool({"scale", "rotate_deg"} & value.keys())
    for name, paths in matches(tree, key).items():
        if paths[0][:2] == MISSION_START:  # where the plant begins is a parameter of the plant
            number = 1 + list(tree["mission"]["start_deg"]).index(paths[0][-1])
            paths = [("plant", "initial_joints_deg", str(number))]
        if is_spread and paths[0][0] == "robot" and paths[0][-1] == "inertia":
            spread = validate(InertiaSpread, value, where)
            for sigma, arguments in ((spread.scale, LOG_FACTORS), (spread.rotate_deg, ROTATIONS)):
                if sigma is None:
                    continue
                normal = Normal(normal=0.0, sigma=sigma)
                for argument in arguments:
                    yield Variable(f"{name}.{argument}", key, normal, ((*paths[0], argument),))
        else:
            distribution = _distribution(tree, name, paths, value, where)
            yield Variable(name, key, distribution, tuple(paths))


def _distribution(
    tree: Tree, name: str, paths: Sequence[Path], value: Any, where: str
) -> Distribution:
    distribution, nominals = read_distribution(value, where), [value_at(tree, p) for p in paths]
    group, is_element = paths[0][0], name.endswith("]")
    if not distribution.is_number and (group in ("robot", "gains") or is_element):
        raise InputError("numbers were expected")
    has_number = all(type(nominal) in (int, float) for nominal in nominals)
    if (distribution.relative or distribution.offset) and not has_number:
        raise InputError(f"relative or offset, but {name} is {short(nominals[0])}, no number")
    if group != "robot":
        return distribution
    if paths[0][-1] == "inertia" and not distribution.relative:
        raise InputError("a factor of an inertia needs relative: true")
    factor = least_factor(paths[0])
    return distribution if factor is None else distribution.at_least(factor, min(nominals))


def _check_overlaps(study: Study, variables: Sequence[Variable]) -> None:
    first: dict[tuple[Path, ...], Variable] = {}
    for variable in variables:
        if (other := first.setdefault(variable.paths, variable)) is not variable:
            raise InputError(
                f"{study.where}: vary.{variable.key}: {variable.name} is varied by {other.key} "
                "already"
            )
    for variable in variables:
        path = variable.paths[0]
        where = f"{study.where}: vary.{variable.key}: {variable.name}"
        if "inertia" in path[:-1] and (path[:-1],) in first:
            raise InputError(f"{where} is part of an inertia that is varied as a whole")
        if path == ("scenario", "robot") and any(v.group == "robot" for v in variables):
            raise InputError(
                f"{study.where}: vary.scenario.robot: cannot be varied together with robot.*"
            )


def _all_faults(value: Any, where: str, names: RobotNames) -> Iterator[Variable]:
    if not isinstance(value, dict):
        raise InputError(f"a mapping of faults was expected, got {short(value)}")
    for text, distribution in value.items():
        own = f"{where}.{text}"
        with errors_at(own):
            yield from _faults(str(text), read_distribution(distribution, own), names)


def _faults(key: str, distribution: Distribution, names: RobotNames) -> Iterator[Variable]:
    kinds, name = PLANT_KINDS, key.partition("@")[0]
    kind = kinds[one_of(name, kinds, "kind of fault", listing="--fault list")]
    if distribution.relative or distribution.offset:
        raise InputError("a fault has no nominal value: relative and offset need one")
    if not distribution.is_number:
        raise InputError("numbers were expected")
    head, each, _ = key.partition(EACH_AXIS)
    elements = [key]
    if each:
        about = kind.argument.about if kind.argument else None
        if not about or not key.endswith(EACH_AXIS):
            raise InputError(
                f"{EACH_AXIS} is allowed only at the end of a fault of axes or actuators"
            )
        elements = [f"{head}:{name}" for name in _names(about, names)]
    for text in elements:
        path = (FAULTS, _template(text, kind))
        yield Variable(f"{FAULTS}.{text}", f"{FAULTS}.{key}", distribution, (path,))


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


def _names(about: About, names: RobotNames) -> list[str]:
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
