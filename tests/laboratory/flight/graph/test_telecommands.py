"""Telecommands to a flying graph: executed, verified, refused; and 500 hostile packets."""

from __future__ import annotations

import json
import random
import socket
import time
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from flights import PausedFlight, planned
from telemetry_packets import check_equal

from space_robot_msgs_py.bag.reader import read_flight
from space_robot_msgs_py.telemetry.telecommands import FailureCode, functions, write_telecommand

tc = pytest.importorskip("spacepackets.ecss.tc")
APID, TIMEOUT_S = 100, 120.0
FLIGHT = planned(actuators="wheels", duration=4.0)
FUNCTIONS = {
    function.name: function for function in functions(FLIGHT.controller.names, tuple(FLIGHT.laws))
}


class Station:
    """A ground station: sends telecommands and hears the reports on them."""

    def __init__(self, port: int) -> None:
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.connect(("127.0.0.1", port))
        self._socket.settimeout(TIMEOUT_S)

    def send(self, data: bytes) -> None:
        self._socket.send(data)

    def reports(self, count: int) -> list[tuple[int, int]]:
        """Subtype and failure code (0: none) of the next reports."""
        packets = [self._socket.recv(2048) for _ in range(count)]
        assert {packet[7] for packet in packets} == {1}
        return [(packet[8], packet[25] if packet[8] % 2 == 0 else 0) for packet in packets]

    def perform(self, name: str, **values: Any) -> list[tuple[int, int]]:
        self.send(write_telecommand(FUNCTIONS[name], values, APID))
        return self.reports(2)


def hostile(count: int) -> Iterator[bytes]:
    """Garbage, truncated, flipped and lengthened packets, and whole ones that nobody may send."""
    rng, good = random.Random(1), write_telecommand(FUNCTIONS["pause"], {}, APID)
    for number in range(count):
        kind = number % 5
        if kind == 0:
            yield rng.randbytes(rng.randrange(200))
        elif kind == 1:
            yield good[: rng.randrange(len(good))]
        elif kind == 2:
            flipped = bytearray(good)
            flipped[rng.randrange(len(good))] ^= 1 << rng.randrange(8)
            yield bytes(flipped)
        elif kind == 3:
            yield good + rng.randbytes(3)
        else:
            service, apid = rng.choice([(8, 5), (17, APID), (3, APID)])
            packet = tc.PusTc(service, 1, apid=apid, app_data=b"\x05")
            yield bytes(packet.pack())


def test_a_flight_obeys_its_station_and_nobody_else(
    free_domain: int, udp_port: int, tmp_path: Path
) -> None:
    bag, file = tmp_path / "bag", tmp_path / "a.packets"
    options = ("--actuators", "wheels", "--duration", "0.2", "--json", "--composed")
    telemetry = ("--telemetry", str(file), "--telecommands", f"udp:127.0.0.1:{udp_port}")
    flight = PausedFlight(bag, free_domain, *options, *telemetry)
    station, axes = Station(udp_port), FLIGHT.controller.names.axes
    law = station.perform("select_law", law="ctc")
    values = {f"value_{axis}": 20.0 for axis in axes}
    gain = station.perform("set_gain", gain="ctc.k_p", **values)
    no_gain = station.perform("set_gain", gain="ctc.nothing", **values)
    point = station.perform("point", point="target", duration=10.0)
    for packet in hostile(500):
        station.send(packet)
        time.sleep(1e-3)
    reports = Counter(station.reports(100))
    resumed = station.perform("resume")
    code, output, errors = flight.end()
    assert code == 0, errors
    assert law == gain == resumed == [(1, 0), (7, 0)]
    assert no_gain == point == [(1, 0), (8, FailureCode.REFUSED)]
    assert set(reports) == {(2, FailureCode.UNKNOWN_APID), (2, FailureCode.UNKNOWN_SERVICE)}
    counts = json.loads(output)["graph"]["telecommands"]
    assert (counts["executed"], counts["refused"], counts["damaged"]) == (3, 102, 400)
    assert "nothing" in counts["refusals"][0]
    log = read_flight(bag)
    assert [law.name for law in log.laws] == ["tde_stc", "ctc"]
    assert log.laws[-1].gains["k_p"] == (20.0,) * len(axes)
    assert check_equal(file, log) > 100


def test_a_port_that_is_taken_and_others_addresses_are_refused(
    udp_port: int, space_robot: Any
) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
        taken.bind(("127.0.0.1", udp_port))
        ran = space_robot("fly", "--telecommands", f"udp:127.0.0.1:{udp_port}")
    assert (ran.code, "Address already in use" in ran.err) == (2, True)
    ran = space_robot("fly", "--telecommands", "udp:0.0.0.0:1234")
    assert (ran.code, "at 127.0.0.1 only, got '0.0.0.0'" in ran.err) == (2, True)
