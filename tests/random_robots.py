"""Random robots and states, physical ones, from a seeded generator."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from space_robot_model.robot import Robot

Array = NDArray[np.float64]

JOINTS = (1, 3, 6, 7)
"""Numbers of joints of random robots."""


class State(NamedTuple):
    """Position and velocity of a robot, base velocities on inertial axes."""

    quaternion: Array
    theta: Array
    v0: Array
    w0: Array
    rate: Array

    @property
    def velocity(self) -> Array:
        """``[v0, w0, thetadot]``."""
        return np.concatenate([self.v0, self.w0, self.rate])


def random_quaternion(rng: np.random.Generator) -> Array:
    """Uniform on the sphere, so large turns are the rule."""
    quaternion = rng.normal(size=4)
    return quaternion / np.linalg.norm(quaternion)


def random_inertia(rng: np.random.Generator, scale: float) -> list[float]:
    """``[Ixx, Iyy, Izz, Ixy, Ixz, Iyz]`` of a solid body: second moments on turned axes."""
    second = rng.uniform(0.1, 1.0, 3) * scale
    axes = Rotation.from_quat(rng.normal(size=4)).as_matrix()
    tensor = axes @ np.diag(second.sum() - second) @ axes.T
    return [float(tensor[ij]) for ij in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))]


def random_robot_file(rng: np.random.Generator, n: int) -> dict[str, Any]:
    """What the YAML file of a random robot with ``n`` joints holds."""
    return {
        "robot": {
            "name": f"random{n}",
            "base": {
                "mass": float(rng.uniform(50.0, 1000.0)),
                "inertia": random_inertia(rng, rng.uniform(20.0, 200.0)),
            },
            "links": [
                {
                    "name": f"joint{i + 1}",
                    "alpha_deg": float(rng.uniform(-180.0, 180.0)),
                    "a": float(rng.uniform(-1.0, 3.0)),
                    "d": float(rng.uniform(-1.0, 2.0)),
                    "mass": float(rng.uniform(2.0, 40.0)),
                    "inertia": random_inertia(rng, rng.uniform(0.3, 3.0)),
                    "com": rng.uniform(-1.0, 1.0, 3).tolist(),
                }
                for i in range(n)
            ],
        }
    }


def random_robot(rng: np.random.Generator, n: int) -> Robot:
    """A physical robot with ``n`` joints, any twist, products of inertia, CoMs off the axes."""
    return Robot.from_dict(random_robot_file(rng, n))


def random_state(rng: np.random.Generator, n: int) -> State:
    """Any attitude and posture, velocities of some rad/s."""
    return State(
        quaternion=random_quaternion(rng),
        theta=rng.uniform(-np.pi, np.pi, n),
        v0=rng.normal(size=3),
        w0=rng.normal(size=3),
        rate=2.0 * rng.normal(size=n),
    )


class Case(NamedTuple):
    """A robot, its state, and the generator that made them, for whatever else is needed."""

    robot: Robot
    state: State
    rng: np.random.Generator


@st.composite
def cases(draw: st.DrawFn, joints: Sequence[int] = JOINTS) -> Case:
    """Hypothesis strategy: robots with one of these numbers of joints in random states."""
    n = draw(st.sampled_from(joints))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    return Case(random_robot(rng, n), random_state(rng, n), rng)


@st.composite
def branched_cases(draw: st.DrawFn, joints: Sequence[int] = JOINTS) -> Case:
    """As `cases`: of trees, whose joints turn and slide and are in the order of visiting."""
    n = draw(st.sampled_from(joints))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    path, parents = [0], []
    for joint in range(n):  # each on the body before it, or on one that this one is on
        path = path[: rng.integers(1, len(path) + 1)]
        parents.append(path[-1])
        path.append(joint + 1)
    robot = replace(
        random_robot(rng, n), parent=np.array(parents), is_prismatic=rng.random(n) < 0.3
    )
    return Case(robot, random_state(rng, n), rng)
