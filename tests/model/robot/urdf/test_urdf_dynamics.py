"""Inertia matrix, bias force and accelerations of URDFs are those that Pinocchio reads of them."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from random_urdf import random_urdf
from tree_oracle import TreeOracle, assert_same_dynamics

from space_robot_model.robot import Robot
from space_robot_model.robot.urdf import read_urdf


@settings(max_examples=60)
@given(seed=st.integers(0, 2**32 - 2), count=st.integers(1, 12))
def test_random_trees(tmp_path_factory: pytest.TempPathFactory, seed: int, count: int) -> None:
    """Branches, fixed and prismatic joints, offsets, turned inertias, any axis, any base."""
    rng = np.random.default_rng(seed)
    text = random_urdf(rng, count)
    path = tmp_path_factory.getbasetemp() / "tree.urdf"
    path.write_text(text)
    heavy = [body.name for body in read_urdf(path).bodies if body.mass]
    for base in ("link0", str(rng.choice(heavy))):
        robot = Robot.from_urdf(path, base=base)
        model = pin.buildModelFromXML(text, pin.JointModelFreeFlyer())
        oracle = TreeOracle(model, base, robot.joint_names, seed)
        assert_same_dynamics(robot, oracle, seed)
