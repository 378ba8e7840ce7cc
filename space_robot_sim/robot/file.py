"""The schema of a robot's YAML file, checked for physical sense."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import AfterValidator, Field

from space_robot_msgs_py.config.validation import StrictModel
from space_robot_msgs_py.topics import BASE_AXES

Array = NDArray[np.float64]


def inertia_tensor(values: list[float]) -> Array:
    """Return ``[Ixx, Iyy, Izz, Ixy, Ixz, Iyz]``, kg m2, as a symmetric (3, 3) tensor."""
    xx, yy, zz, xy, xz, yz = values
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def inertia_elements(tensors: Array) -> Array:
    """Invert `inertia_tensor`, for (..., 3, 3) tensors."""
    t = tensors
    moments = [t[..., 0, 0], t[..., 1, 1], t[..., 2, 2]]
    return np.stack([*moments, t[..., 0, 1], t[..., 0, 2], t[..., 1, 2]], axis=-1)


def _physical_inertia(values: list[float]) -> list[float]:
    moments = np.linalg.eigvalsh(inertia_tensor(values))
    if moments[0] <= 0.0:
        raise ValueError(
            f"inertia must be positive definite, its smallest principal moment is {moments[0]:g}"
        )
    if moments[2] > (moments[0] + moments[1]) * (1.0 + 1e-9):
        raise ValueError(
            "inertia must meet the triangle inequality (no principal moment above the sum of the "
            f"other two), its principal moments are {', '.join(f'{m:g}' for m in moments)}"
        )
    return values


Mass = Annotated[float, Field(gt=0.0)]
Inertia = Annotated[
    list[float], Field(min_length=6, max_length=6), AfterValidator(_physical_inertia)
]
Vector = Annotated[list[float], Field(min_length=3, max_length=3)]


class BaseFile(StrictModel):
    """``robot.base``: mass in kg, inertia about the CoM in kg m2."""

    mass: Mass
    inertia: Inertia


class LinkFile(StrictModel):
    """One entry of ``robot.links``: the joint towards the base, and the body it moves.

    Lengths in m, mass in kg, inertia about the CoM in kg m2 on the link's axes.
    """

    name: Annotated[str, Field(min_length=1)]
    alpha_deg: float
    a: float
    d: float
    mass: Mass
    inertia: Inertia
    com: Vector


class ToolFile(StrictModel):
    """``robot.tool``: from the last link's frame to the end effector's; lengths in m."""

    alpha_deg: float = 0.0
    a: float = 0.0
    d: float = 0.0


def _distinct_names(links: list[LinkFile]) -> list[LinkFile]:
    names = [link.name for link in links]
    for name in names:
        if names.count(name) > 1:
            raise ValueError(f"joint names must differ, {name!r} occurs twice")
        if name in BASE_AXES:
            raise ValueError(f"{name!r} is the name of a base axis, not of a joint")
    return links


class RobotFile(StrictModel):
    """``robot``, the whole of a robot's YAML."""

    name: Annotated[str, Field(min_length=1)]
    base: BaseFile
    links: Annotated[list[LinkFile], Field(min_length=1), AfterValidator(_distinct_names)]
    tool: ToolFile = ToolFile()


class _Document(StrictModel):
    robot: RobotFile
