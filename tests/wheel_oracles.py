"""Reaction wheels in independent programs: bodies of their own on hinges, in Pinocchio and MuJoCo.

The base's inertia in a robot's file has its wheels in it, locked. So here the rotors, wherever they
are and whatever their mass, are taken out of the base before they are put on it as bodies.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import mujoco
import numpy as np
import pinocchio as pin
from numpy.typing import NDArray
from oracles import mujoco_inertial, mujoco_model, mujoco_numbers, pinocchio_model

from space_robot_model.hardware.wheels import WheelSettings
from space_robot_model.robot import Robot
from space_robot_msgs_py.compiled.records import assign

Array = NDArray[np.float64]


class Rotor(NamedTuple):
    """A balanced wheel as a body: its centre of mass on its axis, the same inertia all about it."""

    axis: Array
    """Unit vector, base frame."""
    spin: float
    """Inertia about the axis, kg m2."""
    transverse: float
    """Inertia across it, about its centre of mass, kg m2."""
    mass: float
    position: Array
    """Its centre of mass from the base's, base frame, m."""

    @property
    def tensor(self) -> Array:
        """(3, 3) about its centre of mass, at any angle, kg m2."""
        along = np.outer(self.axis, self.axis)
        return self.transverse * (np.eye(3) - along) + self.spin * along

    @property
    def inertia(self) -> pin.Inertia:
        """About the base's centre of mass."""
        placed = pin.SE3(np.eye(3), self.position)
        return placed.act(pin.Inertia(self.mass, np.zeros(3), self.tensor))


def random_rotors(rng: np.random.Generator, robot: Robot, count: int) -> list[Rotor]:
    """Wheels on any axes, anywhere in the base, whose inertias the base's can hold."""
    room = np.linalg.eigvalsh(robot.inertia[0])[0] / count
    radius = np.sqrt(np.trace(robot.inertia[0]) / robot.mass[0])
    rotors = []
    for _ in range(count):
        axis = rng.normal(size=3)
        spin = rng.uniform(0.05, 0.3) * room
        rotors.append(
            Rotor(
                axis / np.linalg.norm(axis),
                spin,
                rng.uniform(0.5, 1.0) * spin,
                rng.uniform(0.01, 0.05) * robot.mass[0] / count,
                rng.uniform(-0.5, 0.5, 3) * radius,
            )
        )
    return rotors


def settings_of(rotors: Sequence[Rotor], **more: Any) -> WheelSettings:
    """The same wheels as the plant is told of them."""
    axes = [float(x) for rotor in rotors for x in rotor.axis]
    return WheelSettings(axes=axes, rotor_inertia=[rotor.spin for rotor in rotors], **more)


def mount(model: Any, rotors: Sequence[Rotor]) -> None:
    """Put them into the record of a `Model`."""
    count = len(rotors)
    assign(model, wheel_count=count)
    model.wheel_axis[:count] = [rotor.axis for rotor in rotors]
    model.wheel_inertia[:count] = [rotor.spin for rotor in rotors]


def base_alone(robot: Robot, rotors: Sequence[Rotor]) -> pin.Inertia:
    """The base without its rotors, about its centre of mass with them."""
    base = pin.Inertia(robot.mass[0], np.zeros(3), robot.inertia[0]).toDynamicParameters()
    for rotor in rotors:
        base = base - rotor.inertia.toDynamicParameters()
    return pin.Inertia.FromDynamicParameters(base)


def pinocchio_with_wheels(robot: Robot, rotors: Sequence[Rotor]) -> pin.Model:
    """`oracles.pinocchio_model` with a hinge for each rotor on the base, behind the joints."""
    model = pinocchio_model(robot)
    base = 1
    model.inertias[base] = base_alone(robot, rotors)
    for k, rotor in enumerate(rotors):
        hinge = pin.JointModelRevoluteUnaligned(rotor.axis)
        joint = model.addJoint(base, hinge, pin.SE3(np.eye(3), rotor.position), f"wheel_{k + 1}")
        body = pin.Inertia(rotor.mass, np.zeros(3), rotor.tensor)
        model.appendBodyToJoint(joint, body, pin.SE3.Identity())
    return model


def mujoco_with_wheels(robot: Robot, rotors: Sequence[Rotor]) -> mujoco.MjModel:
    """`oracles.mujoco_model` with a hinge for each rotor on the base, behind the joints."""
    base = base_alone(robot, rotors)
    bodies = [
        f'<body pos="{mujoco_numbers(rotor.position)}">'
        f'<joint type="hinge" axis="{mujoco_numbers(rotor.axis)}"/>'
        f"{mujoco_inertial(np.zeros(3), rotor.mass, rotor.tensor)}</body>"
        for rotor in rotors
    ]
    inertial = mujoco_inertial(base.lever, base.mass, base.inertia)
    return mujoco_model(robot, inertial, "".join(bodies))
