"""Robots with gears, made in code, and plants of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from space_robot_model.dynamics.model import Model
from space_robot_model.robot import Robot
from space_robot_model.robot.gears import geared_joints
from space_robot_model.robot.tree import Gear
from space_robot_msgs_py.samples import Command, RobotState
from space_robot_sim.environment.friction import Friction, FrictionSettings
from space_robot_sim.plant.gear_mounting import mount_gears
from space_robot_sim.plant.plant import Plant, PlantSettings

Array = NDArray[np.float64]
PERIOD = 5e-4
HEAVY = 1e15
"""kg and kg m2 of a base that torques of 1 N m do not move: by 1e-15 rad/s2."""


def oscillator(
    gear: Gear, link_inertia: float, base_inertia: float = HEAVY, joint: str = "revolute"
) -> Robot:
    """Return a robot of one joint with a gear, whose axis z goes through both centres of mass.

    Args:
        gear: of the joint.
        link_inertia: about the axis, kg m2; of a prismatic joint the link's mass, kg.
        base_inertia: the same of the base.
        joint: "revolute" or "prismatic".
    """
    link: dict[str, Any] = {
        "name": "joint",
        "joint": joint,
        "mass": link_inertia,
        "inertia": [link_inertia] * 3 + [0.0] * 3,
        "com": [0.0] * 3,
    }
    base = {"mass": base_inertia, "inertia": [base_inertia] * 3 + [0.0] * 3}
    robot = Robot.from_dict({"robot": {"name": "oscillator", "base": base, "links": [link]}})
    return with_gears(robot, [gear])


def with_gears(robot: Robot, gears: Sequence[Gear | None]) -> Robot:
    """Return the robot with a gear, or None, for each of its actuated joints."""
    return replace(robot, gears=tuple(gears) if any(gears) else ())


def rotor_room(robot: Robot, joint: int) -> float:
    """Return the rotor inertia, kg m2, that leaves the joint's parent positive definite.

    It is the parent's smallest principal moment, shared by the joints on that parent.
    """
    parent = robot.parent[joint]
    count = int((robot.parent[: robot.n] == parent).sum())
    return float(np.linalg.eigvalsh(robot.inertia[parent])[0]) / count


def random_gears(rng: np.random.Generator, robot: Robot) -> Robot:
    """Return the robot with gears of any ratio on about two thirds of its actuated joints."""
    gears: list[Gear | None] = []
    for joint in range(robot.n):
        gear = Gear(
            float(rng.uniform(0.05, 0.3)) * rotor_room(robot, joint),
            float(10.0 ** rng.uniform(-1.0, 2.0)),
            float(rng.uniform(50.0, 500.0)),
            float(rng.uniform(0.0, 1.0)),
        )
        gears.append(gear if rng.random() < 0.67 else None)
    if not any(gears):
        gears[0] = gear
    return with_gears(robot, gears)


REFLECTED = (40.0, 100.0, 100.0, 1.5, 1.5, 0.3)
"""N^2 J, kg m2, of `geared_paper_arm`: half of what its links have about their joints."""


def geared_paper_arm(paper_robot: Robot, **changes: Any) -> Robot:
    """Return the paper's robot with gears of 1:100, whose joints its laws can hold.

    Lighter motors would need shorter periods: the laws' gains are for the links' inertia.
    ``changes``: of each `Gear`.
    """
    gears = [Gear(reflected / 1e4, 100.0, 2e4, 50.0) for reflected in REFLECTED]
    return with_gears(paper_robot, [gear._replace(**changes) for gear in gears])


def mounted(robot: Robot) -> Model:
    """Return the model of a robot with its gears, as the plant has it; without wheels."""
    model = robot.model.copy()
    friction = Friction.build(robot, FrictionSettings())
    mount_gears(robot, model, friction, np.zeros(13 + 4 * robot.joint_count))
    return model


class GearedFlight:
    """A plant of a robot with gears, without Coulomb friction unless it is set."""

    def __init__(
        self,
        robot: Robot,
        substeps: int = 1,
        coulomb: float = 0.0,
        viscous: float = 0.0,
        **settings: Any,
    ) -> None:
        self.robot, self.joints = robot, geared_joints(robot)
        self.plant = Plant(
            robot,
            PlantSettings(
                **{"initial_joints_deg": [0.0] * robot.n, **settings},
                friction=FrictionSettings(coulomb=coulomb, viscous=viscous),
                substeps=substeps,
            ),
            PERIOD,
        )
        n, count = robot.joint_count, len(self.joints)
        x = self.plant.memory.x
        self.x = x[: 13 + 2 * n + 2 * count]
        """The plant's own numbers ``[r0, quaternion, theta, v0, w0, thetadot, thetadot_m,
        theta_m]``, see `Stages`; joints in the order of the model."""
        self.positions, self.velocities = x[7 : 7 + n], x[13 + n : 13 + 2 * n]
        self.base_velocities = x[7 + n : 13 + n]
        self.motor_velocities = x[13 + 2 * n : 13 + 2 * n + count]
        self.motor_positions = x[13 + 2 * n + count : 13 + 2 * n + 2 * count]

    def fly(self, torque: Sequence[float] | Array, ticks: int = 1) -> RobotState:
        """Hold a torque (n+3,) on base and joints over some ticks; return the true state."""
        for _ in range(ticks):
            self.plant.step(Command(self.plant.tick, np.asarray(torque, float)))
        return self.plant.truth

    def rest(self, ticks: int = 1) -> RobotState:
        """Fly some ticks without torques; return the true state."""
        return self.fly(np.zeros(self.robot.n + 3), ticks)
