"""Faults to be injected, as text: ``KIND@T[-END][:ARGUMENT]``, times in simulated seconds.

`KINDS` is the one list of what can go wrong: the parameters, the command line's help and
docs/faults.md are checked against it or made from it.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import NamedTuple

from space_robot_msgs_py.config.validation import one_of
from space_robot_msgs_py.errors import InputError

_NUMBER = r"(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?"
_FAULT = re.compile(
    rf"(?P<kind>[^@]*)@(?P<start>{_NUMBER})(?:-(?P<stop>{_NUMBER}))?(?::(?P<argument>.+))?",
    re.ASCII,
)
_JOINT_AND_NUMBER = re.compile(r"(?P<joint>\d+)=(?P<number>.+)", re.ASCII)


class Argument(NamedTuple):
    """What a fault is told beside its time: a number, of one joint if ``joint`` is set."""

    symbol: str
    unit: str
    low: float
    high: float
    whole: bool = False
    joint: bool = False

    @property
    def form(self) -> str:
        """As it is written."""
        return f"JOINT={self.symbol}" if self.joint else self.symbol

    @property
    def allowed(self) -> str:
        """Which values may stand there, in words."""
        number = "a whole number" if self.whole else "a number"
        joint = ", JOINT counted from 1" if self.joint else ""
        return f"{self.form}, {number} from {self.low:g} to {self.high:g} ({self.unit}){joint}"


class Kind(NamedTuple):
    """One way to fail."""

    name: str
    where: str
    """Who brings it about: "plant" or "orchestrator"."""
    argument: Argument | None
    default: float | None
    """The argument when none is given; None: it must be given."""
    description: str

    @property
    def lasts(self) -> bool:
        """Whether it acts over a stretch of time, so that an end may be given."""
        return self.where == "plant"

    @property
    def form(self) -> str:
        """How a fault of this kind is written; what may be left out is in brackets."""
        text = f"{self.name}@T[-END]" if self.lasts else f"{self.name}@T"
        if self.argument is None:
            return text
        argument = f":{self.argument.form}"
        return text + (argument if self.default is None else f"[{argument}]")

    def read(self, argument: str) -> tuple[int, float]:
        """Joint (from 1; 0 if none is named) and number of an argument's text, or the default's.

        Raises:
            InputError: says what is allowed instead.
        """
        if self.argument is None:
            if argument:
                raise InputError(f"{self.name} takes no argument, got {argument!r}")
            return 0, math.nan
        if not argument:
            if self.default is None:
                raise InputError(f"{self.name} needs an argument: {self.argument.allowed}")
            return 0, self.default
        joint, number = 0, argument
        if self.argument.joint:
            match = _JOINT_AND_NUMBER.fullmatch(argument)
            joint, number = (int(match["joint"]), match["number"]) if match else (0, "")
        try:
            value = float(number)
        except ValueError:
            value = math.nan
        fits = self.argument.low <= value <= self.argument.high
        if not fits or (self.argument.whole and value % 1) or (self.argument.joint and not joint):
            raise InputError(f"argument {argument!r}: {self.argument.allowed} is allowed")
        return joint, value


@dataclass(frozen=True)
class Fault:
    """One fault of a flight, made by `parse_fault`; ``str`` gives its text."""

    kind: str
    start_s: float
    """Simulated time from which it acts, s."""
    stop_s: float
    """Simulated time from which it no longer acts, s (inf: it lasts)."""
    argument: str
    """As given; empty if it was left out."""

    def __str__(self) -> str:
        stop = "" if math.isinf(self.stop_s) else f"-{_shortest(self.stop_s)}"
        argument = f":{self.argument}" if self.argument else ""
        return f"{self.kind}@{_shortest(self.start_s)}{stop}{argument}"

    @property
    def value(self) -> float:
        """The argument's number in its kind's unit; NaN if the kind has no argument."""
        return KINDS[self.kind].read(self.argument)[1]

    @property
    def joint(self) -> int:
        """The joint it is about, from 1; 0 if it is about none."""
        return KINDS[self.kind].read(self.argument)[0]


def parse_fault(text: str, kinds: Mapping[str, Kind]) -> Fault:
    """The fault of a text; ``kinds`` are those allowed here, from `KINDS`.

    Raises:
        InputError: names the text, what is wrong with it, what is allowed.
    """
    where = f"fault {text!r}"
    match = _FAULT.fullmatch(text.strip())
    if match is None:
        raise InputError(f"{where}: KIND@T[-END][:ARGUMENT] expected, as in drop_state@2-3:0.1")
    start, stop = float(match["start"]), float(match["stop"] or math.inf)
    try:
        kind = kinds[one_of(match["kind"], kinds, "kind")]
        if match["stop"] and not kind.lasts:
            raise InputError(f"{kind.name} has no end: {kind.form}")
        if not start < stop or (match["stop"] and math.isinf(stop)):
            raise InputError(f"END must be later than T, got {match['start']} to {match['stop']}")
        kind.read(match["argument"] or "")
    except InputError as error:
        raise InputError(f"{where}: {error}") from None
    return Fault(kind.name, start, stop, match["argument"] or "")


def parse_faults(texts: Iterable[str], kinds: Mapping[str, Kind]) -> list[Fault]:
    """The faults of several texts; empty ones are none (ROS has no empty list of strings).

    Raises:
        InputError: see `parse_fault`.
    """
    return [parse_fault(text, kinds) for text in texts if text.strip()]


def _shortest(seconds: float) -> str:
    return repr(seconds).removesuffix(".0")


_PROBABILITY = Argument("P", "probability per tick", 0.0, 1.0)
_TICKS = Argument("TICKS", "ticks", 0.0, 1e6, whole=True)
_SECONDS = Argument("SECONDS", "s of the wall clock", 0.0, 1e6)
_RAD = Argument("SIGMA", "rad", 0.0, 1e3)
_RAD_PER_S = Argument("SIGMA", "rad/s", 0.0, 1e3)
_RAD_STEP = Argument("STEP", "rad", 1e-12, 1e3)
_RAD_PER_S_STEP = Argument("STEP", "rad/s", 1e-12, 1e3)
_TORQUE = Argument("TORQUE", "N m", 0.0, 1e6)
_JOINT_TORQUE = Argument("TORQUE", "N m", 0.0, 1e3, joint=True)

KINDS: dict[str, Kind] = {
    kind.name: kind
    for kind in (
        Kind("drop_state", "plant", _PROBABILITY, 1.0, "a state is lost"),
        Kind("repeat_state", "plant", _PROBABILITY, 1.0, "a state comes again a tick later"),
        Kind("delay_state", "plant", _TICKS, 1.0, "states come late"),
        Kind("jitter_state", "plant", _TICKS, 1.0, "states come late by 0 to TICKS, any as likely"),
        Kind("drop_command", "plant", _PROBABILITY, 1.0, "a command is lost"),
        Kind("repeat_command", "plant", _PROBABILITY, 1.0, "a command comes again a tick later"),
        Kind("delay_command", "plant", _TICKS, 1.0, "commands come late"),
        Kind("jitter_command", "plant", _TICKS, 1.0,
             "commands come late by 0 to TICKS, any as likely"),
        Kind("nan_state", "plant", _PROBABILITY, 1.0, "one measured number is NaN"),
        Kind("inf_state", "plant", _PROBABILITY, 1.0, "one measured number is infinite"),
        Kind("scaled_quaternion", "plant", _PROBABILITY, 1.0,
             "the measured quaternion's norm is 0.9 or 1.1"),
        Kind("stamp_back", "plant", _PROBABILITY, 1.0, "a state's stamp is 1 to 10 ticks early"),
        Kind("stamp_jump", "plant", _PROBABILITY, 1.0, "a state's stamp is 1000000 ticks late"),
        Kind("nan_command", "plant", _PROBABILITY, 1.0, "one commanded torque is NaN"),
        Kind("inf_command", "plant", _PROBABILITY, 1.0, "one commanded torque is infinite"),
        Kind("noise_attitude", "plant", _RAD, None,
             "the measured attitude is turned by SIGMA about each axis"),
        Kind("noise_gyro", "plant", _RAD_PER_S, None, "noise on the measured base rate"),
        Kind("noise_joint_position", "plant", _RAD, None, "noise on the measured joint angles"),
        Kind("noise_joint_velocity", "plant", _RAD_PER_S, None,
             "noise on the measured joint velocities"),
        Kind("quantise_attitude", "plant", _RAD_STEP, None,
             "the measured attitude's rotation vector comes in steps"),
        Kind("quantise_gyro", "plant", _RAD_PER_S_STEP, None,
             "the measured base rate comes in steps"),
        Kind("quantise_joint_position", "plant", _RAD_STEP, None,
             "the measured joint angles come in steps"),
        Kind("quantise_joint_velocity", "plant", _RAD_PER_S_STEP, None,
             "the measured joint rates come in steps"),
        Kind("saturate_base", "plant", _TORQUE, None, "the base's actuators give no more"),
        Kind("saturate_joints", "plant", _TORQUE, None, "the joints' motors give no more"),
        Kind("stuck_joint", "plant", _JOINT_TORQUE, None,
             "a joint's Coulomb friction rises to TORQUE"),
        Kind("kill_controller", "orchestrator", None, None, "the controller's process is killed"),
        Kind("stop_controller", "orchestrator", _SECONDS, math.inf,
             "the controller's process stands still, then goes on"),
        Kind("kill_recorder", "orchestrator", None, None, "the recorder's process is killed"),
        Kind("stop_recorder", "orchestrator", _SECONDS, math.inf,
             "the recorder's process stands still, then goes on"),
        Kind("kill_mission", "orchestrator", None, None, "the mission's process is killed"),
        Kind("stop_mission", "orchestrator", _SECONDS, math.inf,
             "the mission's process stands still, then goes on"),
    )
}  # fmt: skip
"""All kinds by name."""

PLANT_KINDS = {name: kind for name, kind in KINDS.items() if kind.where == "plant"}
ORCHESTRATOR_KINDS = {name: kind for name, kind in KINDS.items() if kind.where == "orchestrator"}


def help_lines(kinds: Mapping[str, Kind]) -> list[str]:
    """One line a kind for the help of a command: how it is written, what it does."""
    width = max(len(kind.form) for kind in kinds.values())
    return [f"{kind.form:{width}}  {kind.description}" for kind in kinds.values()]
