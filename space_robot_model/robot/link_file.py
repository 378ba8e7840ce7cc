"""Schema of a link in a robot's YAML file: its joint, its frame and its body."""

from __future__ import annotations

from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import AfterValidator, Field, ValidationInfo, field_validator, model_validator
from typing_extensions import Self

from space_robot_msgs_py.config.validation import StrictModel

from ..elementary.matrices import norm, product
from ..elementary.rotations import exact_sines_cosines, rotation_of_rpy
from .inertia import LARGEST_MASS, InertiaElements, check_inertia, inertia_tensor
from .tree import Body, Encoder, Gear, Joint, JointFriction, JointLimits, Spring

Array = NDArray[np.float64]

BASE = "base"
"""Name of the base in a robot's file."""

Number = Annotated[float, Field(ge=-1e9, le=1e9)]
"""Length, m, or angle, degrees."""
Vector = Annotated[list[Number], Field(min_length=3, max_length=3)]


def _is_direction(vector: list[float], info: ValidationInfo) -> list[float]:
    if not norm(vector) > 1e-9:
        raise ValueError(f"the {info.field_name} must not be zero")
    return vector


Direction = Annotated[Vector, AfterValidator(_is_direction)]
Coefficient = Annotated[float, Field(ge=0.0)]


class OriginFile(StrictModel):
    """A frame relative to its parent: position, m, and rotations about the parent's x, y, z."""

    xyz: Vector = Field([0.0, 0.0, 0.0])
    rpy_deg: Vector = Field([0.0, 0.0, 0.0])


class FrameFile(StrictModel):
    """A frame by modified Denavit-Hartenberg parameters, lengths in m, or by its ``origin``."""

    alpha_deg: Number = 0.0
    a: Number = 0.0
    d: Number = 0.0
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
    axis: Direction = Field([0.0, 0.0, 1.0])
    mass: Annotated[float, Field(ge=0.0, le=LARGEST_MASS)]
    inertia: InertiaElements
    com: Vector
    limits: LimitsFile = LimitsFile()
    friction: FrictionFile | None = None
    passive: PassiveFile | None = None
    drive: DriveFile | None = None

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


def body_of(link: LinkFile, parent: str) -> Body:
    """Return the body of the tree that a link defines; its parent is the body of that name."""
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
