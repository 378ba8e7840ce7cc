"""Equations of motion of a robot with gears in plain NumPy, each rotor a body of its own.

Kane's form: with the Jacobians of every body's centre of mass and angular velocity, and the
accelerations that they have while all velocities stay as they are,

    M = sum m Jv^T Jv + Jw^T I Jw        c = sum m Jv^T a + Jw^T (I alpha + w x I w)
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from oracles import attitude_jacobian_inertial, rotation_of, skew
from rotor_oracles import gear_of
from scipy.integrate import solve_ivp
from wheel_oracles import Rotor

from space_robot_model.robot import Robot
from space_robot_model.robot.gears import geared_joints

Array = NDArray[np.float64]
Forces = Callable[[float, Array], Array]
"""Generalised force (N+6+G,) on inertial axes at a time and state."""


class _Mass(NamedTuple):
    """A rigid body fixed in a frame: mass, centre of mass, and inertia about it."""

    mass: float
    com: Array
    inertia: Array


class _Frame(NamedTuple):
    """A body's frame in motion: Jacobians by all velocities, and accelerations without theirs."""

    axes: Array
    origin: Array
    linear: Array
    angular: Array
    omega: Array
    acceleration: Array
    turning: Array

    def at(self, arm: Array) -> _Frame:
        """Return the same at a point of the body, ``arm`` from the origin on inertial axes."""
        turned = np.cross(self.turning, arm) + np.cross(self.omega, np.cross(self.omega, arm))
        return self._replace(
            origin=self.origin + arm,
            linear=self.linear - skew(arm) @ self.angular,
            acceleration=self.acceleration + turned,
        )


def _without(whole: _Mass, rotors: Sequence[Rotor]) -> _Mass:
    """Return what is left of a body when its rotors are taken out."""
    mass = whole.mass - sum(rotor.mass for rotor in rotors)
    moment = whole.mass * whole.com - sum((r.mass * r.position for r in rotors), np.zeros(3))
    com = moment / mass
    inertia = whole.inertia - whole.mass * _square(whole.com - com)
    for rotor in rotors:
        inertia = inertia - rotor.tensor + rotor.mass * _square(rotor.position - com)
    return _Mass(mass, com, inertia)


def _square(arm: Array) -> Array:
    matrix: Array = skew(arm) @ skew(arm)
    return matrix


class RotorEquations:
    """M and c by ``[v0, w0, thetadot, thetadot_m]`` (N+6+G), and motion by SciPy.

    A state is ``[r0, quaternion, theta, v0, w0, thetadot, thetadot_m, theta_m]``, as the plant's.
    Joints are in the robot's order.
    """

    def __init__(self, robot: Robot, rotors: Sequence[Rotor]) -> None:
        self.robot, self.rotors, self.joints = robot, rotors, geared_joints(robot)
        self.n, self.count = robot.joint_count, len(self.joints)
        self.size = 6 + self.n + self.count
        self._gears = [gear_of(robot, joint) for joint in self.joints]
        self._bodies = [
            _without(
                _Mass(robot.mass[k], robot.com[k], robot.inertia[k]),
                [r for r, j in zip(rotors, self.joints, strict=True) if robot.parent[j] == k],
            )
            for k in range(self.n + 1)
        ]

    def matrices(self, quaternion: Array, theta: Array, velocity: Array) -> tuple[Array, Array]:
        """Return M and c."""
        mass, bias = np.zeros((self.size, self.size)), np.zeros(self.size)
        frames = self._frames(quaternion, theta, velocity)
        moved = list(zip(frames, self._bodies, strict=True))
        for k, (joint, gear, rotor) in enumerate(
            zip(self.joints, self._gears, self.rotors, strict=True)
        ):
            carrier, place = frames[self.robot.parent[joint]], 6 + self.n + k
            axis = carrier.axes @ rotor.axis
            angular = carrier.angular.copy()
            angular[:, place] += gear.ratio * axis
            spin = gear.ratio * velocity[place] * axis
            turning = carrier.turning + np.cross(carrier.omega, spin)
            body = carrier._replace(angular=angular, omega=carrier.omega + spin, turning=turning)
            # the point of the carrier where the rotor's centre is moves as the carrier does
            at = carrier.at(carrier.axes @ rotor.position)
            body = body._replace(origin=at.origin, linear=at.linear, acceleration=at.acceleration)
            moved.append((body, _Mass(rotor.mass, np.zeros(3), rotor.tensor)))
        for frame, body in moved:
            at = frame.at(frame.axes @ body.com)
            inertia = frame.axes @ body.inertia @ frame.axes.T
            mass += body.mass * at.linear.T @ at.linear + at.angular.T @ inertia @ at.angular
            torque = inertia @ at.turning + np.cross(at.omega, inertia @ at.omega)
            bias += body.mass * at.linear.T @ at.acceleration + at.angular.T @ torque
        return mass, bias

    def _frames(self, quaternion: Array, theta: Array, velocity: Array) -> list[_Frame]:
        robot, zero = self.robot, np.zeros(3)
        linear, angular = np.zeros((3, self.size)), np.zeros((3, self.size))
        linear[:, :3] = angular[:, 3:6] = np.eye(3)
        axes = rotation_of(quaternion).as_matrix()
        frames = {0: _Frame(axes, zero, linear, angular, velocity[3:6], zero, zero)}
        for j in robot.order:
            parent = frames[int(robot.parent[j])]
            still = parent.axes @ robot.rotation[j]
            z, rate, row = still[:, 2], velocity[6 + j], 6 + j
            if robot.is_prismatic[j]:
                frame = parent.at(still @ robot.offset[j] + theta[j] * z)
                moved = frame.linear.copy()
                moved[:, row] += z
                coriolis = 2.0 * np.cross(parent.omega, rate * z)
                frame = frame._replace(
                    axes=still, linear=moved, acceleration=frame.acceleration + coriolis
                )
            else:
                frame = parent.at(still @ robot.offset[j])
                cosine, sine = np.cos(theta[j]), np.sin(theta[j])
                turn = np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])
                moved = frame.angular.copy()
                moved[:, row] += z
                frame = frame._replace(
                    axes=still @ turn,
                    angular=moved,
                    omega=parent.omega + rate * z,
                    turning=parent.turning + np.cross(parent.omega, rate * z),
                )
            frames[j + 1] = frame
        return [frames[body] for body in range(self.n + 1)]

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

    def rate(self, x: Array, acceleration: Array) -> Array:
        """Return the derivative of a state for an acceleration (N+6+G,)."""
        n, velocity = self.n, self.velocity(x)
        turned = attitude_jacobian_inertial(x[3:7]) @ velocity[3:6]
        scalar = -0.5 * x[4:7] @ velocity[3:6]
        return np.concatenate(
            [velocity[:3], [scalar], turned, velocity[6 : 6 + n], acceleration, velocity[6 + n :]]
        )

    def velocity(self, x: Array) -> Array:
        """Return ``[v0, w0, thetadot, thetadot_m]`` of a state."""
        return x[7 + self.n : 7 + self.n + self.size]

    def acceleration(self, x: Array, force: Array) -> Array:
        """Return the acceleration (N+6+G,) in a state under a force besides that of the gears."""
        mass, bias = self.matrices(x[3:7], x[7 : 7 + self.n], self.velocity(x))
        acceleration: Array = np.linalg.solve(mass, force + self.gear_force(x) - bias)
        return acceleration

    def fly(self, x: Array, duration: float, force: Forces) -> Array:
        """Return the state after ``duration`` s from ``x``, by DOP853 to about 1e-11."""
        solution = solve_ivp(
            lambda t, y: self.rate(y, self.acceleration(y, force(t, y))),
            (0.0, duration),
            x,
            "DOP853",
            rtol=1e-12,
            atol=1e-14,
        )
        end: Array = solution.y[:, -1]
        return end
