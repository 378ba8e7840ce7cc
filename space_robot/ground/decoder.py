"""Decoder of telemetry packets from their XTCE database alone, and what a display needs of it."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

from lxml import etree
from space_packet_parser.xtce.definitions import XtcePacketDefinition

from space_robot_msgs_py.errors import InputError
from space_robot_msgs_py.telemetry.structures import ROOT_CONTAINER

EVENT_PACKET = "event"
LEVELS = {"WarningRange": "amber", "CriticalRange": "red"}


class Packet(NamedTuple):
    """A decoded packet."""

    time_s: float
    container: str
    """Name of its container in the database."""
    values: dict[str, float | str]
    """Calibrated values by parameter, without those of the headers."""


class Decoder:
    """Reads packets, as a ground station does: it knows nothing but the database."""

    def __init__(self, path: Path) -> None:
        """Read a database.

        Raises:
            InputError: it is missing, no XTCE, or not one of this kind.
        """
        try:
            self._definition = XtcePacketDefinition.from_xtce(
                path, root_container_name=ROOT_CONTAINER
            )
            self._tree = etree.parse(path)
            root = self._definition.containers[ROOT_CONTAINER]
        except Exception as error:  # whatever the parsers raise
            why = str(error).splitlines()[0]
            raise InputError(f"{path}: no telemetry database ({why})") from None
        self.robot = str(self._tree.getroot().get("name"))
        self._header = {entry.name for entry in root.entry_list}

    def decode(self, packet: bytes) -> Packet | None:
        """Return the content of a packet; None: the database does not describe it."""
        try:
            parsed = self._definition.parse_bytes(packet)
        except Exception:  # whatever is in a datagram
            return None
        values = {
            name: value.real if isinstance(value, (int, float)) else str(value)
            for name, value in parsed.items()
            if name not in self._header
        }
        if "checksum" not in values or "time" not in parsed:
            return None
        del values["checksum"]
        number = values.pop("structure", None)
        container = EVENT_PACKET if number is None else self._names[int(number)]
        return Packet(float(parsed["time"]), container, values)

    @cached_property
    def _names(self) -> Mapping[int, str]:
        names = {}
        for element in self._tree.iterfind(".//{*}SequenceContainer"):
            for base in element.iterfind("{*}BaseContainer"):
                if str(base.get("containerRef")).endswith("housekeeping"):
                    names[int(base.findtext(".//{*}Value"))] = str(element.get("name"))
        return dict(sorted(names.items()))

    def catalogue(self) -> dict[str, Any]:
        """Return what a display needs: structures with their parameters, and planned events."""
        types = {
            str(element.get("name")): element
            for element in self._tree.iterfind(".//{*}ParameterTypeSet/*")
        }
        texts = {
            str(element.get("name")): str(element.get("shortDescription") or "")
            for element in self._tree.iterfind(".//{*}ParameterSet/{*}Parameter")
        }
        texts |= {n: str(e.get("shortDescription") or texts.get(n, "")) for n, e in types.items()}
        structures = []
        for name in self._names.values():
            entries = self._definition.containers[name].entry_list
            parameters = [
                {
                    "name": entry.name,
                    "text": texts.get(entry.name, ""),
                    "unit": entry.parameter_type.unit or "",
                    "limits": _limits(types[entry.name]),
                }
                for entry in entries
                if entry.name not in self._header | {"checksum", "structure", "tick", "law"}
            ]
            structures.append({"name": name, "parameters": parameters})
        return {"robot": self.robot, "structures": structures, "events": list(self._events())}

    def _events(self) -> Iterator[tuple[float, str]]:
        for element in self._tree.getroot().iterfind("{*}AncillaryDataSet/{*}AncillaryData"):
            time_s, _, text = str(element.text).partition(" ")
            yield float(time_s), text


def _limits(element: Any) -> dict[str, dict[str, float]]:
    """Return the ends of the amber and red ranges; those that are not there are left out."""
    limits = {}
    for tag, level in LEVELS.items():
        for alarm in element.iterfind(f".//{{*}}{tag}"):
            ends = {"low": alarm.get("minInclusive"), "high": alarm.get("maxInclusive")}
            limits[level] = {e: float(v) for e, v in ends.items() if v and math.isfinite(float(v))}
    return limits
