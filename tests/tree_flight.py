"""Plants of random trees, with Pinocchio's models of the same bodies."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray
from oracles import rotation_of
from random_trees import BASE, random_bodies
from tree_oracle import TreeOracle, pinocchio_tree

from space_robot_model.robot import Robot
from space_robot_model.robot.tree import Body, JointFriction
from space_robot_msgs_py.samples import Command, RobotState
from space_robot_sim.environment.friction import FrictionSettings
from space_robot_sim.plant.plant import Plant, PlantSettings

Array = NDArray[np.float64]
PERIOD = 5e-4
KINDS = (
    "revolute",
    "prismatic",
    "revolute",
    "fixed",
    "passive revolute",
    "passive prismatic",
    "passive revolute",
    "fixed",
)
TORQUE = np.array([60.0, -40.0, 50.0, 4.0, 9.0, -6.0])
SEEDS = (0, 1, 2)
NO_WRENCH = np.zeros(6)


def tree(seed: int, lossless: bool = False) -> list[Body]:
    """Three joints with motors, one of them sliding, and three with springs, two bodies fixed."""
    bodies = random_bodies(np.random.default_rng(seed), KINDS)
    if not lossless:
        return bodies
    return [
        replace(
            body,
            joint=replace(
                body.joint,
                friction=JointFriction(),
                spring=body.joint.spring and body.joint.spring._replace(damping=0.0),
            ),
        )
        if body.joint
        else body
        for body in bodies
    ]


class TreeFlight:
    """A plant of a random tree, and Pinocchio's model of the same bodies."""

    def __init__(self, bodies: list[Body], viscous: float, **settings: Any) -> None:
        self.robot = Robot.of_tree("tree", bodies)
        self.viscous = viscous
        n = self.robot.n
        self.plant = Plant(
            self.robot,
            PlantSettings(
                initial_joints_deg=(0.3 * np.arange(n)).tolist(),
                initial_quaternion=[0.3, -0.8, 0.4, 0.2],
                friction=FrictionSettings(coulomb=0.0, viscous=viscous),
                **settings,
            ),
            PERIOD,
        )
        self.oracle = TreeOracle(pinocchio_tree(bodies), BASE, self.robot.all_joint_names, 0)
        self.model, self.data = self.oracle.model, self.oracle.data

    def fly(self, torque: Array, ticks: int) -> RobotState:
        for _ in range(ticks):
            self.plant.step(Command(self.plant.tick, torque))
        return self.plant.state

    def joints(self) -> tuple[Array, Array]:
        """Positions and velocities of all joints."""
        state, p = self.plant.state, len(self.robot.springs)
        return (
            np.concatenate([state.joint_positions, state.passive_positions[:p]]),
            np.concatenate([state.joint_velocities, state.passive_velocities[:p]]),
        )

    def configuration(self) -> tuple[Array, Array]:
        """The plant's state as Pinocchio has it: its root is not at the CoM of the base."""
        state, (positions, rates) = self.plant.state, self.joints()
        turn = rotation_of(state.quaternion)
        lever = self.model.frames[self.oracle.frame].placement.translation
        q, v = pin.neutral(self.model), np.zeros(self.model.nv)
        q[:3], q[3:7] = state.base_position - turn.apply(lever), turn.as_quat()
        q[7:][self._behind_root()] = positions
        v[:3] = turn.inv().apply(state.base_velocity) - np.cross(state.omega_base, lever)
        v[3:6] = state.omega_base
        v[self.oracle.columns] = rates
        return q, v

    def _behind_root(self) -> list[int]:
        return [column - 6 for column in self.oracle.columns]

    def spring_energy(self) -> float:
        positions = self.joints()[0][self.robot.n :]
        stretched = positions - [spring.rest for spring in self.robot.springs]
        stiffness = np.array([spring.stiffness for spring in self.robot.springs])
        return float(0.5 * stiffness @ stretched**2)

    def derivative(
        self, torque: Array, q: Array, v: Array, disturbed: Array, wrench: Array = NO_WRENCH
    ) -> Array:
        """Of ``[q, v]``: motors and springs push, friction brakes.

        ``disturbed`` (n+3,) N m: taken from the base, about inertial axes, and from the motors.
        ``wrench``: force (N) at the base's CoM and torque (N m) on it, both on the base's axes.
        """
        robot, columns, n = self.robot, self.oracle.columns, self.robot.n
        tau, own = np.zeros(self.model.nv), np.array(robot.friction)[:, 1]
        usual = np.where(np.arange(robot.joint_count) < n, self.viscous, 0.0)
        turn = pin.Quaternion(q[3:7] / np.linalg.norm(q[3:7]))
        tau[3:6] = torque[:3] - turn.matrix().T @ disturbed[:3]
        lever = self.model.frames[self.oracle.frame].placement.translation
        tau[:3] += wrench[:3]
        tau[3:6] += wrench[3:] + np.cross(lever, wrench[:3])
        tau[columns[:n]] = torque[3:] - disturbed[3:]
        tau[columns] -= np.where(np.isnan(own), usual, own) * v[columns]
        for column, spring in zip(columns[n:], robot.springs, strict=True):
            stretched = q[column + 1] - spring.rest
            tau[column] -= spring.stiffness * stretched + spring.damping * v[column]
        x, y, z, w = q[3:7]
        omega = v[3:6]
        rate = 0.5 * np.array([*(w * omega + np.cross([x, y, z], omega)), -omega @ [x, y, z]])
        q_unit = np.concatenate([q[:3], turn.coeffs(), q[7:]])
        acceleration = pin.aba(self.model, self.data, q_unit, v, tau)
        return np.concatenate([turn.matrix() @ v[:3], rate, v[6:], acceleration])
