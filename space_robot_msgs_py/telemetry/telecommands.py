"""Telecommands: functions of a robot (PUS service 8), and reports on them (service 1)."""

from __future__ import annotations

import struct
from collections.abc import Mapping, Sequence
from enum import IntEnum
from typing import Any, NamedTuple

from ..errors import SpaceRobotError
from ..samples import RobotNames
from .structures import identifier, numbers_of_laws

FUNCTION_MANAGEMENT, PERFORM = 8, 1
"""Service and subtype of telecommands that perform a function."""
NAME_BYTES = 48
"""Length of a text in a telecommand, filled with zeros."""
POINTS = ("nadir", "velocity", "sun", "target")


class FailureCode(IntEnum):
    """Reason in a failure report."""

    UNKNOWN_APID = 1
    UNKNOWN_SERVICE = 2
    UNKNOWN_FUNCTION = 3
    WRONG_LENGTH = 4
    WRONG_ARGUMENT = 5
    REFUSED = 6
    """The node refused it, see its log."""
    NO_ANSWER = 7


class TelecommandError(SpaceRobotError):
    """A telecommand that is not executed."""

    def __init__(self, code: FailureCode, why: str) -> None:
        super().__init__(why)
        self.code = code


class TcArgument(NamedTuple):
    """An argument of a function: a number, one of some choices, or a text."""

    name: str
    text: str
    unit: str = ""
    choices: Mapping[str, int] = {}
    """Number of each choice, one octet; empty: a float of eight."""
    length: int = 0
    """Octets of a text; 0: a number."""


class TcFunction(NamedTuple):
    """A function that telecommands perform."""

    number: int
    name: str
    text: str
    arguments: tuple[TcArgument, ...] = ()

    @property
    def layout(self) -> struct.Struct:
        """Layout of the arguments' octets."""
        kinds = (f"{a.length}s" if a.length else "B" if a.choices else "d" for a in self.arguments)
        return struct.Struct(f"!{''.join(kinds)}")


class Telecommand(NamedTuple):
    """A function with the values of its arguments; choices by name."""

    function: str
    values: dict[str, Any]

    def __str__(self) -> str:
        return f"{self.function} {self.values.get('gain', '')}".rstrip()


def functions(names: RobotNames, laws: Sequence[str]) -> tuple[TcFunction, ...]:
    """Return the functions of a robot with these ``names`` and control ``laws``."""
    duration = TcArgument("duration", "0: as fast as the limits allow", "s")
    joints = (
        TcArgument(f"position_{identifier(name)}", f"position of {name}, m if it slides", "rad")
        for name in names.joints
    )
    values = (TcArgument(f"value_{name}", f"value of the axis {name}") for name in names.axes)
    law = TcArgument("law", "control law", choices=numbers_of_laws(laws))
    gain = TcArgument("gain", "LAW.GAIN, such as tde_stc.k1", length=NAME_BYTES)
    point = TcArgument(
        "point", "what the base points at", choices={n: k for k, n in enumerate(POINTS)}
    )
    return (
        TcFunction(1, "select_law", "Swap to another control law", (law,)),
        TcFunction(2, "set_gain", "Set a gain of a law on all axes", (gain, *values)),
        TcFunction(3, "go_to", "Move the joints in place of the mission", (duration, *joints)),
        TcFunction(4, "point", "Point the base in place of the mission", (point, duration)),
        TcFunction(5, "pause", "Pause the simulation"),
        TcFunction(6, "resume", "Resume the paused simulation"),
    )


def read_telecommand(packet: Any, apid: int, known: Sequence[TcFunction]) -> Telecommand:
    """Return what a packet (`spacepackets.ecss.PusTc`) asks for.

    Raises:
        TelecommandError: it cannot be executed.
    """
    code = FailureCode
    if packet.apid != apid:
        raise TelecommandError(code.UNKNOWN_APID, f"APID {packet.apid}: {apid} was expected")
    service = packet.service, packet.message_subtype
    if service != (FUNCTION_MANAGEMENT, PERFORM):
        why = f"service {service[0]}, subtype {service[1]}: 8, 1 was expected"
        raise TelecommandError(code.UNKNOWN_SERVICE, why)
    data = bytes(packet.app_data)
    by_number = {function.number: function for function in known}
    if not data or data[0] not in by_number:
        why = f"function {data[0] if data else 'missing'}: 1 to {len(known)} were expected"
        raise TelecommandError(code.UNKNOWN_FUNCTION, why)
    function = by_number[data[0]]
    if len(data) - 1 != function.layout.size:
        why = f"{function.name}: {len(data) - 1} octets of arguments, {function.layout.size} were "
        raise TelecommandError(code.WRONG_LENGTH, f"{why}expected")
    values = zip(function.arguments, function.layout.unpack(data[1:]), strict=True)
    return Telecommand(function.name, {a.name: _value(a, value) for a, value in values})


def _value(argument: TcArgument, value: Any) -> Any:
    if argument.length:
        try:
            return bytes(value).rstrip(b"\0").decode("ascii")
        except UnicodeDecodeError:
            why = f"{argument.name}: ASCII was expected"
            raise TelecommandError(FailureCode.WRONG_ARGUMENT, why) from None
    if argument.choices:
        for name, number in argument.choices.items():
            if number == value:
                return name
        why = f"{argument.name} {value}: one of {', '.join(map(str, argument.choices.values()))}"
        raise TelecommandError(FailureCode.WRONG_ARGUMENT, why)
    if not abs(value) < 1e9:
        why = f"{argument.name} {value}: a finite number was expected"
        raise TelecommandError(FailureCode.WRONG_ARGUMENT, why)
    return value


def write_telecommand(
    function: TcFunction, values: Mapping[str, Any], apid: int, sequence_count: int = 0
) -> bytes:
    """Return the packet that performs a function; choices in ``values`` are names."""
    from spacepackets.ecss.tc import PusTc

    numbers = []
    for argument in function.arguments:
        value = values[argument.name]
        if argument.choices:
            value = argument.choices[value]
        numbers.append(value.encode("ascii") if argument.length else value)
    data = bytes([function.number]) + function.layout.pack(*numbers)
    packet = PusTc(
        service=FUNCTION_MANAGEMENT,
        message_subtype=PERFORM,
        apid=apid,
        app_data=data,
        seq_count=sequence_count,
    )
    return bytes(packet.pack())
