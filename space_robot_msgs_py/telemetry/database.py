"""Database of telemetry and telecommands in XTCE, for ground software."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import yamcs.pymdb as xtce

from .downlink import EVENT_REPORTING, HOUSEKEEPING, PARAMETER_REPORT, EventKind
from .structures import (
    ROOT_CONTAINER,
    UNKNOWN_LAW,
    Structures,
    TmParameter,
    identifier,
    numbers_of_laws,
)
from .telecommands import FUNCTION_MANAGEMENT, PERFORM, TcArgument, functions

Limits = Mapping[str, Sequence[tuple[float, float]]]
"""Lowest and highest value of each number of a signal; infinite: none."""
AMBER = 0.9
"""Share of a limit from which a value is amber."""
PRIMARY = {
    "ccsds_version": 3,
    "ccsds_type": 1,
    "ccsds_secondary_header": 1,
    "ccsds_apid": 11,
    "ccsds_sequence_flags": 2,
    "ccsds_sequence_count": 14,
    "ccsds_length": 16,
}
"""Bits of the fields of a primary header (CCSDS 133.0-B-2)."""
SECONDARY = {
    "pus_version": 4,
    "pus_time_reference": 4,
    "pus_service": 8,
    "pus_subtype": 8,
    "pus_message_counter": 16,
    "pus_destination": 16,
    "time_format": 8,
}
"""Bits of the fields of a telemetry packet's secondary header (ECSS-E-ST-70-41C) up to the time."""
TIME_BITS, TIME_COUNT_S = 56, 2.0**-24
ENCODINGS = {
    "float64": xtce.float64_t,
    "float32": xtce.float32_t,
    "int32": xtce.int32_t,
    "int16": xtce.int16_t,
}


def database(
    robot: str,
    structures: Structures,
    laws: Sequence[str],
    modes: Sequence[str],
    limits: Limits,
    timeline: Iterable[tuple[float, str]] = (),
) -> str:
    """Return the database of a robot's telemetry and telecommands as XTCE 1.2.

    Args:
        robot: name of the robot.
        structures: of its telemetry.
        laws: names of its control laws.
        modes: names of the controller's modes, by number.
        limits: of signals; values are red beyond them, amber from `AMBER` of them on.
        timeline: planned events of the flight as time, s, and text, for displays: captures, faults,
            swaps.
    """
    events = {f"event {k}": f"{time_s!r} {text}" for k, (time_s, text) in enumerate(timeline)}
    about = f"space_robot: robot {robot}"
    system = xtce.System(identifier(robot), short_description=about, extra=events)
    _Telemetry(system, structures, laws, modes, limits)
    _add_commands(system, structures, laws)
    return str(system.dumps())


class _Telemetry:
    def __init__(
        self,
        system: Any,
        structures: Structures,
        laws: Sequence[str],
        modes: Sequence[str],
        limits: Limits,
    ) -> None:
        self._system, self._limits = system, limits
        self._checksum = self._integer("checksum", 16)
        header = {name: self._integer(name, bits) for name, bits in (PRIMARY | SECONDARY).items()}
        stamp = xtce.FloatParameter(
            system,
            "time",
            bits=64,
            units="s",
            short_description="simulated time (CCSDS unsegmented time code)",
            encoding=xtce.IntegerEncoding(TIME_BITS),
            calibrator=xtce.Polynomial([0.0, TIME_COUNT_S]),
        )
        root = self._container(ROOT_CONTAINER, [*header.values(), stamp], abstract=True)
        service, subtype = header["pus_service"], header["pus_subtype"]
        law = xtce.EnumeratedParameter(
            system,
            "law",
            [*((n, name) for name, n in numbers_of_laws(laws).items()), (UNKNOWN_LAW, "unknown")],
            short_description="control law in force",
            encoding=xtce.uint8_t,
        )
        number, tick = self._integer("structure", 8), self._integer("tick", 32)
        reports = self._container(
            "housekeeping",
            [number, tick, law],
            base=root,
            condition=xtce.all_of(
                xtce.eq(service, HOUSEKEEPING), xtce.eq(subtype, PARAMETER_REPORT)
            ),
            abstract=True,
        )
        for structure, parameters in structures.parameters():
            content = [self._value(parameter) for parameter in parameters]
            self._container(
                structure.name,
                [*content, self._checksum],
                base=reports,
                condition=xtce.eq(number, structure.number),
            )
        event = xtce.EnumeratedParameter(
            system,
            "event",
            [(kind.value, kind.name.lower()) for kind in EventKind],
            encoding=xtce.uint8_t,
        )
        mode = xtce.EnumeratedParameter(
            system, "mode", list(enumerate(modes)), encoding=xtce.uint8_t
        )
        events = self._container(
            "events",
            [event, tick],
            base=root,
            condition=xtce.eq(service, EVENT_REPORTING),
            abstract=True,
        )
        for kind, value in ((EventKind.LAW_IN_FORCE, law), (EventKind.MODE_ENTERED, mode)):
            name = kind.name.lower()
            condition = xtce.eq(event, name)
            self._container(name, [value, self._checksum], base=events, condition=condition)
        code = self._integer("failure_code", 8)
        request = [self._integer("request_packet", 16), self._integer("request_sequence", 16)]
        verification = self._container(
            "verification", request, base=root, condition=xtce.eq(service, 1), abstract=True
        )
        for number_, name in enumerate(("acceptance", "start", "progress", "completion")):
            for is_failure, end in enumerate(("success", "failure")):
                self._container(
                    f"{name}_{end}",
                    [*[code] * is_failure, self._checksum],
                    base=verification,
                    condition=xtce.eq(subtype, 2 * number_ + 1 + is_failure),
                )

    def _integer(self, name: str, bits: int) -> Any:
        encoding = xtce.IntegerEncoding(bits)
        return xtce.IntegerParameter(self._system, name, signed=False, encoding=encoding)

    def _container(self, name: str, parameters: Iterable[Any], **settings: Any) -> Any:
        entries = [xtce.ParameterEntry(parameter) for parameter in parameters]
        return xtce.Container(self._system, name, entries=entries, **settings)

    def _value(self, parameter: TmParameter) -> Any:
        declared = parameter.declaration
        is_count = parameter.encoding.startswith("int")
        ends = self._limits.get(parameter.signal, ())
        ends = ends[parameter.place : parameter.place + 1]
        return xtce.FloatParameter(
            self._system,
            parameter.name,
            bits=64 if parameter.encoding == "float64" else 32,
            units=declared.unit or None,
            short_description=", ".join(filter(None, (declared.text, declared.frame))),
            encoding=ENCODINGS[parameter.encoding],
            calibrator=xtce.Polynomial([0.0, parameter.scale]) if is_count else None,
            alarm=_alarm(*ends[0]) if ends else None,
        )


def _alarm(low: float, high: float) -> Any:
    finite = {end: value for end, value in (("low", low), ("high", high)) if abs(value) < 1e300}
    if not finite:
        return None
    middle = 0.5 * (low + high) if len(finite) == 2 else 0.0
    ends: dict[str, Any] = {f"critical_{end}": value for end, value in finite.items()}
    for end, value in finite.items():
        ends[f"warning_{end}"] = middle + AMBER * (value - middle)
    return xtce.ThresholdAlarm(**ends)


def _add_commands(system: Any, structures: Structures, laws: Sequence[str]) -> None:
    header = xtce.Command(
        system,
        "telecommand_packet",
        abstract=True,
        short_description="header of ECSS PUS-C; the sender sets sequence count, length, checksum",
        entries=[
            xtce.FixedValueEntry((0x1800 | structures.apid).to_bytes(2, "big"), "packet_id"),
            xtce.FixedValueEntry(b"\xc0\x00", "packet_sequence"),
            xtce.FixedValueEntry(b"\x00\x00", "packet_length"),
            xtce.FixedValueEntry(b"\x2f", "pus_version_and_acknowledgement"),
            xtce.FixedValueEntry(bytes([FUNCTION_MANAGEMENT, PERFORM]), "service_and_subtype"),
            xtce.FixedValueEntry(b"\x00\x00", "source"),
        ],
    )
    for function in functions(structures.names, laws):
        arguments = {argument.name: _argument(argument) for argument in function.arguments}
        xtce.Command(
            system,
            function.name,
            base=header,
            short_description=function.text,
            arguments=list(arguments.values()),
            entries=[
                xtce.FixedValueEntry(bytes([function.number]), "function"),
                *(xtce.ArgumentEntry(argument) for argument in arguments.values()),
            ],
        )


def _argument(argument: TcArgument) -> Any:
    about: dict[str, Any] = {"units": argument.unit or None, "short_description": argument.text}
    if argument.choices:
        choices = [(number, name) for name, number in argument.choices.items()]
        return xtce.EnumeratedArgument(argument.name, choices, encoding=xtce.uint8_t, **about)
    if argument.length:
        encoding = xtce.StringEncoding(bits=8 * argument.length)
        return xtce.StringArgument(argument.name, encoding=encoding, **about)
    return xtce.FloatArgument(argument.name, bits=64, encoding=xtce.float64_t, **about)
