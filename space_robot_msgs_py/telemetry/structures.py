"""Housekeeping structures: the signals in each telemetry packet, their rates and encodings."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Annotated, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import AfterValidator, Field

from ..bag.flight_log import MEASURED_APART
from ..config.validation import StrictModel, one_of, read_yaml, validate
from ..errors import InputError
from ..samples import (
    ORBIT_FIELDS,
    SIGNALS,
    CommandSignals,
    Reference,
    RobotNames,
    TelemetrySignals,
    Timebase,
)
from ..signals import Each, Signal, signals_of

Array = NDArray[np.float64]
Columns = Callable[[str], Array]
"""Values (k, ...) of a signal at k ticks; the signal ``law`` is the number of the law in force."""
Encoding = Literal["float64", "float32", "int32", "int16"]

REFERENCE_PREFIX = "reference_"
TELEMETERED: dict[str, Signal] = {
    **{n: signal for n, signal in SIGNALS.items() if n not in ORBIT_FIELDS or n in MEASURED_APART},
    **{f"{REFERENCE_PREFIX}{name}": signal for name, signal in signals_of(Reference).items()},
    **signals_of(CommandSignals),
    **signals_of(TelemetrySignals),
}
"""Signals that a packet may have: measured states, reference, command, telemetry of the law."""
ROOT_CONTAINER = "telemetry_packet"
"""Container of all packets in a database."""
UNKNOWN_LAW = 255
HEADER = [("structure", "u1"), ("tick", ">u4"), ("law", "u1")]
"""Beginning of each packet's data."""
MOST_BYTES = 60_000
"""Of the data of a packet, so that one fits into a datagram."""


def _is_signal(name: str) -> str:
    return one_of(name, TELEMETERED, "signal", " of telemetry")


class SignalEncoding(StrictModel):
    """A signal in a packet, with its encoding."""

    signal: Annotated[str, AfterValidator(_is_signal)]
    encoding: Encoding = "float64"
    scale: Annotated[float, Field(gt=0.0)] = Field(
        1.0, description="value of a count of an integer encoding, in the signal's unit"
    )


class StructureSettings(StrictModel):
    """A housekeeping structure as written in a file."""

    rate_hz: Annotated[float, Field(gt=0.0)] = Field(description="packets a second, Hz")
    signals: Annotated[list[str | SignalEncoding], Field(min_length=1)] = Field(
        description="names of signals, or mappings with signal, encoding, scale"
    )


class TelemetrySettings(StrictModel):
    """Packets of a flight software: content of a file in ``config/telemetry``."""

    apid: Annotated[int, Field(ge=0, le=2046)] = Field(
        description="application process identifier of the flight software"
    )
    structures: Annotated[dict[str, StructureSettings], Field(min_length=1, max_length=255)] = (
        Field(description="housekeeping structures by name")
    )

    @classmethod
    def from_yaml(cls, path: Path) -> TelemetrySettings:
        """Read a file.

        Raises:
            InputError: a key or signal is unknown, or a value is not allowed.
        """
        return validate(cls, read_yaml(path), str(path))


class TmParameter(NamedTuple):
    """A number in a packet."""

    name: str
    """Unique among all structures of a robot."""
    signal: str
    place: int
    """Index in the signal."""
    encoding: Encoding
    scale: float

    @property
    def declaration(self) -> Signal:
        """Declaration of its signal, with unit and text."""
        return TELEMETERED[self.signal]


class Structure:
    """A housekeeping structure of a robot: layout of the data of its packets."""

    def __init__(
        self, number: int, name: str, every: int, entries: Sequence[tuple[SignalEncoding, int]]
    ) -> None:
        """Lay out the data.

        Args:
            number: identifier of the structure in its packets.
            name: of the structure.
            every: ticks from packet to packet.
            entries: encoding and number of values of each signal.
        """
        self.number, self.name, self.every = number, name, every
        self.entries = entries
        kinds = {"float64": ">f8", "float32": ">f4", "int32": ">i4", "int16": ">i2"}
        values = [(e.signal, kinds[e.encoding], (width,)) for e, width in entries]
        self.dtype = np.dtype([*HEADER, *values])

    def encode(self, ticks: NDArray[np.int64], columns: Columns) -> list[bytes]:
        """Return the data of the packets of some ticks, whose values ``columns`` has.

        Integers are rounded and limited to their range; NaN is the lowest one.
        """
        rows = np.zeros(len(ticks), self.dtype)
        rows["structure"], rows["tick"], rows["law"] = self.number, ticks, columns("law")
        for entry, width in self.entries:
            values, target = columns(entry.signal)[:, :width], rows[entry.signal]
            if target.dtype.kind == "i":
                range_ = np.iinfo(target.dtype)
                counts = np.clip(np.rint(values / entry.scale), range_.min, range_.max)
                values = np.where(np.isnan(counts), range_.min, counts)
            target[:] = values
        return [row.tobytes() for row in rows]


class Structures:
    """The housekeeping structures of a robot, without the signals that it does not have."""

    def __init__(
        self, settings: TelemetrySettings, names: RobotNames, timebase: Timebase, where: str
    ) -> None:
        """Lay out all structures.

        Raises:
            InputError: a rate is no fraction of the ticks' rate, a signal is twice in a structure,
                a packet is too large, or the robot has none of the signals. ``where``: the file.
        """
        self.apid, self.names, self.timebase = settings.apid, names, timebase
        self.structures: list[Structure] = []
        for number, (name, structure) in enumerate(settings.structures.items(), 1):
            key = f"{where}: structures.{name}"
            every = _decimation(structure.rate_hz, timebase, key)
            entries: list[tuple[SignalEncoding, int]] = []
            for each in structure.signals:
                entry = each
                if isinstance(entry, str):
                    entry = validate(SignalEncoding, {"signal": entry}, key)
                if any(entry.signal == other.signal for other, _ in entries):
                    raise InputError(f"{key}: signal {entry.signal!r} is there twice")
                if width := self._width(entry.signal):
                    entries.append((entry, width))
            if entries:
                self.structures.append(Structure(number, name, every, entries))
                if self.structures[-1].dtype.itemsize > MOST_BYTES:
                    raise InputError(f"{key}: more than {MOST_BYTES} bytes in a packet")
        if not self.structures:
            raise InputError(f"{where}: the robot has none of these signals")
        self.every = math.gcd(*(structure.every for structure in self.structures))
        """Packets are due at multiples of this many ticks."""

    def _width(self, signal: str) -> int:
        if signal in MEASURED_APART and not getattr(self.names, MEASURED_APART[signal].of):
            return 0
        return TELEMETERED[signal].width(self.names)

    def parameters(self) -> Iterator[tuple[Structure, list[TmParameter]]]:
        """Yield each structure with its parameters in order.

        A signal that several structures have has the structure's name in the later ones.
        """
        used: set[str] = set()
        for structure in self.structures:
            parameters = []
            for entry, width in structure.entries:
                labels = self._labels(entry.signal, width)
                prefix = "" if f"{entry.signal}{labels[0]}" not in used else f"{structure.name}_"
                for index, label in enumerate(labels):
                    name = f"{prefix}{entry.signal}{label}"
                    used.add(name)
                    parameters.append(
                        TmParameter(name, entry.signal, index, entry.encoding, entry.scale)
                    )
            yield structure, parameters

    def _labels(self, signal: str, width: int) -> list[str]:
        declared = TELEMETERED[signal]
        if isinstance(declared.size, Each):
            labels = getattr(self.names, declared.size.names)
        elif width in (3, 4):
            labels = "wxyz"[-width:]
        else:
            labels = declared.labels
        return [f"_{identifier(label)}" for label in labels]


def identifier(name: str) -> str:
    """Return a name with nothing but letters, digits and ``_``, as databases want it."""
    return re.sub(r"\W", "_", name, flags=re.ASCII)


def _decimation(rate_hz: float, timebase: Timebase, key: str) -> int:
    ticks = 1.0 / (rate_hz * timebase.period)
    every = round(ticks)
    if every < 1 or not math.isclose(ticks, every, rel_tol=1e-9):
        raise InputError(
            f"{key}.rate_hz: {rate_hz:g} Hz is no fraction of the {1.0 / timebase.period:g} Hz of "
            "the ticks"
        )
    return every


def numbers_of_laws(laws: Sequence[str]) -> dict[str, int]:
    """Return the number of each law in telemetry and telecommands."""
    return {law: number for number, law in enumerate(sorted(laws))}
