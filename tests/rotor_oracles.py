"""Rotors of motors behind gears as bodies of their own, in Pinocchio.

A robot's file has the rotors, locked, in the bodies that carry them. So here they are taken out of
these bodies, whatever their mass and wherever they are, before they are put on them as bodies.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray
from oracles import pinocchio_model, pinocchio_state, to_base_axes, visited
from random_robots import State
from wheel_oracles import Rotor

from space_robot_model.robot import Robot
from space_robot_model.robot.gears import geared_joints
from space_robot_model.robot.tree import Gear

Array = NDArray[np.float64]


def gear_of(robot: Robot, joint: int) -> Gear:
    """Return the gear of a joint that has one."""
    gear = robot.gears[joint]
    assert gear
    return gear


def random_motor_rotors(rng: np.random.Generator, robot: Robot) -> list[Rotor]:
    """Return a balanced rotor for each gear, anywhere in the joint's parent, in its frame."""
    rotors = []
    for joint in geared_joints(robot):
        parent, spin = robot.parent[joint], gear_of(robot, joint).rotor_inertia
        mass = robot.mass[parent]
        size = np.sqrt(np.trace(robot.inertia[parent]) / mass)
        rotors.append(
            Rotor(
                robot.rotation[joint][:, 2],
                spin,
                float(rng.uniform(0.5, 1.0)) * spin,
                float(rng.uniform(0.001, 0.02)) * mass,
                robot.com[parent] + rng.uniform(-0.3, 0.3, 3) * size,
            )
        )
    return rotors


def pinocchio_with_rotors(robot: Robot, rotors: Sequence[Rotor]) -> pin.Model:
    """`oracles.pinocchio_model` with a revolute joint for each rotor, behind the joints."""
    model = pinocchio_model(robot)
    numbers = {0: 1} | {joint + 1: 2 + k for k, joint in enumerate(robot.order)}
    for joint, rotor in zip(geared_joints(robot), rotors, strict=True):
        carrier = numbers[int(robot.parent[joint])]
        alone = model.inertias[carrier].toDynamicParameters() - rotor.inertia.toDynamicParameters()
        model.inertias[carrier] = pin.Inertia.FromDynamicParameters(alone)
        axis = pin.JointModelRevoluteUnaligned(rotor.axis)
        place = pin.SE3(np.eye(3), rotor.position)
        added = model.addJoint(carrier, axis, place, f"motor of {robot.joint_names[joint]}")
        body = pin.Inertia(rotor.mass, np.zeros(3), rotor.tensor)
        model.appendBodyToJoint(added, body, pin.SE3.Identity())
    return model


def turns(robot: Robot) -> Array:
    """Return the scale (N+6+G,) of each velocity: 1, and the ratio N for the motors.

    Multiplied by it, a velocity or acceleration seen through the gears is the rotor's own; a force
    divided by it is the torque on the rotor.
    """
    ratios = [gear_of(robot, joint).ratio for joint in geared_joints(robot)]
    return np.array([1.0] * (6 + robot.joint_count) + ratios)


def order_of(robot: Robot) -> list[int]:
    """Return the place of each row of Pinocchio's model in ``[v0, w0, thetadot, thetadot_m]``."""
    size, count = 6 + robot.joint_count, len(geared_joints(robot))
    return [*range(6), *(6 + joint for joint in robot.order), *range(size, size + count)]


def pinocchio_motion(robot: Robot, state: State, motor_velocities: Array) -> tuple[Array, Array]:
    """Return configuration and velocity for Pinocchio; the rotors are balanced: at any angle."""
    joints = visited(robot, state)
    own = turns(robot)[6 + robot.joint_count :] * motor_velocities
    moving = joints._replace(
        theta=np.concatenate([joints.theta, 0.7 + np.arange(own.size)]),
        rate=np.concatenate([joints.rate, own]),
    )
    return pinocchio_state(moving)


def pinocchio_rotor_accelerations(
    robot: Robot, rotors: Sequence[Rotor], state: State, motor_velocities: Array, force: Array
) -> Array:
    """Return ``[v0dot, w0dot, thetadd, thetadd_m]`` on inertial axes.

    Args:
        robot: with G gears.
        rotors: of the gears.
        state: of the robot.
        motor_velocities: (G,) seen through the gears.
        force: (N+6+G,) ``[f0, tau0, tau, f]``, f on the rotors seen through the gears.
    """
    model, order, scale = pinocchio_with_rotors(robot, rotors), order_of(robot), turns(robot)
    configuration, velocity = pinocchio_motion(robot, state, motor_velocities)
    to_base = to_base_axes(state.quaternion, force.size)
    spatial = pin.aba(
        model, model.createData(), configuration, velocity, to_base @ (force / scale)[order]
    ).copy()
    spatial[:3] += np.cross(velocity[3:6], velocity[:3])
    accelerations = np.empty(force.size)
    accelerations[order] = to_base.T @ spatial
    return accelerations / scale


def pinocchio_momentum(
    robot: Robot, rotors: Sequence[Rotor], state: State, motor_velocities: Array
) -> tuple[Array, Array]:
    """Return linear (N s) and angular momentum (N m s) about the centre of mass, inertial axes."""
    model = pinocchio_with_rotors(robot, rotors)
    configuration, velocity = pinocchio_motion(robot, state, motor_velocities)
    momentum = pin.computeCentroidalMomentum(model, model.createData(), configuration, velocity)
    return momentum.linear.copy(), momentum.angular.copy()


def pinocchio_kinetic_energy(
    robot: Robot, rotors: Sequence[Rotor], state: State, motor_velocities: Array
) -> float:
    """Return the kinetic energy of everything, J."""
    model = pinocchio_with_rotors(robot, rotors)
    motion = pinocchio_motion(robot, state, motor_velocities)
    return float(pin.computeKineticEnergy(model, model.createData(), *motion))
