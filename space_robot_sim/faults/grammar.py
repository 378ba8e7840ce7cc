"""Kinds of faults, and their text form ``KIND@T[-END][:ARGUMENT]``, times in simulated seconds.

A `Kind` is declared by the component that it changes, in its table ``FAULTS``; this module knows
none by name. Grammar, help, reference page, schedule and application follow from the table.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from enum import Enum
from typing import Any, NamedTuple

import numpy as np

from space_robot_msgs_py.config.text import choices
from space_robot_msgs_py.config.validation import one_of, short
from space_robot_msgs_py.errors import InputError
from space_robot_msgs_py.samples import RobotNames
from space_robot_msgs_py.simulated_time import check_time, shortest
from space_robot_msgs_py.topics import BASE_AXES

Change = Callable[[Any, float], Any]
"""From the sound numbers of an array, and the fault's argument, to those with the fault."""

NUMBER = r"(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?"
_FAULT = re.compile(
    rf"(?P<kind>[^@]*)@(?P<start>{NUMBER})(?:-(?P<stop>{NUMBER}))?(?::(?P<argument>.+))?", re.ASCII
)
# axes are counted from 1, so that none is called 0
_AXIS_AND_NUMBER = re.compile(r"(?P<axis>(?!0+=).+)=(?P<number>[^=]+)", re.ASCII)


class About(Enum):
    """Kind of axes or base actuators that a kind of fault can affect."""

    AXIS = "AXIS a name, a joint counted from 1, base, joints or all"
    JOINT = "JOINT a name, counted from 1, or joints"
    BASE_AXIS = "BASE_AXIS a name, or base"
    WHEEL = "WHEEL a name, counted from 1, or wheels"
    THRUSTER = "THRUSTER a name, counted from 1, or thrusters"


class Argument(NamedTuple):
    """A fault's number beside its time; behind the axes it is about, if ``about`` is set.

    Without a ``symbol`` there is no number: the axes alone are given.
    """

    symbol: str = ""
    unit: str = ""
    low: float = 0.0
    high: float = 0.0
    about: About | None = None
    whole: bool = False
    default: float | None = None
    """The number when none is given; None: it must be given."""

    @property
    def form(self) -> str:
        """Text form of the argument."""
        names = [self.about.name] if self.about else []
        return "=".join([*names, *([self.symbol] if self.symbol else [])])

    @property
    def allowed(self) -> str:
        """Allowed values, in words."""
        if self.about and not self.symbol:
            return self.about.value
        number = "a whole number" if self.whole else "a number"
        about = f", {self.about.value}" if self.about else ""
        return f"{self.form}, {number} from {self.low:g} to {self.high:g} ({self.unit}){about}"


class Kind(NamedTuple):
    """A kind of fault."""

    name: str
    argument: Argument | None
    description: str
    field: str = ""
    """Array of the component's record that it changes; empty: it changes no component."""
    change: Change = np.add
    lasts: bool = True
    """The fault acts over a stretch of time, so that an end may be given."""
    group: str = ""
    """Axes that it is about where none is named: "base" or "joints"."""
    rows: str = ""
    """Field of the record with the place of each joint in the array; empty: they are in order."""

    @property
    def default(self) -> float | None:
        """The argument's number when none is given; None: it must be given, if there is one."""
        return self.argument.default if self.argument else None

    @property
    def form(self) -> str:
        """Text form of a fault of this kind; optional parts are in brackets."""
        text = f"{self.name}@T[-END]" if self.lasts else f"{self.name}@T"
        if self.argument is None:
            return text
        argument = f":{self.argument.form}"
        return text + (argument if self.default is None else f"[{argument}]")

    def read(self, argument: str) -> tuple[str, float]:
        """Return axis (empty if none is named) and number of an argument's text.

        Raises:
            InputError: the text is invalid; the message says what is allowed.
        """
        if self.argument is None:
            if argument:
                raise InputError(f"{self.name} takes no argument, got {argument!r}")
            return "", math.nan
        if not argument:
            if self.default is None:
                raise InputError(f"{self.name} needs an argument: {self.argument.allowed}")
            return "", self.default
        if not self.argument.symbol:
            return argument, math.nan
        axis, number = "", argument
        if self.argument.about:
            match = _AXIS_AND_NUMBER.fullmatch(argument)
            axis, number = (match["axis"], match["number"]) if match else ("", "")
        try:
            value = float(number)
        except ValueError:
            value = math.nan
        fits = self.argument.low <= value <= self.argument.high
        if not fits or (self.argument.whole and value % 1):
            raise InputError(f"argument {argument!r}: {self.argument.allowed} is allowed")
        return axis, value


Kinds = Mapping[str, Kind]
"""Kinds by their names."""


def by_name(*kinds: Kind) -> Kinds:
    """Collect kinds by name; names must be unique."""
    collected = {kind.name: kind for kind in kinds}
    if len(collected) != len(kinds):
        raise ValueError("two kinds of faults have one name")
    return collected


@dataclass(frozen=True)
class Fault:
    """One fault of a flight, made by `parse_fault`; ``str`` gives its text."""

    kind: Kind
    start_s: float
    """Simulated time from which it acts, s."""
    stop_s: float
    """Simulated time from which it no longer acts, s (inf: it lasts)."""
    argument: str
    """As given; empty if it was left out."""

    def __str__(self) -> str:
        stop = "" if math.isinf(self.stop_s) else f"-{shortest(self.stop_s)}"
        argument = f":{self.argument}" if self.argument else ""
        return f"{self.kind.name}@{shortest(self.start_s)}{stop}{argument}"

    @property
    def value(self) -> float:
        """The argument's number in its kind's unit; NaN if the kind has no argument."""
        return self.kind.read(self.argument)[1]

    @property
    def axis(self) -> str:
        """The axis, or group of axes, it is about, as given; empty if it is about none."""
        return self.kind.read(self.argument)[0]


def parse_fault(text: str, kinds: Kinds) -> Fault:
    """Parse the text of a fault of one of ``kinds``.

    Raises:
        InputError: names the text, what is wrong with it, what is allowed.
    """
    where = f"fault {text!r}"
    match = _FAULT.fullmatch(text.strip())
    if match is None:
        raise InputError(
            f"{where}: KIND@T[-END][:ARGUMENT] expected, T and END in simulated "
            "seconds, as in drop_state@2-3:0.1"
        )
    start, stop = float(match["start"]), float(match["stop"] or math.inf)
    try:
        check_time(start)
        check_time(stop if match["stop"] else 0.0, "END")
        kind = kinds[one_of(match["kind"], kinds, "kind", listing="--fault list")]
        if match["stop"] and not kind.lasts:
            raise InputError(f"{kind.name} has no end: {kind.form}")
        if not start < stop:
            raise InputError(f"END must be later than T, got {match['start']} to {match['stop']}")
        kind.read(match["argument"] or "")
    except InputError as error:
        raise InputError(f"{where}: {error}") from None
    return Fault(kind, start, stop, match["argument"] or "")


def parse_faults(texts: Iterable[str], kinds: Kinds) -> list[Fault]:
    """Parse faults; empty texts are ignored."""
    # a ROS parameter cannot be an empty list of strings: that is [""]
    return [parse_fault(text, kinds) for text in texts if text.strip()]


def axes_of(name: str, about: About, names: RobotNames) -> tuple[int, ...]:
    """Return the indices of a fault's ``name`` among all axes, wheels or thrusters.

    A thing of that name comes first, then a group of them, then a number.

    Args:
        name: as written in the fault.
        about: the things that are allowed.
        names: of the robot's axes and actuators.

    Raises:
        InputError: the name does not exist; the message lists the names.
    """
    base, every = len(BASE_AXES), range(len(names.axes))
    of_base, of_joints = {"base": tuple(every[:base])}, {"joints": tuple(every[base:])}
    listed = names.axes
    match about:
        case About.AXIS:
            meant, counted = every, every[base:]
            groups = {**of_base, **of_joints, "all": tuple(every)}
        case About.JOINT:
            meant, counted, groups = every[base:], every[base:], of_joints
        case About.BASE_AXIS:
            meant, counted, groups = every[:base], every[:0], of_base
        case _:
            group = f"{about.name.lower()}s"
            listed = names.wheels if about is About.WHEEL else names.thrusters
            meant = counted = range(len(listed))
            groups = {group: tuple(meant)} if listed else {}
    numbers = {str(1 + place - counted.start): (place,) for place in counted}
    known = {listed[place]: (place,) for place in meant}
    axes = {**numbers, **groups, **known}.get(name)
    if axes is None:
        also = [*([f"1 to {len(numbers)}"] if numbers else []), *groups]
        advice = choices(name, known, f", {', '.join(also)}") if known else "there is none"
        raise InputError(f"no {about.name.lower().replace('_', ' ')} {short(name)}: {advice}")
    return axes


def add_noise(sigma: Any, value: float) -> Any:
    """Add white noise to a standard deviation."""
    # independent noises add by their variances
    return np.sqrt(sigma * sigma + value * value)


def switch_on(flags: Any, value: float) -> Any:
    """Set flags to 1."""
    return np.ones_like(flags)


def help_lines(kinds: Kinds) -> list[str]:
    """Return a help line for each kind: its text form and effect."""
    width = max(len(kind.form) for kind in kinds.values())
    return [f"{kind.form:{width}}  {kind.description}" for kind in kinds.values()]
