"""Only this machine's own pages are served, and whoever is connected, the server stops."""

from __future__ import annotations

import http.client
import os
import socket

import pytest
from hypothesis import given
from hypothesis import strategies as st

pytest.importorskip("viser")
client = pytest.importorskip("websockets.sync.client")
exceptions = pytest.importorskip("websockets.exceptions")

from websockets.datastructures import Headers  # noqa: E402

from space_robot.view import local_server as module  # noqa: E402
from space_robot.view.local_server import is_own, local_server  # noqa: E402

LOCAL = ("127.0.0.1:8080", "localhost:9000", "[::1]:8080", "localhost")
FOREIGN = (
    "evil.example:8080",
    "127.0.0.1.evil.example",
    "localhost@evil.example:8080",
    "192.168.1.7",
    "localhost:80:80",
    "",
)
ADDRESSES = st.lists(st.sampled_from(LOCAL + FOREIGN), max_size=2)


def headers(hosts: list[str], origins: list[str]) -> Headers:
    return Headers([*(("Host", h) for h in hosts), *(("Origin", o) for o in origins)])


@given(ADDRESSES, ADDRESSES, st.sampled_from(["http", "https"]))
def test_a_request_is_its_own_if_host_and_origin_are_one_address_here(
    hosts: list[str], origins: list[str], scheme: str
) -> None:
    own = len(hosts) == 1 and hosts[0] in LOCAL
    own = own and all(origin == hosts[0] and scheme == "http" for origin in origins)
    assert is_own(headers(hosts, [f"{scheme}://{origin}" for origin in origins])) == own
    assert not is_own(headers(["localhost"], ["null"]))


def test_the_page_and_its_websocket_are_for_pages_from_here() -> None:
    import viser

    with local_server() as server:
        address = f"127.0.0.1:{server.get_port()}"

        def status(host: str) -> int:
            connection = http.client.HTTPConnection(address)
            connection.request("GET", "/", headers={"Host": host})
            return connection.getresponse().status

        def opened(origin: str | None) -> int:
            try:
                with client.connect(
                    f"ws://{address}", origin=origin, subprotocols=[f"viser-v{viser.__version__}"]
                ):
                    return 101
            except exceptions.InvalidStatus as refused:
                return int(refused.response.status_code)

        assert status(address) == 200
        assert status(f"evil.example:{server.get_port()}") == 403
        origins = (None, f"http://{address}", "http://evil.example", "http://127.0.0.1:1", "null")
        assert [opened(origin) for origin in origins] == [101, 101, 403, 403, 403]


def test_connections_that_have_ended_count_no_more() -> None:
    """Else nobody could come after so many visitors."""
    with local_server() as server:
        address = f"127.0.0.1:{server.get_port()}"
        for _ in range(module.MOST_CONNECTIONS + 20):
            connection = http.client.HTTPConnection(address)
            connection.request("GET", "/")
            assert connection.getresponse().status == 200
            connection.close()


@pytest.mark.parametrize("sent", [b"", b"GET / HTTP/1.1\r\nHost: ", os.urandom(300)])
def test_it_stops_whatever_is_connected(sent: bytes, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "OPENING_S", 300.0)
    with local_server() as server:
        connected = []
        for _ in range(module.MOST_CONNECTIONS + 20):
            connected.append(socket.create_connection(("127.0.0.1", server.get_port())))
            connected[-1].sendall(sent)
        serving = server._websock_server._server_thread
    assert serving is not None
    assert not serving.is_alive()
    for connection in connected:
        connection.close()
    with pytest.raises(ConnectionRefusedError):
        socket.create_connection(("127.0.0.1", server.get_port()))


def test_a_server_that_cannot_be_kept_to_this_machine_is_not_used(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    from space_robot_msgs_py.errors import FlightError

    monkeypatch.setattr(module._Connections, "serve", lambda self, *a, **o: self.original(*a, **o))
    with pytest.raises(FlightError, match="cannot refuse requests"), local_server():
        pass
