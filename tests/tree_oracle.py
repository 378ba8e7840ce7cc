"""Pinocchio on trees of its own making, and what our numbers of the same tree must be."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray
from oracles import quaternion_of
from scipy.spatial.transform import Rotation

from space_robot_model.robot import Robot
from space_robot_model.robot.dynamics import bias_force, forward_dynamics, mass_matrix
from space_robot_model.robot.tree import Body

Array = NDArray[np.float64]
JOINTS = {
    "revolute": pin.JointModelRevoluteUnaligned,
    "prismatic": pin.JointModelPrismaticUnaligned,
}


def pinocchio_tree(bodies: Sequence[Body]) -> pin.Model:
    """Bodies in any order in Pinocchio: joints about their own axes, fixed ones joined there.

    Its frames have the names of the bodies.
    """
    model = pin.Model()
    model.gravity = pin.Motion.Zero()
    base = next(body for body in bodies if body.joint is None)
    waiting = [(base, 0, pin.SE3.Identity())]
    while waiting:  # down each branch: Pinocchio's algorithms want joints in that order
        body, carrier, place = waiting.pop()
        if body.joint is None:
            carrier = model.addJoint(0, pin.JointModelFreeFlyer(), place, "root")
        else:
            joint = body.joint
            place = place * pin.SE3(joint.rotation, joint.rotation @ joint.offset)
            if joint.kind != "fixed":
                kind = JOINTS[joint.kind](joint.axis)
                carrier = model.addJoint(carrier, kind, place, joint.name)
                place = pin.SE3.Identity()
        if body.mass:
            inertia = pin.Inertia(body.mass, body.com, body.inertia)
            model.appendBodyToJoint(carrier, inertia, place)
        model.addBodyFrame(body.name, carrier, place, 0)
        waiting += [(child, carrier, place) for child in bodies if child.parent == body.name]
    return model


class TreeOracle:
    """A Pinocchio model that moves about, seen from the CoM of one of its bodies.

    Or from another place ``seen_from`` (3,) of the body, m.
    """

    def __init__(
        self,
        model: pin.Model,
        base: str,
        joint_names: Sequence[str],
        seed: int,
        seen_from: Array | None = None,
    ) -> None:
        rng = np.random.default_rng(seed)
        self.model = model
        self.model.gravity = pin.Motion.Zero()
        self.v = rng.normal(size=self.model.nv)
        angles = np.concatenate([np.zeros(6), rng.uniform(-3.0, 3.0, self.model.nv - 6)])
        self.q = pin.integrate(self.model, pin.neutral(self.model), angles)
        self.q[:3] = rng.normal(size=3)
        self.q[3:7] = Rotation.random(random_state=seed).as_quat()
        self.columns = [self.model.joints[self.model.getJointId(n)].idx_v for n in joint_names]
        self.positions, self.rates = angles[self.columns], self.v[self.columns]
        link = self.model.frames[self.model.getFrameId(base, pin.FrameType.BODY)]
        body = self.model.inertias[link.parentJoint]  # with all that is fixed to it
        place = pin.SE3(link.placement.rotation, body.lever if seen_from is None else seen_from)
        self.frame = self.model.addFrame(
            pin.Frame("seen from", link.parentJoint, place, pin.FrameType.OP_FRAME)
        )
        self.data = self.model.createData()

    def jacobian(self) -> Array:
        """From Pinocchio's velocities to ``[v0, w0, thetadot]`` on inertial axes."""
        rows = pin.computeFrameJacobian(
            self.model, self.data, self.q, self.frame, pin.LOCAL_WORLD_ALIGNED
        )
        return np.vstack([rows, np.eye(self.model.nv)[self.columns]])

    def drift(self) -> Array:
        """The acceleration of these if Pinocchio's velocities stay as they are."""
        zero = np.zeros(self.model.nv)
        pin.forwardKinematics(self.model, self.data, self.q, self.v, zero)
        found = pin.getFrameClassicalAcceleration(
            self.model, self.data, self.frame, pin.LOCAL_WORLD_ALIGNED
        )
        return np.concatenate([found.vector, np.zeros(len(self.columns))])

    def attitude(self) -> Array:
        """(4,) quaternion w, x, y, z of the body that is the base."""
        pin.framesForwardKinematics(self.model, self.data, self.q)
        return quaternion_of(Rotation.from_matrix(self.data.oMf[self.frame].rotation))


def assert_same_dynamics(robot: Robot, oracle: TreeOracle, seed: int) -> None:
    """H, c and the accelerations to 1e-12 of their largest."""
    J, quaternion = oracle.jacobian(), oracle.attitude()
    velocity = J @ oracle.v
    motion = (quaternion, oracle.positions, velocity[3:6], oracle.rates)
    H = mass_matrix(robot, quaternion, oracle.positions)
    M = pin.crba(oracle.model, oracle.data, oracle.q)
    M = np.triu(M) + np.triu(M, 1).T
    np.testing.assert_allclose(J.T @ H @ J, M, rtol=0.0, atol=1e-12 * np.max(np.abs(M)))

    c = bias_force(robot, *motion)
    expected = pin.nonLinearEffects(oracle.model, oracle.data, oracle.q, oracle.v)
    found = J.T @ (H @ oracle.drift() + c)
    scale = np.max(np.abs(J.T @ H @ J) @ np.abs(oracle.v)) * np.max(np.abs(oracle.v))
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-12 * scale)

    force = np.random.default_rng(seed + 1).normal(size=len(c))
    there = pin.aba(oracle.model, oracle.data, oracle.q, oracle.v, J.T @ force)
    here = forward_dynamics(robot, *motion, force)
    expected = J @ there + oracle.drift()
    scale = np.max(np.abs(expected)) + np.linalg.norm(np.linalg.inv(H) @ c)
    np.testing.assert_allclose(here, expected, rtol=0.0, atol=1e-12 * scale)
