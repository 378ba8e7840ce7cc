"""A robot's parameters as arrays, changed in memory such that they stay physically consistent."""

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
    """Return the rotation matrix (3, 3) of a Cayley vector: angle ``2 atan(|turn| / 2)``, rad."""
    x, y, z = 0.5 * np.asarray(turn, dtype=np.float64)
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    scale = 2.0 / (1.0 + (x * x + y * y + z * z))
    result: Array = np.eye(3) + scale * (cross + product(cross, cross))
    return result


def spread(inertia: Array, factors: ArrayLike, turn: ArrayLike) -> Array:
    """Scale the principal second moments of mass of an inertia, and rotate it.

    The second moments ``tr(I)/2 E - I`` of a body are positive semidefinite. Positive factors along
    their principal axes keep them so, hence the result is physically consistent for all factors.

    Args:
        inertia: (3, 3) kg m2, about the centre of mass.
        factors: (3,) above 0, of the second moments in ascending order.
        turn: (3,) rad, see `rotation`.

    Returns:
        (3, 3) kg m2.
    """
    moments, axes = principal_axes(0.5 * _trace(inertia) * np.eye(3) - inertia)
    # some are 0 for a plate or a rod, and may be negative by rounding
    scaled = np.maximum(moments, 0.0) * np.asarray(factors, dtype=np.float64)
    second = rotate_tensor(product(rotation(turn), axes), np.diag(scaled))
    return _trace(second) * np.eye(3) - 0.5 * (second + second.T)


def _trace(matrix: Array) -> float:
    return float(matrix[0, 0] + matrix[1, 1] + matrix[2, 2])


@dataclass
class Spread:
    """Arguments of `spread` for one body."""

    factors: list[float] = field(default_factory=lambda: [1.0, 1.0, 1.0])
    turn: list[float] = field(default_factory=lambda: [0.0, 0.0, 0.0])


class RobotArrays:
    """Copies of a robot's arrays; body 0 is the base, body j + 1 is moved by joint j."""

    def __init__(self, robot: Robot) -> None:
        self.nominal = robot
        self.mass = robot.mass.copy()
        self.inertia = robot.inertia.copy()
        self.com = robot.com.copy()
        self.friction = list(robot.friction)
        self.springs = list(robot.springs)
        self.spreads: defaultdict[int, Spread] = defaultdict(Spread)
        """By index of the body."""

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
    """Shift everything on the base by ``shift``: the base's frame stays at its CoM."""
    offset, com = robot.offset.copy(), robot.com.copy()
    com[0] = 0.0
    for joint in np.flatnonzero(robot.parent == 0):
        # no BLAS, whose last digits depend on the processor
        offset[joint] += np.sum(robot.rotation[joint].T * shift, axis=1)
    tools = tuple(t if t.body else replace(t, position=t.position + shift) for t in robot.tools)
    visuals = tuple(v if v.body else replace(v, position=v.position + shift) for v in robot.visuals)
    return replace(robot, com=com, offset=offset, tools=tools, visuals=visuals)
