"""A robot as in files: bodies in any order, joints with any axis, fixed joints."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
JointKind = Literal["revolute", "prismatic", "fixed"]
Encoder = Literal["motor", "link", "both"]


MANY_TURNS = 4.0 * np.pi
"""Angle of a joint that asks for a remark, rad."""


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


class JointFriction(NamedTuple):
    """Friction of a joint; NaN if not part of the robot: then that of the settings is used."""

    coulomb: float = np.nan
    """Coulomb friction, N m, or N for a prismatic joint."""
    viscous: float = np.nan
    """N m s/rad or N s/m."""


class Spring(NamedTuple):
    """Spring and damper of a passive joint: torque ``-stiffness (theta - rest) - damping v``."""

    stiffness: float
    """Stiffness, N m/rad, or N/m for a prismatic joint."""
    damping: float
    """N m s/rad or N s/m."""
    rest: float = 0.0
    """rad or m."""


class Gear(NamedTuple):
    """Drive of a joint with a motor on the parent, a gear and a spring (dynamics.kinematics)."""

    rotor_inertia: float
    """Inertia of the rotor about its axis, kg m2; its mass and static inertia are the parent's."""
    ratio: float
    """Turns of the rotor per turn of the joint; rad/m for a prismatic joint."""
    stiffness: float
    """Stiffness between motor and link, seen on the link's side, N m/rad or N/m."""
    damping: float = 0.0
    """N m s/rad or N s/m."""
    encoder: Encoder = "motor"
    """Side on which the joint is measured; both: the laws see the link's."""

    @property
    def reflected_inertia(self) -> float:
        """``N^2 J``, kg m2 or kg."""
        return self.ratio**2 * self.rotor_inertia


NO_LIMITS, USUAL_FRICTION = JointLimits(), JointFriction()


@dataclass(frozen=True)
class Joint:
    """Joint between a body and its parent."""

    name: str
    kind: JointKind = "revolute"
    """Kind of joint; a continuous joint is a revolute one without limits of position."""
    rotation: Array = field(default_factory=lambda: np.eye(3))
    """(3, 3) axes of the body's frame at joint position zero, as columns, in parent axes."""
    offset: Array = field(default_factory=lambda: np.zeros(3))
    """(3,) from the parent's frame to the body's at zero, m, in the *body's* axes at zero."""
    axis: Array = field(default_factory=lambda: np.array([0.0, 0.0, 1.0]))
    """(3,) unit vector of the axis, in body axes."""
    limits: JointLimits = NO_LIMITS
    friction: JointFriction = USUAL_FRICTION
    spring: Spring | None = None
    """Spring of a passive joint; None for actuated and fixed joints."""
    gear: Gear | None = None
    """Gear of an actuated joint; None: the joint is rigid."""


@dataclass(frozen=True)
class Tool:
    """Frame of an end effector."""

    name: str
    rotation: Array
    """(3, 3) its axes, as columns, in body axes."""
    position: Array
    """(3,) position, m, in body axes."""
    body: int = 0
    """Number of its body; set by `flatten`."""
    rank: int = 0
    """Rank among the tools of the robot: the lowest is *the* tool."""


@dataclass(frozen=True)
class Visual:
    """A shape to display a body."""

    shape: Literal["box", "cylinder", "sphere", "mesh"]
    size: tuple[float, ...]
    """Edges x, y, z; radius and length along z; radius, m; or scale x, y, z of a mesh."""
    rotation: Array
    """(3, 3) its axes, as columns, in body axes."""
    position: Array
    """(3,) position, m, in body axes."""
    mesh: str = ""
    """File of the mesh; the original name if the file does not exist."""
    colour: tuple[float, float, float, float] | None = None
    """Red, green, blue, alpha, from 0 to 1."""
    body: int = 0
    """Number of its body; set by `flatten`."""


@dataclass(frozen=True)
class Plate:
    """A flat surface of a body, seen from one side, for drag and sunlight."""

    area: float
    """m2."""
    normal: Array
    """(3,) unit vector outwards, in body axes."""
    centre: Array
    """(3,) m, in body axes."""
    drag_coefficient: float = 2.2
    specular: float = 0.2
    """Share of the light that is reflected as by a mirror."""
    diffuse: float = 0.3
    """Share that is scattered; the rest is absorbed."""
    body: int = 0
    """Number of its body; set by `flatten`."""


@dataclass(frozen=True)
class Body:
    """A rigid body; all vectors are in the axes of its frame."""

    name: str
    mass: float
    """Mass, kg; 0 only for bodies on fixed joints."""
    inertia: Array
    """(3, 3) inertia about its centre of mass, kg m2."""
    com: Array
    """(3,) centre of mass, m."""
    parent: str = ""
    """Name of its parent; empty for the base."""
    joint: Joint | None = None
    """Joint to the parent; None for the base."""
    tools: tuple[Tool, ...] = ()
    visuals: tuple[Visual, ...] = ()
    plates: tuple[Plate, ...] = ()
