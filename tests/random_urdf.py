"""Random URDF texts, physical ones, from a seeded generator."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from random_robots import random_inertia

Array = NDArray[np.float64]

MOVING = ("revolute", "continuous", "prismatic")
KINDS = (*MOVING, "fixed")
NAMES = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")


def words(values: Array | list[float]) -> str:
    """Numbers with all their digits."""
    return " ".join(repr(float(value)) for value in values)


def random_origin(rng: np.random.Generator) -> str:
    """Any place and turn; sometimes none, sometimes a right angle."""
    if rng.random() < 0.2:
        return ""
    rpy = rng.uniform(-np.pi, np.pi, 3)
    if rng.random() < 0.3:
        rpy = 0.5 * np.pi * rng.integers(-2, 3, 3)
    return f'<origin xyz="{words(rng.uniform(-1.0, 1.0, 3))}" rpy="{words(rpy)}"/>'


def random_axis(rng: np.random.Generator) -> Array:
    """Any direction, or along x, y or z, there or back."""
    if rng.random() < 0.5:
        return np.eye(3)[rng.integers(3)] * rng.choice([-1.0, 1.0])
    axis = rng.normal(size=3)
    return axis / np.linalg.norm(axis)


def random_inertial(rng: np.random.Generator, size: float = 1.0) -> str:
    """The ``<inertial>`` of a solid body, its axes turned."""
    values = random_inertia(rng, size * rng.uniform(0.3, 3.0))
    moments = " ".join(f'{name}="{value!r}"' for name, value in zip(NAMES, values, strict=True))
    mass = float(size * rng.uniform(2.0, 40.0))
    return f'<inertial>{random_origin(rng)}<mass value="{mass!r}"/><inertia {moments}/></inertial>'


def random_urdf(rng: np.random.Generator, count: int) -> str:
    """A tree of ``count`` links beside the base: branches, and joints of all kinds.

    The first joint moves. A link behind a fixed joint may have no mass; links and joints are told
    in any order.
    """
    parts = [f'<link name="link0">{random_inertial(rng, 20.0)}</link>']
    for number in range(1, count + 1):
        kind = str(rng.choice(KINDS if number > 1 else MOVING))
        massless = kind == "fixed" and rng.random() < 0.5
        inertial = "" if massless else random_inertial(rng)
        parts.append(f'<link name="link{number}">{inertial}</link>')
        limit = '<limit lower="-2" upper="3" velocity="1" effort="9"/>'
        parts.append(
            f'<joint name="joint{number}" type="{kind}">{random_origin(rng)}'
            f'<parent link="link{rng.integers(number)}"/><child link="link{number}"/>'
            f'<axis xyz="{words(random_axis(rng))}"/>'
            f"{limit if kind in ('revolute', 'prismatic') else ''}</joint>"
        )
    rng.shuffle(parts)
    return '<robot name="random">\n' + "\n".join(parts) + "\n</robot>\n"
