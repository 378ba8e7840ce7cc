"""Random samples as the nodes exchange them, and ROS's own types, where it is installed."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from space_robot_msgs_py import topics
from space_robot_msgs_py.samples import STATE_FIELDS, RobotState, Timebase

TIMEBASE = Timebase(500_000)
JOINTS, BASE = topics.JOINT_STATES, topics.BASE_STATE
BASE_AXES = ["base_x", "base_y", "base_z"]


def joint_names(n: int) -> list[str]:
    """Of different lengths, so that everything behind them is aligned differently."""
    return [f"j{'x' * (i * n % 5)}{i}" for i in range(n)]


def random_sample(n: int, seed: int, tick: int = 4001) -> RobotState:
    rng = np.random.default_rng(seed)
    state = RobotState.allocate(n)
    state.tick = tick
    for name in STATE_FIELDS:
        getattr(state, name)[:] = rng.normal(size=getattr(state, name).shape)
    return state


def assert_same(actual: RobotState, expected: RobotState) -> None:
    for name in STATE_FIELDS:
        np.testing.assert_array_equal(getattr(actual, name), getattr(expected, name), name)


def serialization() -> Any:
    return pytest.importorskip("rclpy.serialization")


def ros_type(type_name: str) -> Any:
    package, _, name = type_name.split("/")
    return getattr(pytest.importorskip(f"{package}.msg"), name)
