"""A server of viser for browsers on this machine only; it stops without waiting for them.

Any page in a browser may open a websocket to this machine, and by DNS rebinding also read the
answers. Therefore the host of a request must be this machine, and its origin must be this server.
viser has no option for that; the check is added where viser calls websockets.
"""

from __future__ import annotations

import asyncio
import http
import logging
import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from space_robot_msgs_py.errors import FlightError

if TYPE_CHECKING:
    from viser import ViserServer
    from websockets.asyncio.server import ServerConnection
    from websockets.datastructures import Headers
    from websockets.http11 import Request, Response

LOCAL = re.compile(r"(127\.0\.0\.1|localhost|\[::1\])(:\d+)?")
"""Allowed hosts of a request; the port may differ, if forwarded by ssh."""
MOST_CONNECTIONS = 64
OPENING_S = 5.0
"""Timeout of a websocket's opening handshake."""


def is_own(headers: Headers) -> bool:
    """Return True if the host of a request is this machine, and its origin the same address.

    Programs other than browsers send no origin.
    """
    hosts, origins = headers.get_all("Host"), headers.get_all("Origin")
    if len(hosts) != 1 or not LOCAL.fullmatch(hosts[0]):
        return False
    return all(origin == f"http://{hosts[0]}" for origin in origins)


@contextmanager
def local_server(port: int = 0) -> Iterator[ViserServer]:
    """Serve scenes to this machine only, without output.

    Args:
        port: to listen on; the next free one if it is in use. 0: any.

    Raises:
        FlightError: requests of other pages cannot be refused with this version of viser.
    """
    from rich import get_console
    from viser import ViserServer

    # an unused connection of a browser is not an error
    logging.getLogger("websockets.server").setLevel(logging.CRITICAL)
    console = get_console()
    was_quiet, console.quiet = console.quiet, True
    connections = _Connections()
    try:
        with _served_by(connections):
            server = ViserServer(host="127.0.0.1", port=port, verbose=False)
        try:
            if not connections.is_serving:
                raise FlightError("this version of viser cannot refuse requests of other pages")
            yield server
        finally:
            connections.abort()
            server.stop()
    finally:
        console.quiet = was_quiet


@contextmanager
def _served_by(connections: _Connections) -> Iterator[None]:
    """Within the context, serve new websockets by ``connections``."""
    import websockets.asyncio.server as websocket_server

    original = connections.original = websocket_server.serve
    websocket_server.serve = connections.serve  # type: ignore[assignment, misc]
    try:
        yield
    finally:
        websocket_server.serve = original  # type: ignore[misc]


class _Connections:
    """Open connections of a server."""

    original: Any
    """`websockets.asyncio.server.serve`."""

    def __init__(self) -> None:
        self.is_serving = False
        self._has_ended = False
        self._open: dict[asyncio.Transport, asyncio.AbstractEventLoop] = {}

    def serve(self, *arguments: Any, process_request: Any, **options: Any) -> Any:
        """Call `original`, and refuse requests that are not `is_own`."""
        from websockets.asyncio.server import ServerConnection

        opened, closed = self._opened, self._open.pop

        class Connection(ServerConnection):
            def connection_made(self, transport: asyncio.BaseTransport) -> None:
                super().connection_made(transport)
                opened(self.transport, self.loop)

            def connection_lost(self, exc: Exception | None) -> None:
                closed(self.transport, None)
                super().connection_lost(exc)

        self.is_serving = True
        return self.original(
            *arguments,
            process_request=_own_only(process_request),
            create_connection=Connection,
            open_timeout=OPENING_S,
            **options,
        )

    def _opened(self, transport: asyncio.Transport, loop: asyncio.AbstractEventLoop) -> None:
        if self._has_ended or len(self._open) >= MOST_CONNECTIONS:
            transport.abort()
        else:
            self._open[transport] = loop

    def abort(self) -> None:
        """Close all connections without waiting for the browsers."""
        self._has_ended = True
        for transport, loop in list(self._open.items()):
            loop.call_soon_threadsafe(transport.abort)


def _own_only(
    process_request: Callable[[ServerConnection, Request], Response | None],
) -> Callable[[ServerConnection, Request], Response | None]:
    def process(connection: ServerConnection, request: Request) -> Response | None:
        if not is_own(request.headers):
            return connection.respond(http.HTTPStatus.FORBIDDEN, "for pages of this machine\n")
        return process_request(connection, request)

    return process
