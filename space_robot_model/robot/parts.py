"""The parts of a robot: what its YAML holds, what a URDF is read to, and what bags store.

One family of dataclasses. A program builds them from arrays in SI units, without checks. Files are
checked, and may give angles in degrees and frames by Denavit-Hartenberg parameters or roll, pitch
and yaw, which are converted when they are read. With ``exact: true`` numbers are those of a program
to the last bit.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import InitVar, dataclass, field, replace
from typing import TYPE_CHECKING, Annotated, Any, Literal, NamedTuple, TypeVar

import numpy as np
from pydantic import (
    AfterValidator,
    BeforeValidator,
    ConfigDict,
    Field,
    GetPydanticSchema,
    ValidationInfo,
    ValidatorFunctionWrapHandler,
    WrapValidator,
    field_validator,
    model_validator,
)
from typing_extensions import Self

from space_robot_msgs_py.config.text import choices
from space_robot_msgs_py.config.validation import short

from ..elementary.matrices import Array, norm, product
from ..elementary.rotations import exact_sines_cosines, rotation_of_rpy
from .inertia import LARGEST_MASS, InertiaElement, check_inertia, inertia_tensor
from .names import BASE, first_repeated, other_meaning

MOST_LINKS = 4000
"""Maximum number of links in a robot's file, including fixed ones."""
MANY_TURNS = 4.0 * np.pi
"""Angle of a joint that asks for a remark, rad."""
MOST_PLATES = 128
"""Maximum number of plates of a robot."""

Name = Annotated[str, Field(min_length=1)]
Real = Annotated[float, Field(strict=True)]
Number = Annotated[Real, Field(ge=-1e9, le=1e9)]
"""Length, m, or angle, degrees."""
Coefficient = Annotated[Real, Field(ge=0.0)]
Share = Annotated[Real, Field(ge=0.0, le=1.0)]
Encoder = Literal["motor", "link", "both"]


def _array(items: Any) -> GetPydanticSchema:
    """Read nested lists of checked numbers as an array."""
    return GetPydanticSchema(
        lambda _, handler: handler.generate_schema(Annotated[items, AfterValidator(np.array)])
    )


Triple = Annotated[list[Number], Field(min_length=3, max_length=3)]
Vector3 = Annotated[Array, _array(Triple)]
Matrix3 = Annotated[Array, _array(Annotated[list[Triple], Field(min_length=3, max_length=3)])]
Moments = Annotated[
    Array,
    _array(
        Annotated[
            list[Annotated[InertiaElement, Field(strict=True)]], Field(min_length=6, max_length=9)
        ]
    ),
]


class RobotPart:
    """Base class of what a file holds: no unknown keys, only an integer may stand for a float.

    The parts are dataclasses of the standard library, so that only files are validated: a robot is
    built thousands of times in a campaign, from arrays that have been checked.
    """

    __pydantic_config__ = ConfigDict(
        # YAML reads a link called 1 as a number
        extra="forbid",
        allow_inf_nan=False,
        coerce_numbers_to_str=True,
    )

    def _set(self, **values: Any) -> None:
        for name, value in values.items():
            object.__setattr__(self, name, value)


class JointLimits(NamedTuple):
    """Limits of an actuated joint; infinite if unknown."""

    lower: float = -np.inf
    """Lower limit of position, rad, or m for a prismatic joint."""
    upper: float = np.inf
    """Upper limit of position, rad or m."""
    velocity: float = np.inf
    """Limit of velocity, rad/s or m/s."""
    effort: float = np.inf
    """Limit of torque or force, N m or N."""


UNLIMITED = JointLimits()


@dataclass(frozen=True)
class LimitsInDegrees(RobotPart):
    """Limits of a joint in a file: degrees, deg/s and N m; m, m/s and N for a prismatic joint."""

    position_deg: Annotated[list[Real], Field(min_length=2, max_length=2)] | None = None
    velocity_deg: Annotated[Real, Field(gt=0.0)] | None = None
    effort: Annotated[Real, Field(gt=0.0)] | None = None

    @model_validator(mode="after")
    def _check_order(self) -> Self:
        if self.position_deg and not self.position_deg[0] < self.position_deg[1]:
            raise ValueError("position_deg must be a lower and a higher limit, in this order")
        return self


class JointFriction(NamedTuple):
    """Friction of a joint; NaN if not part of the robot: then that of the settings is used."""

    coulomb: Coefficient
    """Coulomb friction, N m, or N for a prismatic joint."""
    viscous: Coefficient
    """N m s/rad or N s/m."""


class Spring(NamedTuple):
    """Spring and damper of a passive joint: torque ``-stiffness (theta - rest) - damping v``."""

    stiffness: Coefficient
    """Stiffness, N m/rad, or N/m for a prismatic joint."""
    damping: Coefficient
    """N m s/rad or N s/m."""
    rest: Annotated[Real, Field(alias="rest_deg")] = 0.0
    """rad or m; in files degrees or m."""

    def from_degrees(self, is_prismatic: bool) -> Spring:
        """Return the spring of a file with its rest position in rad, or m as it is."""
        return self if is_prismatic else self._replace(rest=float(np.radians(self.rest)))


class Gear(NamedTuple):
    """Drive of a joint with a motor on the parent, a gear and a spring (dynamics.aba)."""

    rotor_inertia: Annotated[Real, Field(gt=0.0, le=1e6)]
    """Inertia of the rotor about its axis, kg m2; its mass and static inertia are the parent's."""
    ratio: Annotated[Real, Field(alias="gear_ratio", ge=1e-3, le=1e6)]
    """Turns of the rotor per turn of the joint; rad/m if prismatic; in files 1 by default."""
    stiffness: Annotated[Real, Field(gt=0.0, le=1e12)]
    """Stiffness between motor and link, seen on the link's side, N m/rad or N/m."""
    damping: Annotated[Real, Field(ge=0.0, le=1e9)] = 0.0
    """N m s/rad or N s/m."""
    encoder: Encoder = "motor"
    """Side on which the joint is measured; both: the laws see the link's."""

    @property
    def reflected_inertia(self) -> float:
        """``N^2 J``, kg m2 or kg."""
        return self.ratio**2 * self.rotor_inertia


def _with_gear_ratio(value: Any) -> Any:
    return {"gear_ratio": 1.0, **value} if isinstance(value, dict) else value


def _limits(
    value: Any, in_degrees: ValidatorFunctionWrapHandler, info: ValidationInfo
) -> JointLimits:
    """Read limits in degrees, or the exact ones of a program: a list, null where there is none."""
    if isinstance(value, JointLimits):
        return value
    if isinstance(value, list):
        try:
            pairs = zip(value, JointLimits(), strict=True)
            return JointLimits(*(none if own is None else float(own) for own, none in pairs))
        except (TypeError, ValueError):
            raise ValueError("lower, upper, velocity and effort were expected") from None
    read: LimitsInDegrees = in_degrees(value)
    is_prismatic = info.data.get("joint") == "prismatic"

    def number(degrees: float) -> float:
        return degrees if is_prismatic else float(np.radians(degrees))

    lower, upper = map(number, read.position_deg or (-np.inf, np.inf))
    return JointLimits(lower, upper, number(read.velocity_deg or np.inf), read.effort or np.inf)


if TYPE_CHECKING:
    Limits = JointLimits
    Colour = tuple[float, float, float, float]
else:
    Colour = Annotated[tuple[Real, ...], Field(min_length=4, max_length=4)]
    Limits = Annotated[LimitsInDegrees, WrapValidator(_limits)]


def _spring(value: Any, spring: ValidatorFunctionWrapHandler, info: ValidationInfo) -> Spring:
    """Read a spring in degrees, or the exact one of a program: a list."""
    read: Spring = spring(value)
    if isinstance(value, (Spring, list)):
        return read
    return read.from_degrees(info.data.get("joint") == "prismatic")


Drive = Annotated[Gear, BeforeValidator(_with_gear_ratio)]


def _check_direction(vector: Array, info: ValidationInfo) -> Array:
    if not norm(vector) > 1e-9:
        raise ValueError(f"the {info.field_name} must not be zero")
    return vector


Direction = Annotated[Vector3, AfterValidator(_check_direction)]


def _tensor(elements: Array, is_checked: bool = True) -> Array:
    """Return the (3, 3) tensor of the six elements in files, or of the nine of a program."""
    # nine numbers keep every bit: a tensor computed by a program is not quite symmetric
    if len(elements) == 9:
        return elements.reshape(3, 3)
    values = elements.tolist()
    if len(values) != 6:
        raise ValueError("six numbers were expected: Ixx, Iyy, Izz, Ixy, Ixz, Iyz")
    return inertia_tensor(check_inertia(values) if is_checked else values)


@dataclass(frozen=True)
class Base(RobotPart):
    """The satellite: mass in kg, inertia about the CoM in kg m2."""

    mass: Annotated[Real, Field(gt=0.0, le=LARGEST_MASS)]
    inertia: Moments
    """(3, 3) about its centre of mass; in files ``[Ixx, Iyy, Izz, Ixy, Ixz, Iyz]``."""
    com: Vector3 = field(default_factory=lambda: np.zeros(3))
    """(3,) centre of mass, m: the robot's frame is put there."""
    name: Name = BASE

    _check_inertia = field_validator("inertia", mode="after")(lambda tensor: _tensor(tensor))


@dataclass(frozen=True)
class Origin(RobotPart):
    """A frame relative to its parent: position, m, and rotations about the parent's x, y, z."""

    xyz: Vector3 = field(default_factory=lambda: np.zeros(3))
    rpy_deg: Vector3 = field(default_factory=lambda: np.zeros(3))

    @property
    def rotation(self) -> Array:
        """(3, 3) axes of the frame, as columns, in parent axes."""
        return rotation_of_rpy(np.radians(self.rpy_deg))


@dataclass(frozen=True, kw_only=True)
class Framed(RobotPart):
    """A part with a frame; in files by ``origin``, or by modified Denavit-Hartenberg parameters."""

    alpha_deg: InitVar[Number | None] = None
    a: InitVar[Number | None] = None
    d: InitVar[Number | None] = None
    origin: InitVar[Origin | None] = None

    def __post_init__(
        self, alpha_deg: float | None, a: float | None, d: float | None, origin: Origin | None
    ) -> None:
        """Take the frame of a file."""
        has_parameters = (alpha_deg, a, d) != (None, None, None)
        if origin and has_parameters:
            raise ValueError("a frame has either origin, or alpha_deg, a and d, not both")
        if origin:  # a position in parent axes; the offset is on the joint's
            rotation = origin.rotation
            self._take(rotation, product(rotation.T, origin.xyz))
        elif has_parameters:
            # Rx(alpha) Tx(a) Rz(theta) Tz(d): at zero a is along x, d along z of this frame
            s, c = exact_sines_cosines(np.radians(alpha_deg or 0.0))  # exact at right angles
            turn = np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]])
            self._take(turn, np.array([a or 0.0, 0.0, d or 0.0]))

    def _take(self, rotation: Array, offset: Array) -> None:
        """Set the frame; ``offset`` is from the parent's frame, in the axes of this one."""
        self._set(rotation=rotation, offset=offset)


@dataclass(frozen=True, kw_only=True)
class Body(Framed):
    """A body, and the joint between it and its parent; its vectors are in the axes of its frame."""

    rotation: Matrix3 = field(default_factory=lambda: np.eye(3))
    """(3, 3) axes of the frame at joint position zero, as columns, in parent axes."""
    offset: Vector3 = field(default_factory=lambda: np.zeros(3))
    """(3,) from the parent's frame to this one at zero, m, in the axes of *this* frame."""
    name: Name
    parent: str = ""
    """Name of its parent; in files that of the link before it if empty."""
    joint: Literal["revolute", "continuous", "prismatic", "fixed"] = "revolute"
    """Kind of joint; a continuous joint is a revolute one, with or without limits."""
    joint_name: str = ""
    """Name of the joint; that of the link if empty."""
    axis: Direction = field(default_factory=lambda: np.array([0.0, 0.0, 1.0]))
    """(3,) unit vector of the joint's axis."""
    mass: Annotated[Real, Field(ge=0.0, le=LARGEST_MASS)]
    """Mass, kg; 0 only for links on fixed joints."""
    inertia: Moments
    """(3, 3) about its centre of mass, kg m2; in files ``[Ixx, Iyy, Izz, Ixy, Ixz, Iyz]``."""
    com: Vector3
    """(3,) centre of mass, m."""
    limits: Limits = UNLIMITED
    friction: JointFriction | None = None
    """Friction of the joint; None: that of the settings."""
    passive: Annotated[Spring, WrapValidator(_spring)] | None = None
    """Spring of a passive joint; None for actuated and fixed joints."""
    drive: Drive | None = None
    """Gear of an actuated joint; None: the joint is rigid."""

    @property
    def joint_label(self) -> str:
        """Name of the joint."""
        return self.joint_name or self.name

    @property
    def moves(self) -> bool:
        """True if the joint is not fixed."""
        return self.joint != "fixed"

    @field_validator("mass", mode="after")
    @classmethod
    def _check_mass(cls, mass: float, info: ValidationInfo) -> float:
        if mass == 0.0 and info.data.get("joint") != "fixed":
            raise ValueError("a moving link must have a mass greater than 0")
        return mass

    @field_validator("inertia", mode="after")
    @classmethod
    def _check_inertia(cls, elements: Array, info: ValidationInfo) -> Array:
        return _tensor(elements, is_checked=info.data.get("mass") != 0.0)

    @field_validator("friction", "passive", "drive", mode="after")
    @classmethod
    def _check_moves(cls, part: Any, info: ValidationInfo) -> Any:
        if part and info.data.get("joint") == "fixed":
            raise ValueError("a fixed link cannot have friction, a spring or a drive")
        return part

    @field_validator("drive", mode="after")
    @classmethod
    def _check_motor(cls, drive: Gear | None, info: ValidationInfo) -> Gear | None:
        if drive and info.data.get("passive"):
            raise ValueError(f"{info.data.get('name')!r} is passive, only a motor can have a drive")
        return drive


def _refuse_in_files(_: Any) -> int:
    raise ValueError("unknown key: the key of a body is link")


BodyNumber = Annotated[int, BeforeValidator(_refuse_in_files), Field(exclude=True)]


@dataclass(frozen=True)
class Tool(Framed):
    """Frame of an end effector on a link."""

    name: Name = "tool"
    rotation: Matrix3 = field(default_factory=lambda: np.eye(3))
    """(3, 3) its axes, as columns, in the link's axes."""
    position: Vector3 = field(default_factory=lambda: np.zeros(3))
    """(3,) position, m, in the link's axes."""
    body: BodyNumber = 0
    """Number of its body in a `Robot`."""
    link: str = ""
    """Name of its link; in files the last one if empty."""

    def _take(self, rotation: Array, offset: Array) -> None:
        self._set(rotation=rotation, position=product(rotation, offset))


SIZES = {"box": 3, "cylinder": 2, "sphere": 1, "mesh": 3}
"""Count of the sizes of each shape."""


@dataclass(frozen=True)
class Visual(RobotPart):
    """A shape to display a link."""

    shape: Literal["box", "cylinder", "sphere", "mesh"]
    size: tuple[Real, ...]
    """m: edges x, y, z; radius and length along z; radius; or scale x, y, z of a mesh."""
    rotation: Matrix3 = field(default_factory=lambda: np.eye(3))
    """(3, 3) its axes, as columns, in the link's axes."""
    position: Vector3 = field(default_factory=lambda: np.zeros(3))
    """(3,) position, m, in the link's axes."""
    mesh: str = ""
    """File of the mesh; its name in a URDF if the file does not exist."""
    colour: Colour | None = None
    """Red, green, blue, alpha, from 0 to 1."""
    body: BodyNumber = 0
    """Number of its body in a `Robot`."""
    link: Name = BASE
    origin: InitVar[Origin | None] = None

    def __post_init__(self, origin: Origin | None) -> None:
        """Take the place of a file."""
        if origin:
            self._set(rotation=origin.rotation, position=np.array(origin.xyz))

    @model_validator(mode="after")
    def _check_shape(self) -> Self:
        is_mesh = self.shape == "mesh"
        if len(self.size) != SIZES[self.shape] or not (is_mesh or min(self.size) > 0.0):
            what = "numbers" if is_mesh else "numbers above 0"
            raise ValueError(f"size of a {self.shape}: {SIZES[self.shape]} {what} were expected")
        is_place = self.mesh.startswith("/") or "://" in self.mesh
        if is_mesh != bool(self.mesh) or is_mesh != is_place:
            raise ValueError("mesh: an absolute path or a URL was expected, of a mesh only")
        return self


@dataclass(frozen=True)
class Plate(RobotPart):
    """A flat surface of a link, seen from one side, for drag and sunlight: a panel has two."""

    area: Annotated[Real, Field(gt=0.0, le=1e6)]
    """m2."""
    normal: Direction
    """(3,) unit vector outwards, in the link's axes."""
    centre: Vector3 = field(default_factory=lambda: np.zeros(3))
    """(3,) m, in the link's axes."""
    drag_coefficient: Annotated[Real, Field(ge=0.0, le=10.0)] = 2.2
    specular: Share = 0.2
    """Share of the light that is reflected as by a mirror."""
    diffuse: Share = 0.3
    """Share that is scattered; the rest is absorbed."""
    body: BodyNumber = 0
    """Number of its body in a `Robot`."""
    link: Name = BASE

    @model_validator(mode="after")
    def _check_reflection(self) -> Self:
        if self.specular + self.diffuse > 1.0:
            raise ValueError(
                "specular and diffuse are shares of the same light: their sum must be at most 1, "
                f"it is {self.specular + self.diffuse:g}"
            )
        return self

    @property
    def normalised(self) -> Plate:
        """The same with a normal of length 1."""
        return replace(self, normal=self.normal / norm(self.normal))


Plates = Annotated[list[Plate], Field(max_length=MOST_PLATES)]
Part = TypeVar("Part", Tool, Visual, Plate)


def moved(part: Part, rotation: Array, move: Callable[[Array], Array], **names: Any) -> Part:
    """Return a part in another frame: its axes or normal turned, its origin or centre moved.

    Args:
        part: of a link.
        rotation: (3, 3) of its directions.
        move: of a position (3,), m.
        names: of its link and body there.
    """
    axes, at = ("normal", "centre") if isinstance(part, Plate) else ("rotation", "position")
    names[axes], names[at] = product(rotation, getattr(part, axes)), move(getattr(part, at))
    return replace(part, **names)


def _check_joint_names(links: list[Body]) -> list[Body]:
    names = [link.joint_label for link in links]
    if (repeated := first_repeated(names)) is not None:
        raise ValueError(f"joint names must differ, {short(repeated)} occurs twice")
    moving = [link.joint_label for link in links if link.moves]
    for name in names:
        meaning = other_meaning(name, moving) if name in moving else ""
        if name == BASE:
            meaning = "the name of the base"
        if meaning:
            raise ValueError(f"joint {short(name)} needs another name: it is {meaning}")
    return links


@dataclass(frozen=True)
class RobotTree(RobotPart):
    """A robot as its parts: a base with a tree of links, in any order if they name their parents.

    Key ``robot`` of a robot's YAML. `space_robot_model.robot.Robot` is the same as arrays.
    """

    name: Name
    base: Base
    links: Annotated[
        list[Body], Field(min_length=1, max_length=MOST_LINKS), AfterValidator(_check_joint_names)
    ]
    tool: Tool | None = None
    """The only tool, in files."""
    tools: list[Tool] = field(default_factory=list)
    """Frames of the end effectors; the first one is *the* tool."""
    plates: Plates = field(default_factory=list)
    visuals: list[Visual] = field(default_factory=list)
    exact: bool = False
    """True for the numbers of a program: the base's frame stays where it is, with any CoM."""

    @field_validator("tool", "tools", "plates", "visuals", mode="after")
    @classmethod
    def _check_links(cls, parts: Any, info: ValidationInfo) -> Any:
        what = str(info.field_name).removesuffix("s")
        if what == "tool" and isinstance(parts, list):
            if parts and info.data.get("tool"):
                raise ValueError("a robot has either tool or tools: list all of them in tools")
            if (repeated := first_repeated(tool.name for tool in parts)) is not None:
                raise ValueError(f"tool names must differ, {short(repeated)} occurs twice")
        if (links := info.data.get("links")) is None or parts is None:  # links are wrong themselves
            return parts
        names = [info.data["base"].name if "base" in info.data else BASE]
        names += [link.name for link in links]
        for number, part in enumerate(parts if isinstance(parts, list) else [parts]):
            if part.link and part.link not in names:
                raise ValueError(
                    f"unknown link {short(part.link)} of {what} {number}: "
                    f"{choices(part.link, names)}"
                )
        return parts

    @model_validator(mode="after")
    def _complete(self) -> Self:
        """Fill in what a file may leave out: parents, tools, and lengths of directions."""
        # a program has filled them in, and a division would change last bits
        if self.exact:
            return self
        links, above = [], self.base.name
        for link in self.links:
            axis = link.axis / norm(link.axis)
            links.append(replace(link, parent=link.parent or above, axis=axis))
            above = link.name
        tools = [self.tool] if self.tool else self.tools or [Tool()]
        self._set(
            links=links,
            tool=None,
            tools=[replace(tool, link=tool.link or above) for tool in tools],
            plates=[plate.normalised for plate in self.plates],
        )
        return self
