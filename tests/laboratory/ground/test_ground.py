"""The ground display: what its server answers, and Open MCT in Chromium, live and of a bag."""

from __future__ import annotations

import asyncio
import re
import shutil
import socket
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from flights import forked_space_robot
from paths import DOCS

from space_robot import Scenario
from space_robot.ground.decoder import Decoder, Packet
from space_robot.ground.store import MOST_SHOWN, TelemetryStore
from space_robot_msgs_py.errors import InputError

pytest.importorskip("aiohttp")
pytest.importorskip("space_packet_parser")

from aiohttp.test_utils import TestClient, TestServer
from telemetry_packets import packets_of

from space_robot.ground.server import GroundServer, find_openmct, serve


def test_a_history_keeps_the_least_and_the_largest_of_many_values() -> None:
    store, count = TelemetryStore(), 5 * MOST_SHOWN
    for tick in range(count):
        value = {1234: 7.0, 4321: -7.0}.get(tick, 0.0)
        store.add(Packet(tick / 1024, "attitude", {"x": value}))
    rows = store.history("x", 0.0, 1e9)
    assert len(rows) <= MOST_SHOWN + 2
    assert {(1234 / 1024, 7.0), (4321 / 1024, -7.0)} <= set(rows)
    assert store.history("x", 1.0, 1025 / 1024) == [(1.0, 0.0), (1025 / 1024, 0.0)]
    assert store.history("y", 0.0, 1.0) == []


def test_planned_events_come_with_their_time() -> None:
    store = TelemetryStore([(2.0, "capture"), (1.0, "drive scale")])
    store.add(Packet(0.5, "attitude", {}))
    assert not store.events
    store.add(Packet(1.5, "event", {"event": "mode_entered", "mode": "safe"}))
    assert [(e["time"], e["level"]) for e in store.events] == [(1.0, "warning"), (1.5, "critical")]
    store.clear()
    assert not store.events


@pytest.fixture(scope="module")
def packets(tmp_path_factory: pytest.TempPathFactory) -> Path:
    file = tmp_path_factory.mktemp("flight") / "a.packets"
    options: dict[str, Any] = {"actuators": "wheels", "swaps": ["0.5:ctc"]}
    Scenario(duration=1.0, telemetry=str(file), **options).fly()
    return file


def test_what_arrives_is_sent_to_pages_and_kept(packets: Path, tmp_path: Path) -> None:
    """A packet of another flight begins anew; garbage is counted."""

    async def check() -> None:
        database = tmp_path / "telemetry.xml"
        server = GroundServer(packets.parent, database, is_live=True)
        async with TestClient(TestServer(server.application())) as client:
            empty = await (await client.get("/catalogue")).json()
            assert empty["structures"] == []
            shutil.copy(packets.with_suffix(".xml"), database)
            page = await client.ws_connect("/live")
            first, *others = packets_of(packets)
            for packet in [first, b"nothing", first[:20], *others]:
                server.receive(packet)
            assert server.unknown == 2
            assert await page.receive_json() == {"reload": True}
            sent = [await page.receive_json() for _ in range(1 + len(others))]
            history = await (await client.get("/history/omega_base_x?start=0&end=1")).json()
            values = [
                (s["time"], s["values"]["omega_base_x"])
                for s in sent
                if "omega_base_x" in s["values"]
            ]
            assert [tuple(row) for row in history] == values
            events = await (await client.get("/events")).json()
            assert [event["text"] for event in events] == [
                "law in force: tde_stc",
                "law in force: ctc",
            ]
            assert (await client.get("/history/x?start=now")).status == 400
            server.store.newest_s = 100.0
            server.receive(first)
            assert await page.receive_json() == {"reload": True}
            again = await (await client.get("/history/omega_base_x?start=0&end=1")).json()
            assert again == []

    asyncio.run(check())


def test_ports_that_are_taken_are_told(packets: Path) -> None:
    async def begin(port: int, udp: int) -> None:
        server = GroundServer(packets.parent, packets.with_suffix(".xml"), is_live=True)
        async for _ in serve(server, port, udp):
            pass

    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
        taken.bind(("127.0.0.1", 0))
        port = taken.getsockname()[1]
        with pytest.raises(InputError, match=f"--udp {port}: .*in use"):
            asyncio.run(begin(0, port))
    with socket.socket() as listening:
        listening.bind(("127.0.0.1", 0))
        listening.listen()
        port = listening.getsockname()[1]
        with pytest.raises(InputError, match=f"--port {port}: .*in use"):
            asyncio.run(begin(port, 10015))


@pytest.mark.parametrize("text", ["", "<a/>", "<SpaceSystem name='x'/>"])
def test_wrong_databases_are_told(text: str, tmp_path: Path) -> None:
    file = tmp_path / "wrong.xml"
    file.write_text(text)
    with pytest.raises(InputError, match=r"wrong.xml: no telemetry database \("):
        Decoder(file)


@pytest.fixture
def browser() -> Iterator[Any]:
    sys.path.insert(0, str(DOCS))
    from devtools import Browser, chromium

    if chromium() is None:
        pytest.skip("needs Chromium")
    try:
        find_openmct()
    except InputError as error:
        pytest.skip(str(error))
    with Browser() as opened:
        yield opened


VALUES = """openmct.telemetry.request(await openmct.objects.get("space_robot:omega_base_x"), {
    start: Date.UTC(2000, 0, 1), end: Date.UTC(2000, 0, 2)})"""

JUDGED = """(async () => {
    const object = await openmct.objects.get("space_robot:wheel_torques_wheel_1");
    const { evaluate } = openmct.telemetry.limitEvaluator(object);
    return [0, 3.7, -4.1].map((value) => evaluate({ value })?.cssClass ?? "");
})()"""


@contextmanager
def displayed(browser: Any, *arguments: str) -> Iterator[Any]:
    """A tab with what ``space-robot ground`` shows, which ends with the context."""
    process = forked_space_robot("ground", *arguments, "--no-open", "--port", "0")
    try:
        assert process.stderr
        address = re.search(r"http://\S+/", process.stderr.readline())
        assert address
        tab = browser.tab(1400, 900)
        tab.open(address[0])
        yield tab
    finally:
        process.kill()
        process.communicate(60.0)


def shown(tab: Any) -> None:
    """Wait until the flight's display has curves and its events."""
    tab.wait("document.querySelectorAll('.c-plot canvas').length > 3")
    tab.wait("document.body.innerText.includes('law in force: tde_stc')")
    assert not [text for text in tab.messages if text.startswith(("error", "exception"))]
    assert not [u for u in tab.requests if not re.match(r"(data|blob|http://127\.0\.0\.1):", u)]


def test_open_mct_shows_a_bag(browser: Any, tmp_path: Path) -> None:
    bag = tmp_path / "bag"
    log = Scenario(duration=1.0, actuators="wheels", swaps=["0.5:ctc"]).fly(bag=bag).log
    with displayed(browser, str(bag)) as tab:
        shown(tab)
        values = tab.value(f"(async () => {VALUES})()")
        assert [value["value"] for value in values] == log.omega_base[::200, 0].tolist()
        assert tab.value(JUDGED) == [
            "",
            "is-limit--yellow is-limit--upr",
            "is-limit--red is-limit--lwr",
        ]


def test_open_mct_follows_a_flight(browser: Any, udp_port: int) -> None:
    with displayed(browser, "--udp", str(udp_port)) as tab:
        tab.wait("document.body.innerText.includes('No flight yet')")
        options: dict[str, Any] = {"actuators": "wheels", "telemetry": f"udp:127.0.0.1:{udp_port}"}
        Scenario(duration=0.2, **options).fly()  # its database makes the page load anew
        shown(tab)
        log = Scenario(duration=1.0, **options).fly().log
        tab.wait("openmct.time.getClock().currentValue() - Date.UTC(2000, 0, 1) > 850")
        shown(tab)
        values = tab.value(f"(async () => {VALUES})()")
        assert [value["value"] for value in values] == log.omega_base[::200, 0].tolist()
        last = tab.value("openmct.time.getClock().currentValue() - Date.UTC(2000, 0, 1)")
        assert last == pytest.approx(900.0, abs=1.0)
