"""Checks of ROS 2, whose sources are faked through the environment and parameters."""

from __future__ import annotations

import pytest

from space_robot.doctor.ros import check_distribution, check_domain, check_middleware
from space_robot.flight.graph.domain import ros_domain
from space_robot_msgs_py.ros.locks import FileLock, domain_lock


def test_another_distribution_is_a_warning() -> None:
    file = "/opt/ros/humble/lib/python3/site-packages/rclpy/__init__.py"
    item = check_distribution(file, {"ROS_DISTRO": "humble"})
    assert item.status == "warning"
    assert item.text.startswith(f"humble, rclpy from {file}")
    assert check_distribution(file, {"ROS_DISTRO": "jazzy"}).status == "ok"


def test_the_middleware_has_the_transports_and_the_range_that_flights_have() -> None:
    """The project's defaults, unless the user has others."""
    item = check_middleware("rmw_fastrtps_cpp", {})
    assert item.status == "ok"
    assert item.text == "rmw_fastrtps_cpp, discovery LOCALHOST, transports UDPv4"
    for own in ({"ROS_AUTOMATIC_DISCOVERY_RANGE": "SUBNET"}, {"ROS_STATIC_PEERS": "192.168.0.7"}):
        item = check_middleware("rmw_cyclonedds_cpp", own)
        assert item.status == "warning"
        assert own.items() <= item.values.items()


def test_a_domain_that_is_taken(free_domain: int) -> None:
    """It is that of ROS_DOMAIN_ID, and released after the check."""
    lock = FileLock(domain_lock(free_domain), "another flight")
    try:
        item = check_domain(free_domain)
    finally:
        lock.release()
    assert item.status == "warning"
    assert f"ROS domain {free_domain} is taken by another flight" in item.text
    assert check_domain(free_domain).values["domain"] == free_domain
    with ros_domain(free_domain) as domain:
        assert domain == free_domain


def test_without_a_domain_a_free_one_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("ROS_DOMAIN_ID", raising=False)
    item = check_domain()
    assert 1 <= item.values["domain"] <= 100
    assert "a flight takes such a one by itself" in item.text
