"""The end effector's pointing error: SciPy's rotations, and what any error must fulfil."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from oracles import quaternion_of, rotation_of
from random_robots import random_quaternion, random_robot
from scipy.spatial.transform import Rotation

from space_robot.analysis.pointing import angle_between, pointing_error, rotation_angle
from space_robot_model.robot import Robot
from space_robot_model.robot.tool import tool_pose
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.samples import Timebase

SEEDS = st.integers(0, 2**32 - 1)


def log_of(robot: Robot, rng: np.random.Generator, size: float, ticks: int = 4) -> FlightLog:
    """Random desired states, and measured ones that are off by rotations of about ``size`` rad."""
    log = FlightLog.allocate(ticks, robot.joint_names, Timebase(500_000))
    log.reference_base[:] = 0.0
    desired = np.array([random_quaternion(rng) for _ in range(ticks)])
    off = Rotation.from_rotvec(size * rng.uniform(-1.0, 1.0, (ticks, 3)))
    log.reference_base[:, :4] = desired
    for k in range(ticks):
        log.quaternion[k] = quaternion_of(off[k] * rotation_of(desired[k]))
    log.reference_joints[:] = rng.uniform(-np.pi, np.pi, (ticks, 3, robot.n))
    log.joint_positions[:] = log.reference_joints[:, 0]
    log.joint_positions += size * rng.uniform(-1.0, 1.0, (ticks, robot.n))
    log.base_position[:] = rng.normal(size=(ticks, 3))
    return log


@given(SEEDS, st.integers(1, 8))
def test_equal_states_point_equally(seed: int, n: int) -> None:
    rng = np.random.default_rng(seed)
    robot = random_robot(rng, n)
    log = log_of(robot, rng, 0.0)
    log.quaternion[:] = np.where(rng.random((4, 1)) < 0.5, -1.0, 1.0) * log.reference_base[:, :4]
    error = pointing_error(log, robot)
    for figure in error[:3]:
        np.testing.assert_allclose(figure, 0.0, atol=1e-12)


@given(SEEDS, st.sampled_from([1e-9, 1e-4, 1.0]))
def test_a_common_rotation_changes_nothing(seed: int, size: float) -> None:
    rng = np.random.default_rng(seed)
    robot = random_robot(rng, 5)
    log, turn = log_of(robot, rng, size), rotation_of(random_quaternion(rng))
    before = pointing_error(log, robot)
    for k in range(log.ticks):
        log.quaternion[k] = quaternion_of(turn * rotation_of(log.quaternion[k]))
        log.reference_base[k, :4] = quaternion_of(turn * rotation_of(log.reference_base[k, :4]))
        log.base_position[k] = turn.apply(log.base_position[k])
    for figure, turned in zip(before, pointing_error(log, robot), strict=True):
        np.testing.assert_allclose(turned, figure, rtol=1e-6, atol=1e-13)


@given(SEEDS, st.sampled_from([1e-9, 1e-4, 1.0]))
def test_angles_are_scipys(seed: int, size: float) -> None:
    rng = np.random.default_rng(seed)
    robot = random_robot(rng, 6)
    log = log_of(robot, rng, size)
    error = pointing_error(log, robot)
    actual, place = tool_pose(robot, log.quaternion, log.joint_positions)
    desired, wanted = tool_pose(robot, log.reference_base[:, :4], log.reference_joints[:, 0])
    for k in range(log.ticks):
        between = Rotation.from_matrix(actual[k] @ desired[k].T)
        assert error.rotation[k] == pytest.approx(between.magnitude(), rel=1e-6, abs=1e-14)
        across = np.linalg.norm(np.cross(actual[k, :, 2], desired[k, :, 2]))
        angle = np.arctan2(across, actual[k, :, 2] @ desired[k, :, 2])
        assert error.boresight[k] == pytest.approx(angle, rel=1e-6, abs=1e-14)
        assert error.boresight[k] <= error.rotation[k] * (1.0 + 1e-6) + 1e-13
        assert error.position[k] == pytest.approx(np.linalg.norm(place[k] - wanted[k]))


@given(st.floats(0.0, np.pi), SEEDS)
def test_small_and_large_angles_are_exact(angle: float, seed: int) -> None:
    """The formula by the cosine alone would give zero below 1e-8 rad."""
    rng = np.random.default_rng(seed)
    frame = rotation_of(random_quaternion(rng))
    turned = frame * Rotation.from_euler("x", angle)
    first, second = frame.as_matrix()[np.newaxis], turned.as_matrix()[np.newaxis]
    assert angle_between(first[:, :, 2], second[:, :, 2])[0] == pytest.approx(
        angle, abs=1e-14, rel=1e-14
    )
    assert rotation_angle(first, second)[0] == pytest.approx(
        angle, abs=3e-8 if angle > 3.0 else 1e-14
    )


def test_a_roll_about_the_boresight_is_rotation_but_not_pointing(paper_robot: Robot) -> None:
    log = log_of(paper_robot, np.random.default_rng(1), 0.0)
    log.joint_positions[:, -1] += 0.01  # the paper's tool lies along the last joint's axis
    error = pointing_error(log, paper_robot)
    np.testing.assert_allclose(error.boresight, 0.0, atol=1e-12)
    np.testing.assert_allclose(error.rotation, 0.01, rtol=1e-9)
    np.testing.assert_allclose(error.position, 0.0, atol=1e-12)


def test_the_bases_drift_is_told_apart(paper_robot: Robot) -> None:
    log = log_of(paper_robot, np.random.default_rng(1), 0.0)
    log.base_position[:] = [[1.0, 1.0, 1.0], [1.0, 1.0, 1.0], [1.0, 4.0, 5.0], [1.0, 1.0, 3.0]]
    error = pointing_error(log, paper_robot)
    np.testing.assert_array_equal(error.base_drift, [0.0, 0.0, 5.0, 2.0])
    np.testing.assert_allclose(error.position, 0.0, atol=1e-12)
