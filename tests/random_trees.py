"""Random trees of bodies, physical ones, from a seeded generator."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from random_robots import random_inertia
from scipy.spatial.transform import Rotation

from space_robot_model.robot.inertia import inertia_tensor
from space_robot_model.robot.tree import Body, Joint, JointFriction, Spring, Tool

Array = NDArray[np.float64]

KINDS = ("revolute", "prismatic", "fixed", "passive revolute", "passive prismatic")
BASE = "hull"


def random_rotation(rng: np.random.Generator) -> Array:
    """Any turn; sometimes none, or by right angles."""
    turn = Rotation.from_quat(rng.normal(size=4))
    if rng.random() < 0.3:
        turn = Rotation.from_euler("xyz", 90 * rng.integers(-2, 3, 3), degrees=True)
    return np.eye(3) if rng.random() < 0.2 else turn.as_matrix()


def random_axis(rng: np.random.Generator) -> Array:
    """Any direction, or along x, y or z, there or back."""
    if rng.random() < 0.5:
        return np.eye(3)[rng.integers(3)] * rng.choice([-1.0, 1.0])
    axis = rng.normal(size=3)
    return axis / np.linalg.norm(axis)


def random_joint(rng: np.random.Generator, name: str, kind: str) -> Joint:
    """A joint of one of `KINDS`; its friction is its own, or not told."""
    spring, friction = None, JointFriction()
    if kind.startswith("passive"):
        spring = Spring(*rng.uniform((50.0, 0.0, -0.2), (300.0, 3.0, 0.2)).tolist())
    elif kind != "fixed" and rng.random() < 0.5:
        friction = JointFriction(0.0, float(rng.uniform(0.0, 0.5)))
    return Joint(
        name,
        kind.removeprefix("passive "),
        random_rotation(rng),
        rng.uniform(-1.0, 1.0, 3),  # type: ignore[arg-type]
        random_axis(rng),
        friction=friction,
        spring=spring,
    )


def random_bodies(rng: np.random.Generator, kinds: Sequence[str]) -> list[Body]:
    """A base and a body for each of ``kinds``, each on any one before it, told in any order.

    A body on a fixed joint may have no mass. The joint of body "b3" is "j3".
    """
    bodies = [_body(rng, BASE, 20.0)]
    for number, kind in enumerate(kinds):
        parent = bodies[rng.integers(len(bodies))].name
        massless = kind == "fixed" and rng.random() < 0.4
        joint = random_joint(rng, f"j{number}", kind)
        bodies.append(_body(rng, f"b{number}", 0.0 if massless else 1.0, parent, joint))
    rng.shuffle(bodies)  # type: ignore[arg-type]
    return bodies


def _body(
    rng: np.random.Generator, name: str, size: float, parent: str = "", joint: Joint | None = None
) -> Body:
    inertia = inertia_tensor(random_inertia(rng, size * rng.uniform(0.3, 3.0)))
    tool = Tool(f"tool of {name}", random_rotation(rng), rng.uniform(-1.0, 1.0, 3))
    return Body(
        name,
        size * float(rng.uniform(2.0, 40.0)),
        inertia,
        size * rng.uniform(-0.5, 0.5, 3),
        parent,
        joint,
        (tool,),
    )
