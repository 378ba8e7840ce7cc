"""Fixtures for all tests; the hypothesis profile: the same examples on every run; what may lack."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

try:
    from hypothesis import HealthCheck, settings
except ImportError:
    pass  # every module that needs it is skipped
else:
    settings.register_profile(
        "ci", derandomize=True, deadline=None, suppress_health_check=[HealthCheck.too_slow]
    )
    settings.load_profile("ci")

from space_robot_control.flight.graph.domain import ros_domain
from space_robot_sim.robot import Robot

ROBOTS = Path(__file__).resolve().parent.parent / "config" / "robots"

TOOLS = ("cvxpy", "hypothesis", "mujoco", "pinocchio")
"""Of the tests only. Where `colcon test` finds one missing, the modules that use it are skipped,
whichever of their helpers imports it."""


class _MissingTool:
    """The last finder asked for a module, so only if no other has found it."""

    @staticmethod
    def find_spec(name: str, path: object = None, target: object = None) -> None:
        if name in TOOLS:
            pytest.skip(f"{name} is not installed", allow_module_level=True)


sys.meta_path.append(_MissingTool())


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
