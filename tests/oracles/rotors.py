"""Rotors as bodies of their own, in Pinocchio: wheels of the base, motors behind gears.

A robot's file has its rotors, locked, in the bodies that carry them. So here they are taken out of
these bodies, whatever their mass and wherever they are, before they are put on them as bodies.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
import pinocchio as pin
from scipy.integrate import solve_ivp
from strategies import State

from oracles import (
    attitude_jacobian_inertial,
    pinocchio_model,
    pinocchio_state,
    to_base_axes,
    visited,
)
from space_robot_model.elementary.matrices import Array
from space_robot_model.hardware.base_actuators import WheelSettings
from space_robot_model.robot import Robot
from space_robot_model.robot.gears import geared_joints
from space_robot_model.robot.parts import Gear
from space_robot_msgs_py.compiled.records import assign

Forces = Callable[[float, Array], Array]
"""Generalised force (N+6+G,) on inertial axes at a time and state."""


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


def flown_settings(rotors: Sequence[Rotor], **more: Any) -> WheelSettings:
    """The same wheels as the plant is told of them."""
    axes = [float(x) for rotor in rotors for x in rotor.axis]
    return WheelSettings(axes=axes, rotor_inertia=[rotor.spin for rotor in rotors], **more)


def mount(model: Any, rotors: Sequence[Rotor]) -> None:
    """Put them into the record of a `Model`."""
    count = len(rotors)
    assign(model, wheel_count=count)
    model.wheel_axis[:count] = [rotor.axis for rotor in rotors]
    model.wheel_inertia[:count] = [rotor.spin for rotor in rotors]


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


def _put_on(model: pin.Model, carriers: Sequence[int], rotors: Sequence[Rotor]) -> pin.Model:
    """Give each rotor a revolute joint of its own on a joint that has carried it, locked."""
    for k, (carrier, rotor) in enumerate(zip(carriers, rotors, strict=True)):
        alone = model.inertias[carrier].toDynamicParameters() - rotor.inertia.toDynamicParameters()
        model.inertias[carrier] = pin.Inertia.FromDynamicParameters(alone)
        axis = pin.JointModelRevoluteUnaligned(rotor.axis)
        added = model.addJoint(carrier, axis, pin.SE3(np.eye(3), rotor.position), f"rotor {k + 1}")
        body = pin.Inertia(rotor.mass, np.zeros(3), rotor.tensor)
        model.appendBodyToJoint(added, body, pin.SE3.Identity())
    return model


def pinocchio_with_wheels(robot: Robot, rotors: Sequence[Rotor]) -> pin.Model:
    """`pinocchio_model` with the rotors on the base, behind the joints."""
    return _put_on(pinocchio_model(robot), [1] * len(rotors), rotors)


def pinocchio_with_rotors(robot: Robot, rotors: Sequence[Rotor]) -> pin.Model:
    """`pinocchio_model` with the rotors of its gears, behind the joints."""
    numbers = {0: 1} | {joint + 1: 2 + k for k, joint in enumerate(robot.order)}
    carriers = [numbers[int(robot.parent[joint])] for joint in geared_joints(robot)]
    return _put_on(pinocchio_model(robot), carriers, rotors)


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


def pinocchio_momentum(
    robot: Robot, rotors: Sequence[Rotor], state: State, motor_velocities: Array
) -> tuple[Array, Array]:
    """Return linear (N s) and angular momentum (N m s) about the centre of mass, inertial axes."""
    model = pinocchio_with_rotors(robot, rotors)
    configuration, velocity = pinocchio_motion(robot, state, motor_velocities)
    momentum = pin.computeCentroidalMomentum(model, model.createData(), configuration, velocity)
    return momentum.linear.copy(), momentum.angular.copy()


class RotorEquations:
    """M and c by ``[v0, w0, thetadot, thetadot_m]`` (N+6+G), and motion by SciPy.

    ``M qdd + c = F``. The motors' angles and torques are seen through their gears. A state is
    ``[r0, quaternion, theta, v0, w0, thetadot, thetadot_m, theta_m]``, as the plant's, with joints
    in the robot's order; without gears that of a robot without motors.
    """

    def __init__(self, robot: Robot, rotors: Sequence[Rotor] = ()) -> None:
        self.robot, self.joints = robot, geared_joints(robot)
        self.n, self.count = robot.joint_count, len(self.joints)
        self.size = 6 + self.n + self.count
        self._gears = [gear_of(robot, joint) for joint in self.joints]
        self._model = pinocchio_with_rotors(robot, rotors)
        self._data, self._scale = self._model.createData(), turns(robot)
        self._order = order_of(robot)

    def matrices(self, quaternion: Array, theta: Array, velocity: Array) -> tuple[Array, Array]:
        """Return M and c."""
        model, data = self._model, self._data
        state = State(quaternion, theta, velocity[:3], velocity[3:6], velocity[6 : 6 + self.n])
        q, v = pinocchio_motion(self.robot, state, velocity[6 + self.n :])
        own = to_base_axes(quaternion, self.size) @ np.diag(self._scale)[self._order]
        # not by composite bodies: Pinocchio wants each branch's joints in a row for that
        zero, columns = np.zeros(self.size), np.eye(self.size)
        inertia = np.array([pin.rnea(model, data, q, zero, column) for column in columns])
        still = np.zeros(self.size)  # where the base's CoM does not accelerate
        still[:3] = -np.cross(v[3:6], v[:3])
        bias = own.T @ pin.rnea(model, data, q, v, still)
        return own.T @ inertia @ own, bias

    def accelerations(self, state: State, motor_velocities: Array, force: Array) -> Array:
        """Return ``[v0dot, w0dot, thetadd, thetadd_m]`` by articulated bodies."""
        q, v = pinocchio_motion(self.robot, state, motor_velocities)
        to_base = to_base_axes(state.quaternion, force.size)
        on_rotors = to_base @ (force / self._scale)[self._order]
        spatial = pin.aba(self._model, self._data, q, v, on_rotors).copy()
        spatial[:3] += np.cross(v[3:6], v[:3])
        accelerations = np.empty(force.size)
        accelerations[self._order] = to_base.T @ spatial
        return accelerations / self._scale

    def gear_force(self, x: Array) -> Array:
        """Return the generalised force (N+6+G,) of springs and dampers of the gears in a state."""
        n, force = self.n, np.zeros(self.size)
        theta, rates, motor_rates, motors = self.parts(x)
        for k, (joint, gear) in enumerate(zip(self.joints, self._gears, strict=True)):
            torque = gear.stiffness * (motors[k] - theta[joint])
            torque += gear.damping * (motor_rates[k] - rates[joint])
            force[6 + joint] += torque
            force[6 + n + k] -= torque
        return force

    def parts(self, x: Array) -> tuple[Array, Array, Array, Array]:
        """Return theta, thetadot, thetadot_m and theta_m of a state."""
        n, count = self.n, self.count
        velocities, motors = x[13 + n :], x[13 + 2 * n + count :]
        return x[7 : 7 + n], velocities[:n], velocities[n : n + count], motors

    def velocity(self, x: Array) -> Array:
        """Return ``[v0, w0, thetadot, thetadot_m]`` of a state."""
        return x[7 + self.n : 7 + self.n + self.size]

    def rate(self, x: Array, acceleration: Array) -> Array:
        """Return the derivative of a state for an acceleration (N+6+G,)."""
        n, velocity = self.n, self.velocity(x)
        turned = attitude_jacobian_inertial(x[3:7]) @ velocity[3:6]
        scalar = -0.5 * x[4:7] @ velocity[3:6]
        return np.concatenate(
            [velocity[:3], [scalar], turned, velocity[6 : 6 + n], acceleration, velocity[6 + n :]]
        )

    def fly(self, x: Array, begin: float, end: float, force: Forces, **options: Any) -> Any:
        """Return SciPy's solution by DOP853 to about 1e-11, under a force besides the gears'."""

        def derivative(t: float, y: Array) -> Array:
            velocity, n = self.velocity(y), self.n
            attitude = y[3:7] / np.linalg.norm(y[3:7])
            state = State(attitude, y[7 : 7 + n], velocity[:3], velocity[3:6], velocity[6 : 6 + n])
            total = force(t, y) + self.gear_force(y)
            return self.rate(y, self.accelerations(state, velocity[6 + n :], total))

        return solve_ivp(derivative, (begin, end), x, "DOP853", rtol=1e-12, atol=1e-14, **options)
