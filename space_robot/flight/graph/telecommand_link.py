"""Telecommands by UDP to a flying graph: verified, executed by its nodes, and reported."""

from __future__ import annotations

import json
import socket
import struct
import threading
from collections import Counter
from contextlib import suppress
from typing import Any

from typing_extensions import Self

from space_robot_msgs_py.errors import FlightError, InputError
from space_robot_msgs_py.telemetry.downlink import LOOPBACK, PacketWriter, parse_udp
from space_robot_msgs_py.telemetry.telecommands import (
    FailureCode,
    TcFunction,
    Telecommand,
    TelecommandError,
    functions,
    read_telecommand,
)

from ..plan import Flight
from ..telemetry import TelemetryPlan, check_libraries
from .node_names import CONTROLLER_NODE, PLANT
from .node_services import TemporaryNode, call_trigger, send_segment, set_parameters

LOOK_S = 0.2
"""The end is looked for this often, s."""
LARGEST, MOST_KEPT = 65_535, 20
VERIFICATION = 1
ACCEPTED, NOT_ACCEPTED, COMPLETED, NOT_COMPLETED = 1, 2, 7, 8
"""Subtypes of the reports; the lowest bit of a packet's flags asks for a completion's, the highest
for an acceptance's."""
ASKS_ACCEPTANCE, ASKS_COMPLETION = 8, 1


class TelecommandLink:
    """Receives telecommands at a port of this machine while a flight lasts.

    Each answer is a report of PUS service 1, sent to where the telecommand came from. What is no
    telecommand, or damaged, is counted and not answered.
    """

    def __init__(self, address: str, flight: Flight) -> None:
        """Bind the port; ``address``: ``udp:127.0.0.1:PORT``.

        Raises:
            InputError: it is not of this machine or is taken, or a library is missing.
        """
        check_libraries()
        host, port = parse_udp(address)
        if host not in (LOOPBACK, "localhost"):
            raise InputError(f"telecommands are received at {LOOPBACK} only, got {host!r}")
        plan = TelemetryPlan.of_flight(flight)
        self._apid, self._writer = plan.structures.apid, PacketWriter(plan.structures)
        self._functions: tuple[TcFunction, ...] = functions(plan.structures.names, plan.laws)
        self._to_degrees = plan.robot.to_degrees
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        try:
            self._socket.bind((LOOPBACK, port))
        except OSError as error:
            self._socket.close()
            raise InputError(f"{address}: {error.strerror}") from None
        self._socket.settimeout(LOOK_S)
        self.counts: Counter[str] = Counter()
        """Packets by what became of them: executed, refused, damaged."""
        self.refusals: list[str] = []
        """Reasons, at most `MOST_KEPT`."""
        self._is_over = threading.Event()
        self._thread: threading.Thread | None = None

    def begin(self, domain: int, namespace: str) -> None:
        """Serve from now on, in a thread, the graph in a domain and namespace."""
        self._thread = threading.Thread(target=self._serve, args=(domain, namespace), daemon=True)
        self._thread.start()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._is_over.set()
        if self._thread:
            self._thread.join()
        self._socket.close()

    def lines(self) -> list[str]:
        """Return counts of the packets, and reasons of refusals, in words."""
        counts = [f"{self.counts[word]} {word}" for word in ("executed", "refused", "damaged")]
        reasons = [f"telecommand refused: {reason}" for reason in self.refusals]
        return [*reasons, f"telecommands: {', '.join(counts)}"]

    def _serve(self, domain: int, namespace: str) -> None:
        visitor = TemporaryNode("telecommands", domain, namespace)
        try:
            while not self._is_over.is_set():
                with suppress(OSError):  # nothing came
                    data, sender = self._socket.recvfrom(LARGEST)
                    self._receive(data, sender, visitor.node)
        finally:
            visitor.leave()

    def _receive(self, data: bytes, sender: Any, node: Any) -> None:
        from spacepackets.ecss.req_id import RequestId
        from spacepackets.ecss.tc import InvalidTcCrc16Error, PusTc

        try:
            packet = PusTc.unpack(data)
            if packet.packet_len != len(data) or not packet.sp_header.packet_type:
                raise ValueError("octets beyond the packet, or telemetry")
        except (ValueError, InvalidTcCrc16Error, struct.error):
            self.counts["damaged"] += 1
            return
        request, flags = (
            bytes(RequestId.from_pus_tc(packet).pack()),
            packet.pus_tc_sec_header.ack_flags,
        )

        def report(subtype: int, code: FailureCode | None = None) -> None:
            self._report(sender, subtype, request + (bytes([code]) if code else b""))

        try:
            command = read_telecommand(packet, self._apid, self._functions)
        except TelecommandError as error:
            self._refuse(str(error))
            report(NOT_ACCEPTED, error.code)
            return
        if flags & ASKS_ACCEPTANCE:
            report(ACCEPTED)
        try:
            self._execute(command, node)
        except (FlightError, InputError) as error:
            is_silent = "no answer" in str(error)
            self._refuse(f"{command}: {error}")
            report(NOT_COMPLETED, FailureCode.NO_ANSWER if is_silent else FailureCode.REFUSED)
            return
        self.counts["executed"] += 1
        if flags & ASKS_COMPLETION:
            report(COMPLETED)

    def _execute(self, command: Telecommand, node: Any) -> None:
        name, values = command
        if name == "select_law":
            set_parameters(node, CONTROLLER_NODE, {"controller": values["law"]}, self._check)
        elif name == "set_gain":
            gains = [value for key, value in values.items() if key != "gain"]
            set_parameters(node, CONTROLLER_NODE, {values["gain"]: gains}, self._check)
        elif name in ("pause", "resume"):
            is_done, why = call_trigger(node, f"{PLANT}/{name}", self._check)
            if not is_done:
                raise FlightError(why)
        else:
            segment: dict[str, Any] = {"duration": values["duration"] or "fast"}
            if name == "point":
                segment["base"] = {"point": values["point"]}
            else:
                positions = [v for key, v in values.items() if key != "duration"]
                segment["joints_deg"] = [float(v) for v in self._to_degrees(positions)]
            send_segment(node, json.dumps(segment), self._check)

    def _refuse(self, why: str) -> None:
        self.counts["refused"] += 1
        if len(self.refusals) < MOST_KEPT:
            self.refusals.append(why)

    def _check(self) -> None:
        if self._is_over.is_set():
            raise FlightError("no answer: the flight is over")

    def _report(self, receiver: Any, subtype: int, data: bytes) -> None:
        packet = self._writer.packet(0, VERIFICATION, subtype, data)
        with suppress(OSError):  # the sender has gone
            self._socket.sendto(packet, receiver)
