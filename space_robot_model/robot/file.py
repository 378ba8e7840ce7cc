"""Schema of a robot's YAML file, with checks of physical consistency."""

from __future__ import annotations

import itertools
from dataclasses import replace
from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import AfterValidator, Field, ValidationInfo, field_validator, model_validator
from typing_extensions import Self

from space_robot_msgs_py.config.choices import choices
from space_robot_msgs_py.config.validation import StrictModel, short
from space_robot_msgs_py.topics import BASE_AXES

from ..elementary.matrices import norm, product
from ..elementary.rotations import exact_sines_cosines, rotation_of_rpy
from .inertia import Inertia, Mass, check_inertia, inertia_tensor
from .tree import (
    Body,
    Encoder,
    Gear,
    Joint,
    JointFriction,
    JointLimits,
    Plate,
    Spring,
    Tool,
    first_repeated,
)

Array = NDArray[np.float64]


Vector = Annotated[list[float], Field(min_length=3, max_length=3)]
Coefficient = Annotated[float, Field(ge=0.0)]

BASE = "base"
"""Name of the base in a robot's file."""
MOST_LINKS = 4000
"""Maximum number of links in a robot's file, including fixed ones."""
MOST_PLATES = 128
"""Maximum number of plates of a robot."""


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


class DriveFile(StrictModel):
    """Drive of a joint: a motor on the parent, a gear, and a spring towards the link.

    Stiffness and damping are seen on the link's side: N m/rad and N m s/rad, or N/m and N s/m. The
    rotor's mass and its inertia at rest are part of the parent's.
    """

    rotor_inertia: Annotated[float, Field(gt=0.0, le=1e6)]
    """About its axis, kg m2."""
    gear_ratio: Annotated[float, Field(ge=1e-3, le=1e6)] = 1.0
    """Turns of the motor per turn of the joint; rad/m for a prismatic joint."""
    stiffness: Annotated[float, Field(gt=0.0, le=1e12)]
    damping: Annotated[float, Field(ge=0.0, le=1e9)] = 0.0
    encoder: Encoder = "motor"

    @property
    def gear(self) -> Gear:
        """Return the same for the tree."""
        return Gear(self.rotor_inertia, self.gear_ratio, self.stiffness, self.damping, self.encoder)


def drive_of(gear: Gear) -> dict[str, Any]:
    """Return the mapping of a `DriveFile` for a gear."""
    values = gear._asdict()
    return {
        "rotor_inertia": values.pop("rotor_inertia"),
        "gear_ratio": values.pop("ratio"),
    } | values


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
    drive: DriveFile | None = None

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

    @field_validator("friction", "passive", "drive", mode="after")
    @classmethod
    def _moves(cls, joint: StrictModel | None, info: ValidationInfo) -> StrictModel | None:
        if joint and info.data.get("joint") == "fixed":
            raise ValueError("a fixed link cannot have friction, a spring or a drive")
        return joint

    @field_validator("drive", mode="after")
    @classmethod
    def _has_motor(cls, drive: DriveFile | None, info: ValidationInfo) -> DriveFile | None:
        if drive and info.data.get("passive"):
            raise ValueError(f"{info.data.get('name')!r} is passive, only a motor can have a drive")
        return drive


class ToolFile(FrameFile):
    """``robot.tool``, or one entry of ``robot.tools``: an end effector's frame on a link."""

    name: Annotated[str, Field(min_length=1)] = "tool"
    link: str = ""
    """Name of the link; the last one in the file if empty."""


class PlateFile(StrictModel):
    """One entry of ``robot.plates``: a flat surface on a link, for drag and sunlight.

    Area in m2, centre in m, both vectors in the link's frame; a panel has one plate a side.
    """

    link: Annotated[str, Field(min_length=1)] = BASE
    area: Annotated[float, Field(gt=0.0, le=1e6)]
    normal: Vector
    centre: Vector = Field([0.0, 0.0, 0.0])
    drag_coefficient: Annotated[float, Field(ge=0.0, le=10.0)] = 2.2
    specular: Annotated[float, Field(ge=0.0, le=1.0)] = 0.2
    diffuse: Annotated[float, Field(ge=0.0, le=1.0)] = 0.3

    @field_validator("normal", mode="after")
    @classmethod
    def _is_direction(cls, normal: list[float]) -> list[float]:
        if not norm(normal) > 1e-9:
            raise ValueError("the normal must not be zero")
        return normal

    @model_validator(mode="after")
    def _reflects_what_comes(self) -> Self:
        if self.specular + self.diffuse > 1.0:
            raise ValueError(
                "specular and diffuse are shares of the same light: their sum must be at most 1, "
                f"it is {self.specular + self.diffuse:g}"
            )
        return self

    @property
    def plate(self) -> Plate:
        """Return the same for the tree."""
        return Plate(
            self.area,
            np.array(self.normal) / norm(self.normal),
            np.array(self.centre),
            self.drag_coefficient,
            self.specular,
            self.diffuse,
        )


Plates = Annotated[list[PlateFile], Field(max_length=MOST_PLATES)]


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
    plates: Plates = Field([])

    @field_validator("plates", mode="after")
    @classmethod
    def _are_on_links(cls, plates: list[PlateFile], info: ValidationInfo) -> list[PlateFile]:
        if (links := info.data.get("links")) is None:  # they are wrong themselves
            return plates
        names = [BASE, *(link.name for link in links)]
        for number, plate in enumerate(plates):
            if plate.link not in names:
                advice = choices(plate.link, names)
                raise ValueError(f"unknown link {short(plate.link)} of plate {number}: {advice}")
        return plates

    def bodies(self) -> list[Body]:
        """Return the bodies of the tree defined by the file."""
        tools = [*([self.tool] if self.tool else []), *self.tools] or [ToolFile()]
        last = self.links[-1].name
        base = Body(BASE, self.base.mass, inertia_tensor(self.base.inertia), np.zeros(3))
        bodies = [replace(base, tools=_tools_of(BASE, tools, last), plates=self._plates(BASE))]
        for above, link in itertools.pairwise((None, *self.links)):
            assert link
            above_name = above.name if above else BASE
            body = _body(link, link.parent or above_name)
            on_link = _tools_of(link.name, tools, last)
            bodies.append(replace(body, tools=on_link, plates=self._plates(link.name)))
        return bodies

    def _plates(self, link: str) -> tuple[Plate, ...]:
        return tuple(plate.plate for plate in self.plates if plate.link == link)


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
        Joint(
            link.name,
            kind,
            link.rotation,
            link.offset,
            axis,
            limits,
            friction,
            spring,
            link.drive.gear if link.drive else None,
        ),
    )


class _RobotDocument(StrictModel):
    robot: RobotFile
