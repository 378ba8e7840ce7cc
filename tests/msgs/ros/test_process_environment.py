"""The environment of ROS processes."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

from space_robot_msgs_py.ros.process_environment import DEFAULTS, defaults

HOMES = ("HOME", "ROS_HOME", "ROS_LOG_DIR")


@pytest.mark.parametrize("name", HOMES)
def test_who_has_a_home_keeps_it(monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    for other in HOMES:
        monkeypatch.delenv(other, raising=False)
    monkeypatch.setenv(name, "/somewhere")
    assert defaults() == DEFAULTS


@pytest.mark.parametrize("home", [None, ""])
def test_ros_starts_without_a_home(home: str | None) -> None:
    """ROS itself wants a folder for its log files."""
    pytest.importorskip("rclpy")
    environment = {k: v for k, v in os.environ.items() if k not in HOMES}
    program = (
        "from space_robot.flight.graph.temporary_node import TemporaryNode;"
        f"TemporaryNode('nobody', {os.getpid() % 100}).leave()"
    )
    result = subprocess.run(
        [sys.executable, "-c", program],
        check=False,
        capture_output=True,
        text=True,
        env={**environment, **({} if home is None else {"HOME": home})},
    )
    assert result.returncode == 0, result.stderr
