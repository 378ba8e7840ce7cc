"""A robot's numbers, changed in memory so that the robot stays one that can be built."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from space_robot_model.robot import Robot

from .inertia_spread import spread

Array = NDArray[np.float64]


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
