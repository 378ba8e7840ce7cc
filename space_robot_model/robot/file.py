"""Schema of a robot's YAML file, with checks of physical consistency."""

from __future__ import annotations

import itertools
from dataclasses import replace
from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import AfterValidator, Field, ValidationInfo, field_validator, model_validator
from typing_extensions import Self

from space_robot_msgs_py.config.validation import StrictModel, short
from space_robot_msgs_py.topics import BASE_AXES

from ..elementary.matrices import norm, product
from ..elementary.rotations import exact_sines_cosines, rotation_of_rpy
from .inertia import Inertia, Mass, check_inertia, inertia_tensor
from .tree import Body, Joint, JointFriction, JointLimits, Spring, Tool, first_repeated

Array = NDArray[np.float64]


Vector = Annotated[list[float], Field(min_length=3, max_length=3)]
Coefficient = Annotated[float, Field(ge=0.0)]

BASE = "base"
"""Name of the base in a robot's file."""
MOST_LINKS = 4000
"""Maximum number of links in a robot's file, including fixed ones."""


class BaseFile(StrictModel):
    """``robot.base``: mass in kg, inertia about the CoM in kg m2."""

    mass: Mass
    inertia: Inertia


class OriginFile(StrictModel):
    """A frame relative to its parent: position, m, and rotations about the parent's x, y, z."""

    xyz: Vector = Field([0.0, 0.0, 0.0])
    rpy_deg: Vector = Field([0.0, 0.0, 0.0])


class FrameFile(StrictModel):
    """A frame by modified Denavit-Hartenberg parameters, lengths in m, or by its ``origin``."""

    alpha_deg: float = 0.0
    a: float = 0.0
    d: float = 0.0
    origin: OriginFile | None = None

    @model_validator(mode="after")
    def _one_way(self) -> Self:
        if self.origin and self.model_fields_set & {"alpha_deg", "a", "d"}:
            raise ValueError("a frame has either origin, or alpha_deg, a and d, not both")
        return self

    @property
    def rotation(self) -> Array:
        """(3, 3) axes of the frame, as columns, in parent axes; exact at right angles."""
        if self.origin:
            return rotation_of_rpy(np.radians(self.origin.rpy_deg))
        s, c = exact_sines_cosines(np.radians(self.alpha_deg))
        return np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]])

    @property
    def offset(self) -> Array:
        """(3,) position relative to the parent's frame, in the axes of this frame, m."""
        if self.origin:
            return product(self.rotation.T, self.origin.xyz)
        return np.array([self.a, 0.0, self.d])


class LimitsFile(StrictModel):
    """Limits of a joint in degrees, deg/s and N m; m, m/s and N for a prismatic joint."""

    position_deg: Annotated[list[float], Field(min_length=2, max_length=2)] | None = None
    velocity_deg: Annotated[float, Field(gt=0.0)] | None = None
    effort: Annotated[float, Field(gt=0.0)] | None = None

    @model_validator(mode="after")
    def _in_order(self) -> Self:
        if self.position_deg and not self.position_deg[0] < self.position_deg[1]:
            raise ValueError("position_deg must be a lower and a higher limit, in this order")
        return self


class FrictionFile(StrictModel):
    """Friction of a joint, instead of that of the settings: N m and N m s/rad, or N and N s/m."""

    coulomb: Coefficient
    viscous: Coefficient


class PassiveFile(StrictModel):
    """Spring and damper of a passive joint: N m/rad and N m s/rad, or N/m and N s/m."""

    stiffness: Coefficient
    damping: Coefficient
    rest_deg: float = 0.0


class LinkFile(FrameFile):
    """One entry of ``robot.links``: a joint, its frame on the parent, and the body it moves.

    Lengths in m, mass in kg, inertia about the CoM in kg m2 in the link's axes. Without
    ``parent`` the parent is the previous link in the file, or the base for the first link.
    """

    name: Annotated[str, Field(min_length=1)]
    parent: str = ""
    joint: Literal["revolute", "continuous", "prismatic", "fixed"] = "revolute"
    axis: Vector = Field([0.0, 0.0, 1.0])
    mass: Annotated[float, Field(ge=0.0)]
    inertia: Annotated[list[float], Field(min_length=6, max_length=6)]
    com: Vector
    limits: LimitsFile = LimitsFile()
    friction: FrictionFile | None = None
    passive: PassiveFile | None = None

    @field_validator("axis", mode="after")
    @classmethod
    def _is_direction(cls, axis: list[float]) -> list[float]:
        if not norm(axis) > 1e-9:
            raise ValueError("the axis must not be zero")
        return axis

    @field_validator("mass", mode="after")
    @classmethod
    def _moves_mass(cls, mass: float, info: ValidationInfo) -> float:
        if mass == 0.0 and info.data.get("joint") != "fixed":
            raise ValueError("a moving link must have a mass greater than 0")
        return mass

    @field_validator("inertia", mode="after")
    @classmethod
    def _is_physical(cls, inertia: list[float], info: ValidationInfo) -> list[float]:
        return inertia if info.data.get("mass") == 0.0 else check_inertia(inertia)

    @field_validator("friction", "passive", mode="after")
    @classmethod
    def _moves(cls, joint: StrictModel | None, info: ValidationInfo) -> StrictModel | None:
        if joint and info.data.get("joint") == "fixed":
            raise ValueError("a fixed link cannot have friction or a spring")
        return joint


class ToolFile(FrameFile):
    """``robot.tool``, or one entry of ``robot.tools``: an end effector's frame on a link."""

    name: Annotated[str, Field(min_length=1)] = "tool"
    link: str = ""
    """Name of the link; the last one in the file if empty."""


def _distinct_names(links: list[LinkFile]) -> list[LinkFile]:
    names = [link.name for link in links]
    if (repeated := first_repeated(names)) is not None:
        raise ValueError(f"joint names must differ, {short(repeated)} occurs twice")
    for name in names:
        if name in BASE_AXES:
            raise ValueError(f"{name!r} is the name of a base axis, not of a joint")
        if name == BASE:
            raise ValueError(f"{name!r} is the name of the base, not of a joint")
    return links


class RobotFile(StrictModel):
    """Key ``robot`` of a robot's YAML."""

    name: Annotated[str, Field(min_length=1)]
    base: BaseFile
    links: Annotated[
        list[LinkFile], Field(min_length=1, max_length=MOST_LINKS), AfterValidator(_distinct_names)
    ]
    tool: ToolFile | None = None
    tools: list[ToolFile] = Field([])

    def bodies(self) -> list[Body]:
        """Return the bodies of the tree defined by the file."""
        tools = [*([self.tool] if self.tool else []), *self.tools] or [ToolFile()]
        last = self.links[-1].name
        base = Body(BASE, self.base.mass, inertia_tensor(self.base.inertia), np.zeros(3))
        bodies = [replace(base, tools=_tools_of(BASE, tools, last))]
        for above, link in itertools.pairwise((None, *self.links)):
            assert link
            above_name = above.name if above else BASE
            body = _body(link, link.parent or above_name)
            bodies.append(replace(body, tools=_tools_of(link.name, tools, last)))
        return bodies


def _tools_of(body: str, tools: list[ToolFile], last: str) -> tuple[Tool, ...]:
    return tuple(
        Tool(tool.name, tool.rotation, product(tool.rotation, tool.offset), rank=rank)
        for rank, tool in enumerate(tools)
        if (tool.link or last) == body
    )


def _body(link: LinkFile, parent: str) -> Body:
    kind = "revolute" if link.joint == "continuous" else link.joint
    is_prismatic, own_limits = kind == "prismatic", link.limits

    def number(value: float) -> float:
        return value if is_prismatic else float(np.radians(value))

    limits = JointLimits(effort=own_limits.effort or np.inf)
    if own_limits.position_deg:
        lower, upper = (number(value) for value in own_limits.position_deg)
        limits = limits._replace(lower=lower, upper=upper)
    if own_limits.velocity_deg:
        limits = limits._replace(velocity=number(own_limits.velocity_deg))
    spring, friction = None, JointFriction()
    if link.passive:
        p = link.passive
        spring = Spring(p.stiffness, p.damping, number(p.rest_deg))
    if link.friction:
        friction = JointFriction(link.friction.coulomb, link.friction.viscous)
    axis = np.array(link.axis) / norm(link.axis)
    return Body(
        link.name,
        link.mass,
        inertia_tensor(link.inertia),
        np.array(link.com),
        parent,
        Joint(link.name, kind, link.rotation, link.offset, axis, limits, friction, spring),
    )


class _RobotDocument(StrictModel):
    robot: RobotFile
