"""What branches hand in adds up, is taken once, and leaves nothing behind."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from random_robots import random_quaternion
from random_trees import BASE, random_bodies
from tree_oracle import TreeOracle, assert_same_dynamics, pinocchio_tree

from space_robot_model.dynamics.aba import aba
from space_robot_model.dynamics.branches import (
    accumulate,
    collect_children,
    keep_frame,
    keep_motion,
    kept_frame,
    kept_motion,
)
from space_robot_model.dynamics.kinematics import forward_kinematics, spatial_velocities
from space_robot_model.dynamics.model import Data
from space_robot_model.robot import Robot
from space_robot_model.robot.tree import Body
from space_robot_msgs_py.compiled.kernels import kernel

Array = NDArray[np.float64]


@kernel
def sum_of_branches(parts: Array, row: Array, out: Array) -> None:
    """Hand in all but the first of ``parts`` (B, 27), then take them in with the first."""
    for b in range(1, parts.shape[0]):
        p = parts[b]
        accumulate(
            row,
            (p[0], p[1], p[2], p[3], p[4], p[5]),
            (p[6], p[7], p[8], p[9], p[10], p[11], p[12], p[13], p[14]),
            (p[15], p[16], p[17], p[18], p[19], p[20]),
            (p[21], p[22], p[23]),
            (p[24], p[25], p[26]),
        )
    p = parts[0]
    j, g, m, moment, force = collect_children(
        row,
        (p[0], p[1], p[2], p[3], p[4], p[5]),
        (p[6], p[7], p[8], p[9], p[10], p[11], p[12], p[13], p[14]),
        (p[15], p[16], p[17], p[18], p[19], p[20]),
        (p[21], p[22], p[23]),
        (p[24], p[25], p[26]),
    )
    for k in range(6):
        out[k], out[15 + k] = j[k], m[k]
    for k in range(9):
        out[6 + k] = g[k]
    for k in range(3):
        out[21 + k], out[24 + k] = moment[k], force[k]


@kernel
def through_memory(frame: Array, motion: Array, rows: Array) -> None:
    """Keep a frame and a motion in rows 0 and 1, and what is read of them in rows 2 and 3."""
    f, m = frame, motion
    keep_frame(
        (f[0], f[1], f[2], f[3], f[4], f[5], f[6], f[7], f[8]), (f[9], f[10], f[11]), rows[0]
    )
    keep_motion((m[0], m[1], m[2]), (m[3], m[4], m[5]), rows[1])
    axes, origin = kept_frame(rows[0])
    angular, linear = kept_motion(rows[1])
    keep_frame(axes, origin, rows[2])
    keep_motion(angular, linear, rows[3])


@settings(max_examples=20)
@given(seed=st.integers(0, 2**32 - 1), branches=st.integers(0, 5))
def test_branches_add_up_and_are_taken_once(seed: int, branches: int) -> None:
    parts = np.random.default_rng(seed).normal(size=(1 + branches, 27))
    row, out = np.zeros(27), np.empty(27)
    sum_of_branches(parts, row, out)
    np.testing.assert_allclose(out, parts.sum(axis=0), atol=1e-14)
    np.testing.assert_array_equal(row, np.zeros(27))


def test_frames_and_motions_are_kept_as_they_are() -> None:
    frame, motion, rows = np.arange(1.0, 13.0), np.arange(13.0, 19.0), np.zeros((4, 12))
    through_memory(frame, motion, rows)
    np.testing.assert_array_equal(rows[[0, 2]], [frame, frame])
    np.testing.assert_array_equal(rows[[1, 3], :6], [motion, motion])


SHAPES: dict[str, Callable[[int], int]] = {
    "chain": lambda number: number - 1,
    "star": lambda number: -1,
    "comb": lambda number: number - 2 if number % 2 else number - 1,
    "two arms": lambda number: number - 2 if number > 1 else -1,
    "fork of forks": lambda number: (number - 1) // 2,
}
"""The number of each body's parent, -1 for the base."""


def shaped(shape: str, count: int) -> list[Body]:
    rng = np.random.default_rng(len(shape))
    kinds = [("revolute", "prismatic", "passive revolute")[k % 3] for k in range(count)]
    return [
        replace(body, parent=_name(SHAPES[shape](int(body.name[1:])))) if body.joint else body
        for body in random_bodies(rng, kinds)
    ]


def _name(number: int) -> str:
    return BASE if number < 0 else f"b{number}"


@pytest.mark.parametrize("shape", SHAPES)
def test_any_shape_moves_as_pinocchio_says(shape: str) -> None:
    bodies = shaped(shape, 14)
    robot = Robot.of_tree(shape, bodies)
    oracle = TreeOracle(pinocchio_tree(bodies), BASE, robot.all_joint_names, 7)
    assert_same_dynamics(robot, oracle, 7)


@pytest.mark.parametrize("shape", SHAPES)
def test_nothing_is_left_behind(shape: str) -> None:
    """The same memory gives the same bits again, and again after another motion."""
    robot, rng = Robot.of_tree(shape, shaped(shape, 9)), np.random.default_rng(0)
    n, data = robot.joint_count, Data.allocate(robot.joint_count)

    def acceleration(motion: tuple[Array, ...]) -> Array:
        out = np.empty(n + 6)
        quaternion, positions, omega, velocities, force = motion
        forward_kinematics(robot.model, quaternion, positions, data)
        spatial_velocities(robot.model, omega, velocities, data)
        aba(robot.model, omega, velocities, force, data, out)
        return out

    def random_motion() -> tuple[Array, ...]:
        return (random_quaternion(rng), *(rng.normal(size=size) for size in (n, 3, n, n + 6)))

    motion = random_motion()
    first = acceleration(motion)
    np.testing.assert_array_equal(acceleration(motion), first)
    acceleration(random_motion())
    np.testing.assert_array_equal(acceleration(motion), first)
    assert not data.inwards[: n + 1].any()
