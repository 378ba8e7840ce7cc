"""Downlink: housekeeping and event packets of a flight, written to a file or sent by UDP."""

from __future__ import annotations

import socket
import struct
import time
from collections.abc import Iterable, Sequence
from contextlib import suppress
from enum import IntEnum
from pathlib import Path
from typing import NamedTuple, Protocol

import numpy as np

from ..errors import InputError
from .structures import Columns, Structures

LOOPBACK = "127.0.0.1"
TIME_FORMAT = 0x2F
"""P-field of CCSDS unsegmented time (301.0-B-4): own epoch, 4 octets of seconds and 3 below."""
HOUSEKEEPING, EVENT_REPORTING = 3, 5
"""PUS services."""
PARAMETER_REPORT = 25
BURST, PAUSE_S = 16, 5e-4
"""Datagrams sent at once, and the time that a receiver has before the next."""


class EventKind(IntEnum):
    """Events that the flight software reports."""

    LAW_IN_FORCE = 1
    """Another law, or other gains; the value is the law's number."""
    MODE_ENTERED = 2
    """The value is the mode's number: nominal, holding, safe."""


class TelemetryEvent(NamedTuple):
    """An event to report."""

    tick: int
    kind: EventKind
    value: int
    severity: int = 1
    """1: information, 2 to 4: anomaly of low, medium, high severity (the PUS subtype)."""


def cuc_time(stamp_ns: int) -> bytes:
    """Return a simulated time, ns, as CCSDS unsegmented time code; counts 2^-24 s, rounded down."""
    seconds, rest = divmod(stamp_ns, 10**9)
    return struct.pack("!BI", TIME_FORMAT, seconds) + ((rest << 24) // 10**9).to_bytes(3, "big")


class Sink(Protocol):
    """Destination of packets; a file that is open for octets is one."""

    def writelines(self, packets: Sequence[bytes], /) -> None:
        """Write packets in order."""

    def close(self) -> None:
        """Write what is buffered, and close."""


class PacketWriter:
    """Makes the packets of a robot, in the order of their ticks and numbered."""

    def __init__(self, structures: Structures) -> None:
        """``structures``: of the housekeeping packets."""
        self._structures = structures
        self.count = 0
        """Number of packets made."""
        self._counts: dict[tuple[int, int], int] = {}
        """Messages sent of each service and subtype."""

    def packets(
        self, start: int, stop: int, columns: Columns, events: Iterable[TelemetryEvent] = ()
    ) -> list[bytes]:
        """Return the packets of the ticks ``start`` to before ``stop``.

        ``columns`` returns a signal's values (stop - start, ...), a row a tick.
        """
        reports = [(event.tick, 0, event.severity, _event_data(event)) for event in events]
        for each in self._structures.structures:
            first = -(-start // each.every) * each.every
            if first < stop:
                ticks = np.arange(first, stop, each.every)
                rows = slice(first - start, None, each.every)
                data = each.encode(ticks, lambda name, rows=rows: columns(name)[rows])  # type: ignore[misc]
                reports += [
                    (int(tick), each.number, 0, one) for tick, one in zip(ticks, data, strict=True)
                ]
        packets = []
        for tick, number, severity, content in sorted(reports, key=lambda report: report[:3]):
            service, subtype = (
                (HOUSEKEEPING, PARAMETER_REPORT) if number else (EVENT_REPORTING, severity)
            )
            packets.append(self.packet(tick, service, subtype, content))
        return packets

    def packet(self, tick: int, service: int, subtype: int, data: bytes) -> bytes:
        """Return a packet of a service with some data."""
        from spacepackets.ecss.tm import PusTm

        count = self._counts.get((service, subtype), 0)
        packet = PusTm(
            service=service,
            message_subtype=subtype,
            timestamp=cuc_time(self._structures.timebase.stamp_ns(tick)),
            source_data=data,
            apid=self._structures.apid,
            seq_count=self.count % 2**14,
            message_counter=count,
        )
        self._counts[service, subtype] = (count + 1) % 2**16
        self.count += 1
        return bytes(packet.pack())


def _event_data(event: TelemetryEvent) -> bytes:
    return struct.pack("!BIB", event.kind, event.tick, event.value)


class UdpSink:
    """Datagrams, one a packet; where nobody listens they are lost."""

    def __init__(self, host: str, port: int) -> None:
        """Raise an `InputError` if the host is unknown."""
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        try:
            self._socket.connect((host, port))
        except OSError as error:
            raise InputError(f"udp:{host}:{port}: {error.strerror or error}") from None

    def writelines(self, packets: Sequence[bytes], /) -> None:
        """Send packets, with pauses in which the receiver can read them."""
        for number, packet in enumerate(packets, 1):
            with suppress(OSError):  # nobody listens
                self._socket.send(packet)
            if number % BURST == 0:
                time.sleep(PAUSE_S)

    def close(self) -> None:
        """Close the socket."""
        self._socket.close()


def parse_udp(address: str) -> tuple[str, int]:
    """Return host and port of ``udp:HOST:PORT``.

    Raises:
        InputError: it is not of that form.
    """
    kind, _, rest = address.partition(":")
    host, _, port = rest.rpartition(":")
    if kind != "udp" or not host or not port.isdecimal() or not 0 < int(port) < 2**16:
        raise InputError(f"{address!r}: udp:HOST:PORT was expected, as udp:127.0.0.1:10015")
    return host, int(port)


def open_sink(destination: str) -> Sink:
    """Open ``udp:HOST:PORT``, or a file to append to.

    Raises:
        InputError: the address is wrong, or the file cannot be written.
    """
    if destination.startswith("udp:"):
        return UdpSink(*parse_udp(destination))
    try:
        return Path(destination).open("ab")
    except OSError as error:
        raise InputError(f"{destination}: {error.strerror}") from None
