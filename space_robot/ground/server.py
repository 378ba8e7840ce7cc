"""Server of the ground display: pages, catalogue, histories, and live telemetry by WebSocket."""

from __future__ import annotations

import asyncio
import contextlib
import json
import math
import os
import sys
from collections.abc import AsyncIterator, Callable
from pathlib import Path
from typing import Any

from aiohttp import WSMsgType, web

from space_robot_msgs_py.errors import InputError
from space_robot_msgs_py.telemetry.downlink import LOOPBACK

from .decoder import Decoder
from .store import TelemetryStore

HERE = Path(__file__).parent / "templates"
OPENMCT_VARIABLE = "SPACE_ROBOT_OPENMCT"
LATE_S = 0.1
"""Packets may come out of order by this much."""
DATABASE_PERIOD_S = 1.0
"""A new database is looked for this often, s."""


def find_openmct() -> Path:
    """Return the folder of Open MCT's built files.

    Raises:
        InputError: it is not installed.
    """
    inside = Path("node_modules") / "openmct" / "dist"
    folders = [Path(sys.prefix) / "openmct" / inside, Path.cwd() / inside]
    if named := os.environ.get(OPENMCT_VARIABLE):
        folders.insert(0, Path(named))
    for folder in folders:
        if (folder / "openmct.js").is_file():
            return folder
    raise InputError(
        "Open MCT is not here: `npm install openmct` in this folder, or `make ground` in a clone; "
        f"or name the folder of its openmct.js in {OPENMCT_VARIABLE}"
    )


class GroundServer:
    """Serves the telemetry of one flight after the other, on this machine only."""

    def __init__(self, openmct: Path, database: Path, is_live: bool) -> None:
        """Serve with Open MCT's files.

        ``database``: of the packets, read when it is there and whenever it changes; ``is_live``:
        packets arrive while pages are open.
        """
        self._openmct, self._database, self.is_live = openmct, database, is_live
        self._decoder: Decoder | None = None
        self._read_ns, self._text = 0, ""
        """Time of the last change of the database, and its text."""
        self.store = TelemetryStore()
        self._sockets: set[web.WebSocketResponse] = set()
        self._tasks: set[asyncio.Task[None]] = set()
        self.unknown = 0
        """Packets that the database does not describe."""

    def read_database(self) -> str:
        """Read the database if it has changed; open pages load it. Return what happened, in words.

        It is written at the beginning of each flight.
        """
        try:
            changed_ns, text = self._database.stat().st_mtime_ns, ""
            if changed_ns == self._read_ns or (text := self._database.read_text()) == self._text:
                return ""
            self._read_ns, self._text = changed_ns, text
            self._decoder = Decoder(self._database)
        except FileNotFoundError:
            return ""
        except InputError as error:
            return f"warning: {error}"
        self.store = TelemetryStore(self._decoder.catalogue()["events"])
        self._broadcast({"reload": True})
        return f"database: {self._database}"

    def receive(self, data: bytes) -> None:
        """Decode and keep a packet, and send it to the open pages."""
        self.read_database()
        packet = self._decoder.decode(data) if self._decoder else None
        if packet is None or not math.isfinite(packet.time_s):
            self.unknown += 1
            return
        if packet.time_s < self.store.newest_s - LATE_S:  # another flight, or a reset
            self.store.clear()
            self._broadcast({"reload": True})
        count = len(self.store.events)
        self.store.add(packet)
        values = {name: _finite(value) for name, value in packet.values.items()}
        events = self.store.events[count:]
        self._broadcast({"time": packet.time_s, "values": values, "events": events})

    def _broadcast(self, content: Any) -> None:
        if not self._sockets:
            return
        text = json.dumps(content)
        for socket in self._sockets:
            task = asyncio.get_running_loop().create_task(_send(socket, text))
            self._tasks.add(task)
            task.add_done_callback(self._tasks.discard)

    def application(self) -> web.Application:
        """Return the application of aiohttp."""
        application = web.Application()
        application.add_routes(
            [
                web.get("/", self._page),
                web.get("/catalogue", self._catalogue),
                web.get("/history/{name}", self._history),
                web.get("/events", self._events),
                web.get("/live", self._live),
                web.static("/openmct", self._openmct),
                web.static("/ground", HERE),
            ]
        )
        return application

    async def _page(self, request: web.Request) -> web.StreamResponse:
        return web.FileResponse(HERE / "ground.html")

    async def _catalogue(self, request: web.Request) -> web.Response:
        described = self._decoder.catalogue() if self._decoder else {"robot": "", "structures": []}
        described |= {"live": self.is_live, "newest": self.store.newest_s}
        return web.json_response(described)

    async def _history(self, request: web.Request) -> web.Response:
        try:
            start, end = (float(request.query[key]) for key in ("start", "end"))
        except (KeyError, ValueError):
            raise web.HTTPBadRequest(text="start and end, s, were expected") from None
        rows = self.store.history(request.match_info["name"], start, end)
        return web.json_response([(time_s, _finite(value)) for time_s, value in rows])

    async def _events(self, request: web.Request) -> web.Response:
        return web.json_response(self.store.events)

    async def _live(self, request: web.Request) -> web.WebSocketResponse:
        socket = web.WebSocketResponse(heartbeat=30.0)
        await socket.prepare(request)
        self._sockets.add(socket)
        try:
            async for message in socket:
                if message.type == WSMsgType.ERROR:
                    break
        finally:
            self._sockets.discard(socket)
        return socket


def _finite(value: float | str) -> float | str | None:
    return None if isinstance(value, float) and not math.isfinite(value) else value


async def _send(socket: web.WebSocketResponse, text: str) -> None:
    with contextlib.suppress(ConnectionError):  # the page was closed
        await socket.send_str(text)


class _Datagrams(asyncio.DatagramProtocol):
    def __init__(self, receive: Callable[[bytes], None]) -> None:
        self._receive = receive

    def datagram_received(self, data: bytes, addr: Any) -> None:
        self._receive(data)


async def serve(server: GroundServer, port: int, udp: int) -> AsyncIterator[str]:
    """Serve pages at a port of this machine; yield the address, then what happens, in words.

    Live: telemetry is received at the port ``udp``.

    Raises:
        InputError: a port is taken.
    """
    runner = web.AppRunner(server.application(), access_log=None)
    await runner.setup()
    try:
        try:
            await web.TCPSite(runner, LOOPBACK, port).start()
        except OSError as error:
            raise InputError(f"--port {port}: {error.strerror}") from None
        yield f"http://{LOOPBACK}:{runner.addresses[0][1]}/"
        if server.is_live:
            loop = asyncio.get_running_loop()
            try:
                await loop.create_datagram_endpoint(
                    lambda: _Datagrams(server.receive), local_addr=(LOOPBACK, udp)
                )
            except OSError as error:
                raise InputError(f"--udp {udp}: {error.strerror}") from None
            yield f"waiting for telemetry at udp:{LOOPBACK}:{udp}"
        while True:
            if server.is_live and (news := server.read_database()):
                yield news
            await asyncio.sleep(DATABASE_PERIOD_S)
    finally:
        await runner.cleanup()
