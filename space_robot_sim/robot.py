"""The robot is data: its numbers from YAML, checked for physical sense."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray
from pydantic import AfterValidator, Field

from space_robot_msgs_py.topics import BASE_AXES
from space_robot_msgs_py.validation import Strict, check, read_yaml

from .dynamics.model import Model
from .records import assign

Array = NDArray[np.float64]


def inertia_tensor(values: list[float]) -> Array:
    """``[Ixx, Iyy, Izz, Ixy, Ixz, Iyz]`` as a symmetric (3, 3) matrix (tensor elements, kg m2)."""
    xx, yy, zz, xy, xz, yz = values
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def inertia_elements(tensors: Array) -> Array:
    """The inverse of `inertia_tensor`, for (..., 3, 3) tensors."""
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


class BaseFile(Strict):
    """``robot.base``."""

    mass: Mass
    inertia: Inertia


class LinkFile(Strict):
    """One entry of ``robot.links``: the joint towards the base, and the body it moves."""

    name: Annotated[str, Field(min_length=1)]
    alpha_deg: float
    a: float
    d: float
    mass: Mass
    inertia: Inertia
    com: Vector


class ToolFile(Strict):
    """``robot.tool``: from the last link's frame to the end effector's."""

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


class RobotFile(Strict):
    """``robot``, the whole of a robot's YAML."""

    name: Annotated[str, Field(min_length=1)]
    base: BaseFile
    links: Annotated[list[LinkFile], Field(min_length=1), AfterValidator(_distinct_names)]
    tool: ToolFile = ToolFile()


class _Document(Strict):
    robot: RobotFile


@dataclass(frozen=True)
class Robot:
    """A satellite base with a serial arm of n revolute joints (modified Denavit-Hartenberg)."""

    name: str
    joint_names: tuple[str, ...]
    mass: Array
    """(n+1,) kg, base first."""
    inertia: Array
    """(n+1, 3, 3) kg m2 about each body's CoM, in its frame."""
    com: Array
    """(n+1, 3) m, ``a_i`` in frame i; the base's frame sits at its CoM."""
    alpha: Array
    """(n,) rad, ``alpha_{i-1}``."""
    a: Array
    """(n,) m, ``a_{i-1}``."""
    d: Array
    """(n,) m, ``d_i``."""
    tool: tuple[float, float, float]
    """``(alpha rad, a m, d m)`` from the last link to the end effector."""

    @property
    def n(self) -> int:
        """Number of joints."""
        return len(self.joint_names)

    @property
    def axis_names(self) -> tuple[str, ...]:
        """Names of the n+3 controlled coordinates: base x, y, z, then the joints."""
        return BASE_AXES + self.joint_names

    @classmethod
    def from_yaml(cls, path: str | Path) -> Robot:
        """Read and check a robot file.

        Raises:
            InputError: naming file, key, value given and values allowed.
        """
        return cls.from_dict(read_yaml(Path(path)), where=str(path))

    @classmethod
    def from_dict(cls, content: dict[str, Any], where: str = "robot") -> Robot:
        """Build from the mapping a robot file holds (key ``robot`` at its top)."""
        file = check(_Document, content, where).robot
        links = file.links
        return cls(
            name=file.name,
            joint_names=tuple(link.name for link in links),
            mass=np.array([file.base.mass, *(link.mass for link in links)]),
            inertia=np.array(
                [inertia_tensor(i) for i in (file.base.inertia, *(k.inertia for k in links))]
            ),
            com=np.array([[0.0, 0.0, 0.0], *(link.com for link in links)]),
            alpha=np.radians([link.alpha_deg for link in links]),
            a=np.array([link.a for link in links]),
            d=np.array([link.d for link in links]),
            tool=(float(np.radians(file.tool.alpha_deg)), file.tool.a, file.tool.d),
        )

    def with_last_link(self, mass: float, inertia: list[float]) -> Robot:
        """The same robot with another mass and inertia of its last link (a payload), CoM kept."""
        masses, tensors = self.mass.copy(), self.inertia.copy()
        masses[-1], tensors[-1] = mass, inertia_tensor(inertia)
        return Robot(
            self.name, self.joint_names, masses, tensors, self.com, self.alpha, self.a, self.d,
            self.tool,
        )  # fmt: skip

    @cached_property
    def model(self) -> Model:
        """The numbers in the form the compiled algorithms read."""
        model = Model.allocate(self.n)
        assign(
            model, mass=self.mass, inertia=inertia_elements(self.inertia), com=self.com,
            joint_x=self.a, joint_z=self.d,
            twist_cos=_exact_at_right_angles(np.cos(self.alpha)),
            twist_sin=_exact_at_right_angles(np.sin(self.alpha)),
        )  # fmt: skip
        return model


def _exact_at_right_angles(values: Array) -> Array:
    """Cos and sin of multiples of 90 degrees without the rounding error of pi."""
    rounded = np.round(values)
    return np.where(np.abs(values - rounded) < 1e-15, rounded, values)
