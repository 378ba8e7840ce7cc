"""The robot is data: its numbers from YAML, checked for physical sense."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.compiled.records import assign
from space_robot_msgs_py.config.validation import read_yaml, validate
from space_robot_msgs_py.topics import BASE_AXES

from ..dynamics.model import Model
from .file import _Document, inertia_elements, inertia_tensor

Array = NDArray[np.float64]


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
        file = validate(_Document, content, where).robot
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
        """Return the robot with a payload as its last link, CoM kept.

        Args:
            mass: mass of the last link, kg.
            inertia: ``[Ixx, Iyy, Izz, Ixy, Ixz, Iyz]`` about its CoM on its axes, kg m2.
        """
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
            a=self.a, d=self.d,
            cos_alpha=_exact_at_right_angles(np.cos(self.alpha)),
            sin_alpha=_exact_at_right_angles(np.sin(self.alpha)),
        )  # fmt: skip
        return model


def _exact_at_right_angles(values: Array) -> Array:
    """Rid sines and cosines of multiples of 90 degrees of the rounding error of pi."""
    rounded = np.round(values)
    return np.where(np.abs(values - rounded) < 1e-15, rounded, values)
