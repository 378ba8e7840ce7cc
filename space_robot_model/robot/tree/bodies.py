"""A robot as files tell it: bodies in any order, joints about any axis, some of them fixed."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
JointKind = Literal["revolute", "prismatic", "fixed"]


class JointLimits(NamedTuple):
    """The range of an actuated joint; infinite where none is known."""

    lower: float = -np.inf
    """rad, or m of a prismatic joint."""
    upper: float = np.inf
    """rad or m."""
    velocity: float = np.inf
    """rad/s or m/s."""
    effort: float = np.inf
    """N m or N."""


class JointFriction(NamedTuple):
    """The friction of a joint; NaN where the robot does not tell and the settings' holds."""

    coulomb: float = np.nan
    """N m, or N of a prismatic joint."""
    viscous: float = np.nan
    """N m s/rad or N s/m."""


class Spring(NamedTuple):
    """What holds a passive joint, which has no motor: ``-stiffness (theta - rest) - damping v``."""

    stiffness: float
    """N m/rad, or N/m of a prismatic joint."""
    damping: float
    """N m s/rad or N s/m."""
    rest: float = 0.0
    """rad or m."""


NO_LIMITS, USUAL_FRICTION = JointLimits(), JointFriction()


@dataclass(frozen=True)
class Joint:
    """How a body is joined to its parent."""

    name: str
    kind: JointKind = "revolute"
    """A continuous joint is a revolute one without limits of position."""
    rotation: Array = field(default_factory=lambda: np.eye(3))
    """(3, 3) axes of the body's frame at joint position zero, as columns, on its parent's axes."""
    offset: Array = field(default_factory=lambda: np.zeros(3))
    """(3,) m, from the parent's frame to the body's at zero, on the *body's* axes at zero."""
    axis: Array = field(default_factory=lambda: np.array([0.0, 0.0, 1.0]))
    """(3,) unit vector on the body's axes: turned about, or moved along."""
    limits: JointLimits = NO_LIMITS
    friction: JointFriction = USUAL_FRICTION
    spring: Spring | None = None
    """Of a passive joint; None: the joint is actuated, or fixed."""


@dataclass(frozen=True)
class Tool:
    """A frame that a robot works with: an end effector's."""

    name: str
    rotation: Array
    """(3, 3) its axes, as columns, on the axes of its body."""
    position: Array
    """(3,) m, on the axes of its body."""
    body: int = 0
    """Number of the body that carries it; of no meaning before `flatten`."""
    rank: int = 0
    """Its place among the tools of the robot: that of the lowest is *the* tool."""


@dataclass(frozen=True)
class Visual:
    """A shape that shows where a body is."""

    shape: Literal["box", "cylinder", "sphere", "mesh"]
    size: tuple[float, ...]
    """m: edges x, y, z; radius and length along z; radius; scale x, y, z of a mesh."""
    rotation: Array
    """(3, 3) its axes, as columns, on the axes of its body."""
    position: Array
    """(3,) m, on the axes of its body."""
    mesh: str = ""
    """File of the mesh; its name unchanged if the file does not exist."""
    colour: tuple[float, float, float, float] | None = None
    """Red, green, blue, alpha, from 0 to 1."""
    body: int = 0
    """Number of the body that it shows; of no meaning before `flatten`."""


@dataclass(frozen=True)
class Body:
    """A rigid body, with all vectors on the axes of its own frame."""

    name: str
    mass: float
    """kg; 0 only where a fixed joint adds the body to another one."""
    inertia: Array
    """(3, 3) kg m2 about its centre of mass."""
    com: Array
    """(3,) m, its centre of mass."""
    parent: str = ""
    """Name of the body that it is joined to; empty for the base."""
    joint: Joint | None = None
    """How; None for the base."""
    tools: tuple[Tool, ...] = ()
    visuals: tuple[Visual, ...] = ()
