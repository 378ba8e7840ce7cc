"""A target before its capture: laws of conservation, and the hand that it moves with."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from moving_logs import moving_log
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from space_robot.view.free_body import FreeBody, before_capture, held_poses
from space_robot_model.robot import Robot
from space_robot_sim.environment.events import Capture
from space_robot_sim.environment.grasp import Grasp
from space_robot_sim.environment.target import Target

Array = NDArray[np.float64]


def rotations(quaternions: Array) -> Array:
    axes: Array = Rotation.from_quat(quaternions, scalar_first=True).as_matrix()
    return axes


@settings(max_examples=20)
@given(st.integers(0, 10_000))
def test_nothing_acts_on_it(seed: int) -> None:
    """Momentum and energy stay, and the attitude's own rate is the angular velocity's."""
    rng = np.random.default_rng(seed)
    turned = Rotation.random(rng=rng).as_matrix()
    inertia = turned @ np.diag([2.0, 3.0, 4.5]) @ turned.T
    body = FreeBody(
        rng.normal(size=3),
        Rotation.random(rng=rng).as_matrix(),
        rng.normal(size=3),
        rng.normal(size=3),
        inertia,
    )
    step = 1e-3
    times = np.array([-6.0, -3.0 - step, -3.0, -3.0 + step, 0.0])
    positions, quaternions = body.poses(times)
    np.testing.assert_allclose(positions, body.position + np.outer(times, body.velocity))
    axes = rotations(quaternions)
    np.testing.assert_allclose(axes[-1], body.rotation, atol=1e-8)
    rate = Rotation.from_matrix(axes[3] @ axes[1].T).as_rotvec() / (2.0 * step)

    def momentum(axes: Array, rate: Array) -> Array:
        return np.asarray(axes @ inertia @ axes.T @ rate)

    kept = momentum(body.rotation, body.angular_velocity)
    np.testing.assert_allclose(momentum(axes[2], rate), kept, atol=1e-4)
    assert rate @ kept == pytest.approx(body.angular_velocity @ kept, rel=1e-4)


def capture(relative_to: str, velocity: list[float], rate: list[float]) -> Capture:
    content = {
        "name": "box",
        "mass": 3.0,
        "inertia": [1.0, 2.0, 2.5, 0.1, 0.0, -0.2],
        "place": {"position": [0.1, -0.2, 0.3], "quaternion": [0.6, 0.0, 0.8, 0.0]},
        "motion": {"relative_to": relative_to, "velocity": velocity, "angular_velocity": rate},
    }
    return Capture(0.0051, Target.from_dict({"target": content}))


def test_what_stands_still_in_the_hand_is_in_it_a_tick_before(paper_robot: Robot) -> None:
    log = moving_log(paper_robot, 12, first_tick=3)
    event = capture("tool", [0.0] * 3, [0.0] * 3)  # counts from tick 11, row 8
    body = before_capture(event, log, paper_robot)
    assert body is not None
    positions, axes = held_poses(Grasp.of(paper_robot, event.target), log, paper_robot)
    shown, quaternions = body.poses(np.array([-log.timebase.period, 0.0]))
    np.testing.assert_allclose(shown, positions[7:9], atol=1e-9)
    np.testing.assert_allclose(rotations(quaternions)[1], axes[8], atol=1e-7)
    turned = Rotation.from_matrix(axes[8] @ axes[7].T).as_rotvec() / log.timebase.period
    np.testing.assert_allclose(body.angular_velocity, turned)


def test_what_moves_in_the_tools_axes_and_in_inertial_ones(paper_robot: Robot) -> None:
    turned = Rotation.from_rotvec([0.3, -0.5, 0.8]).as_matrix()
    robot = replace(paper_robot, tools=(replace(paper_robot.tool, rotation=turned),))
    log = moving_log(robot, 12, first_tick=3)
    velocity, rate = [0.1, 0.2, -0.3], [0.4, -0.5, 0.6]
    still, moved, inertial = (
        before_capture(capture(*motion), log, robot)
        for motion in (
            ("tool", [0.0] * 3, [0.0] * 3),
            ("tool", velocity, rate),
            ("inertial", velocity, rate),
        )
    )
    assert still
    assert moved
    assert inertial
    np.testing.assert_array_equal(inertial.velocity, velocity)
    np.testing.assert_array_equal(inertial.angular_velocity, rate)
    tool = still.rotation @ turned
    np.testing.assert_allclose(moved.velocity - still.velocity, tool @ velocity, atol=1e-9)
    added = moved.angular_velocity - still.angular_velocity
    np.testing.assert_allclose(added, tool @ rate, atol=1e-9)


def test_what_the_bag_does_not_know(paper_robot: Robot) -> None:
    event = capture("inertial", [0.0] * 3, [0.0] * 3)
    for ticks, first_tick in ((8, 3), (12, 11), (12, 30)):
        assert (
            before_capture(event, moving_log(paper_robot, ticks, first_tick), paper_robot) is None
        )
    log = moving_log(paper_robot, 12, 3)
    log.joint_positions[7] = np.nan
    assert before_capture(event, log, paper_robot) is None
