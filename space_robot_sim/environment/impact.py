"""A grasped target, and velocities after a capture or release by exact exchange of momentum.

A captured target is rigidly attached to the body that carries the tool.

The impact is perfectly inelastic. Positions stay; motors, springs and friction are finite, so they
give no momentum in no time; what the target gives, the robot takes. With H the inertia of the robot
that holds the target, its wheels included, J the Jacobian of the target in the robot's hand, M the
target's inertia and u the velocity of the target relative to the place that holds it,

    H (qdot+ - qdot-) = J^T M u

for a capture (u is that before), and the same with a minus for a release (u is that after, of a
spring). It follows from ``H = H_robot + J^T M J`` and the sum ``H_robot qdot + J^T M u_target`` of
the momenta, which stays. The kinetic energy falls at a capture, by
``u^T (M^-1 + J H_robot^-1 J^T)^-1 u / 2`` (Wittenburg, Dynamics of Multibody Systems, 2008,
chapter 6).
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from space_robot_model.elementary.matrices import product, rotate_tensor, solve
from space_robot_model.robot import Robot
from space_robot_model.robot.dynamics import mass_matrix
from space_robot_model.robot.flatten import parallel_axes
from space_robot_model.robot.gears import rotor_rows
from space_robot_model.robot.inertia import inertia_tensor
from space_robot_model.robot.placements import BodyFrame, base_axes, body_frames
from space_robot_msgs_py.config.validation import one_of

from .target import Target, TargetMotion

Array = NDArray[np.float64]


class Grasp(NamedTuple):
    """A target attached to a body of the robot, on the axes of that body."""

    body: int
    """Number of the body, 0 for the base."""
    mass: float
    """Mass of the target, kg."""
    com: Array
    """(3,) m, position of the target's centre of mass."""
    inertia: Array
    """(3, 3) kg m2, of the target about its centre of mass."""
    tool_axes: Array
    """(3, 3) axes of the tool that holds it, as columns."""

    @classmethod
    def of(cls, robot: Robot, target: Target) -> Grasp:
        """Place ``target`` in the tool that it names, or in the robot's first one."""
        tools = {tool.name: tool for tool in robot.tools}
        tool = robot.tool
        if target.tool:
            where = f" of robot {robot.name!r} for target {target.name!r}"
            tool = tools[one_of(target.tool, tools, "tool", where)]
        axes = product(tool.rotation, target.rotation)
        return cls(
            tool.body,
            target.mass,
            tool.position + product(tool.rotation, target.place.position),
            rotate_tensor(axes, inertia_tensor(target.inertia)),
            tool.rotation,
        )

    def holding(self, robot: Robot) -> Robot:
        """Return ``robot`` with the target welded to its body."""
        body, masses = self.body, robot.mass.copy()
        coms, tensors = robot.com.copy(), robot.inertia.copy()
        masses[body] += self.mass
        coms[body] += self.mass / masses[body] * (self.com - robot.com[body])
        tensors[body] += self.inertia
        for mass, com in ((robot.mass[body], robot.com[body]), (self.mass, self.com)):
            tensors[body] += parallel_axes(mass, com - coms[body])
        return replace(robot, mass=masses, com=coms, inertia=tensors)


class Impact:
    """A robot of N joints, W wheels and G gears when it takes or lets go a target.

    Velocities are ``qdot = [v0, w0, thetadot, Omega, thetadot_m]`` (N+6+W+G,), the base's on
    inertial axes, m/s and rad/s; spatial ones have their linear part first, on inertial axes.
    """

    def __init__(
        self,
        holding: Robot,
        grasp: Grasp,
        quaternion: Array,
        joint_positions: Array,
        wheel_axes: Array,
        wheel_inertia: Array,
    ) -> None:
        """Compute J and ``H^-1 J^T M``.

        Args:
            holding: the robot with the target, see `Grasp.holding`.
            grasp: the target.
            quaternion: (4,) of the base, unit.
            joint_positions: (N,) of all joints, rad or m.
            wheel_axes: (W, 3) unit vectors in the base frame.
            wheel_inertia: (W,) kg m2 of the rotors about their axes.
        """
        base = base_axes(quaternion[:, np.newaxis])
        walk = body_frames(holding, base, joint_positions[:, np.newaxis])
        frames = {frame.body: frame for frame in walk}
        carrier = frames[grasp.body]
        axes = _axes(carrier)
        self._tool_axes = product(axes, grasp.tool_axes)
        self.place: Array = (carrier.origin + carrier.on_outer_axes(grasp.com))[:, 0]
        """(3,) of the target's CoM from the base's, m, inertial axes."""
        self._size = holding.joint_count + 6
        rotors, reflected = rotor_rows(holding, frames)
        self.jacobian = np.zeros((6, self._size + len(wheel_inertia) + len(rotors)))
        """(6, N+6+W+G) velocity of the target, as a part of the robot, by qdot."""
        self._fill_jacobian(holding, frames, grasp)
        mass = np.zeros((6, 6))
        mass[:3, :3] = grasp.mass * np.eye(3)
        mass[3:, 3:] = rotate_tensor(axes, grasp.inertia)
        wheels = np.zeros((len(wheel_inertia), self._size))
        wheels[:, 3:6] = wheel_inertia[:, np.newaxis] * product(wheel_axes, base[:, :, 0])
        inertia = _with_leaves(
            mass_matrix(holding, quaternion, joint_positions),
            np.vstack((wheels, rotors)),
            np.concatenate((wheel_inertia, reflected)),
        )
        self._gain = solve(inertia, product(mass, self.jacobian).T)
        """(N+6+W+G, 6) change of qdot by u."""

    def capture(self, motion: TargetMotion, velocity: Array) -> Array:
        """Return qdot after a capture at ``velocity``."""
        after: Array = velocity + product(self._gain, self._relative(motion, velocity))
        return after

    def before_capture(self, motion: TargetMotion, velocity: Array) -> Array:
        """Return qdot before a capture that led to ``velocity``."""
        if motion.relative_to == "tool":
            return velocity - product(self._gain, self._relative(motion, velocity))
        # qdot+ = qdot- + K (u_target - J qdot-), K = H^-1 J^T M: solved for qdot-
        known: Array = velocity - product(self._gain, _spatial(motion))
        matrix = np.eye(len(velocity)) - product(self._gain, self.jacobian)
        return solve(matrix, known)

    def release(self, speed: float, velocity: Array) -> Array:
        """Return qdot after a release at ``velocity`` by a spring, m/s along z of the tool."""
        after: Array = velocity - product(self._gain[:, :3], speed * self._tool_axes[:, 2])
        return after

    def before_release(self, speed: float, velocity: Array) -> Array:
        """Return qdot before a release that led to ``velocity``."""
        return self.release(-speed, velocity)

    def _relative(self, motion: TargetMotion, velocity: Array) -> Array:
        """Return u of a target before its capture."""
        if motion.relative_to == "tool":
            parts = motion.velocity, motion.angular_velocity
            return np.concatenate([product(self._tool_axes, part) for part in parts])
        relative: Array = _spatial(motion) - product(self.jacobian, velocity)
        return relative

    def _fill_jacobian(self, robot: Robot, frames: dict[int, BodyFrame], grasp: Grasp) -> None:
        """Write the columns of the base and of the joints between it and the hand."""
        place = self.place
        self.jacobian[:, :6] = np.eye(6)
        # velocity w x r of the place, for w along each axis
        self.jacobian[:3, 3:6] = np.cross(np.eye(3), place).T
        body = grasp.body
        while body:
            joint, frame = body - 1, frames[body]
            axis, column = frame.z[:, 0], self.jacobian[:, 5 + body]
            if robot.is_prismatic[joint]:
                column[:3] = axis
            else:
                column[:3], column[3:] = np.cross(axis, place - frame.origin[:, 0]), axis
            body = int(robot.parent[joint])


def _axes(frame: BodyFrame) -> Array:
    """Return the axes of a frame as columns, (3, 3)."""
    return np.column_stack([frame.x, frame.y, frame.z])


def _spatial(motion: TargetMotion) -> Array:
    return np.array([*motion.velocity, *motion.angular_velocity])


def _with_leaves(inertia: Array, rows: Array, own: Array) -> Array:
    """Return the inertia with those of wheels and rotors: couplings (K, N+6) and their own (K,)."""
    size, count = len(inertia), len(own)
    # each turns about its own axis only: a leaf couples to its carrier, never to another leaf
    whole = np.zeros((size + count, size + count))
    whole[:size, :size] = inertia
    whole[size:, :size], whole[:size, size:] = rows, rows.T
    whole[size:, size:] = np.diag(own)
    return whole
