"""A robot's numbers, changed in memory so that the robot stays one that can be built."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from space_robot_model.elementary.matrices import product, rotate_tensor
from space_robot_model.elementary.symmetric import principal_axes
from space_robot_model.robot import Robot

Array = NDArray[np.float64]


def rotation(turn: ArrayLike) -> Array:
    """Return a rotation about a vector, by 2 atan of half its length, rad: Cayley's form."""
    x, y, z = 0.5 * np.asarray(turn, dtype=np.float64)
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    scale = 2.0 / (1.0 + (x * x + y * y + z * z))
    result: Array = np.eye(3) + scale * (cross + product(cross, cross))
    return result


def spread(inertia: Array, factors: ArrayLike, turn: ArrayLike) -> Array:
    """Return the inertia (3, 3) of a body whose mass is spread otherwise, and turned.

    The second moments of the mass, ``tr(I)/2 E - I``, are positive for every body there is. Each
    along its principal axes is multiplied by a positive factor, so the inertia that they make is
    again one that a body can have, whatever the factors.

    Args:
        inertia: (3, 3) kg m2, about the centre of mass.
        factors: (3,) above 0, of the second moments in ascending order.
        turn: (3,) rad, see `rotation`.
    """
    moments, axes = principal_axes(0.5 * _trace(inertia) * np.eye(3) - inertia)
    # of a plate or a rod some are 0, and may be less by rounding
    scaled = np.maximum(moments, 0.0) * np.asarray(factors, dtype=np.float64)
    second = rotate_tensor(product(rotation(turn), axes), np.diag(scaled))
    return _trace(second) * np.eye(3) - 0.5 * (second + second.T)


def _trace(matrix: Array) -> float:
    return float(matrix[0, 0] + matrix[1, 1] + matrix[2, 2])


@dataclass
class Spread:
    """How the mass of a body is spread otherwise, see `spread`."""

    factors: list[float] = field(default_factory=lambda: [1.0, 1.0, 1.0])
    turn: list[float] = field(default_factory=lambda: [0.0, 0.0, 0.0])


class RobotArrays:
    """Copies of a robot's arrays; body 0 is the base, body j + 1 the one that joint j moves."""

    def __init__(self, robot: Robot) -> None:
        self.nominal = robot
        self.mass = robot.mass.copy()
        self.inertia = robot.inertia.copy()
        self.com = robot.com.copy()
        self.friction = list(robot.friction)
        self.springs = list(robot.springs)
        self.spreads: defaultdict[int, Spread] = defaultdict(Spread)
        """By body."""

    def robot(self) -> Robot:
        """Build the robot."""
        inertia, shift = self.inertia.copy(), -self.com[0]
        for body, own in self.spreads.items():
            inertia[body] = spread(inertia[body], own.factors, own.turn)
        changed = replace(
            self.nominal,
            mass=self.mass,
            inertia=inertia,
            com=self.com,
            friction=tuple(self.friction),
            springs=tuple(self.springs),
        )
        return _with_base_moved(changed, shift) if shift.any() else changed


def _with_base_moved(robot: Robot, shift: Array) -> Robot:
    """Return the robot with all that is on its base shifted: the base's frame is at its CoM."""
    offset, com = robot.offset.copy(), robot.com.copy()
    com[0] = 0.0
    for joint in np.flatnonzero(robot.parent == 0):
        # no BLAS, whose last digits depend on the processor
        offset[joint] += np.sum(robot.rotation[joint].T * shift, axis=1)
    tools = tuple(t if t.body else replace(t, position=t.position + shift) for t in robot.tools)
    visuals = tuple(v if v.body else replace(v, position=v.position + shift) for v in robot.visuals)
    return replace(robot, com=com, offset=offset, tools=tools, visuals=visuals)
