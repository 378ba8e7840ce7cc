"""Fixtures for all tests, and the hypothesis profile: the same examples on every run."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings

from space_robot_control.flight.domain import ros_domain
from space_robot_sim.robot import Robot

ROBOTS = Path(__file__).resolve().parent.parent / "config" / "robots"

settings.register_profile(
    "ci", derandomize=True, deadline=None, suppress_health_check=[HealthCheck.too_slow]
)
settings.load_profile("ci")


@pytest.fixture(scope="session")
def paper_robot() -> Robot:
    """The satellite with the 6-joint arm of Tables II and III."""
    return Robot.from_yaml(ROBOTS / "paper.yaml")


@pytest.fixture(scope="session")
def seven_joint_robot() -> Robot:
    """A smaller satellite with 7 joints and products of inertia."""
    return Robot.from_yaml(ROBOTS / "seven_joint.yaml")


@pytest.fixture
def domain(monkeypatch: pytest.MonkeyPatch) -> Iterator[int]:
    """A ROS domain of the test's own."""
    monkeypatch.delenv("ROS_DOMAIN_ID", raising=False)
    with ros_domain() as number:
        yield number
