"""Who is in a ROS domain, by the ports of this machine."""

from __future__ import annotations

import socket
from contextlib import suppress

import pytest

from space_robot.flight.graph import domain
from space_robot.flight.graph.domain import is_quiet, ros_domain
from space_robot_msgs_py.errors import FlightError

RANGE = "ROS_AUTOMATIC_DISCOVERY_RANGE"


@pytest.fixture(autouse=True)
def _local(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(RANGE, "LOCALHOST")
    monkeypatch.delenv("ROS_STATIC_PEERS", raising=False)


@pytest.mark.parametrize("family", [socket.AF_INET, socket.AF_INET6])
@pytest.mark.parametrize("port", [0, 10, 11, 249])
def test_a_taken_port_is_somebody(free_domain: int, port: int, family: int) -> None:
    before, beside = is_quiet(free_domain), 7400 + 250 * free_domain + port
    with socket.socket(family, socket.SOCK_DGRAM) as somebody:
        somebody.bind(("", beside))
        assert [before, is_quiet(free_domain)] == [True, False]
    assert is_quiet(free_domain)


@pytest.mark.parametrize("port", [0, 10, 12, 249])
def test_a_domain_with_any_taken_port_is_not_free(
    free_domain: int, port: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A participant that outlives the first one of its flight has no port 10."""
    monkeypatch.delenv("ROS_DOMAIN_ID", raising=False)
    monkeypatch.setattr(domain, "DOMAINS", range(free_domain, free_domain + 1))
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as somebody:
        somebody.bind(("", 7400 + 250 * free_domain + port))
        with pytest.raises(FlightError, match=f"between {free_domain} and"), ros_domain():
            pass
    with ros_domain() as found:
        assert found == free_domain


def test_no_domain_has_ports_that_linux_gives_to_any_program() -> None:
    assert 7400 + 250 * (domain.DOMAINS[-1] + 1) <= 32768


@pytest.mark.parametrize("port", [-1, 250])
def test_ports_of_the_domains_beside_do_not_count(free_domain: int, port: int) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as somebody:
        with suppress(OSError):  # that domain is in use
            somebody.bind(("", 7400 + 250 * free_domain + port))
        assert is_quiet(free_domain)


@pytest.mark.parametrize(
    ("name", "value"), [(RANGE, "SUBNET"), (RANGE, "OFF"), ("ROS_STATIC_PEERS", "10.0.0.7")]
)
def test_with_other_machines_nobody_knows(
    free_domain: int, monkeypatch: pytest.MonkeyPatch, name: str, value: str
) -> None:
    monkeypatch.setenv(name, value)
    assert not is_quiet(free_domain)


def test_a_participant_is_somebody(free_domain: int) -> None:
    rclpy = pytest.importorskip("rclpy")
    context = rclpy.Context()
    rclpy.init(context=context, domain_id=free_domain)
    node = rclpy.create_node("somebody", context=context)
    assert not is_quiet(free_domain)
    node.destroy_node()
    context.try_shutdown()
