"""Robots and trees of bodies in independent programs: Pinocchio, SciPy, plain NumPy.

Further ones: `rotors` (wheels, and motors behind gears), `momenta`, `orbit`, `second_moments`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation
from strategies import BASE, State

from space_robot_model.elementary.matrices import Array
from space_robot_model.robot import Robot
from space_robot_model.robot.dynamics import bias_force, forward_dynamics, mass_matrix
from space_robot_model.robot.parts import Base, Body, RobotTree
from space_robot_msgs_py.compiled.records import Block
from space_robot_msgs_py.samples import Reference


def assert_close(actual: ArrayLike, expected: ArrayLike, tolerance: float) -> None:
    """Every element agrees to ``tolerance`` of the largest."""
    size = float(np.max(np.abs(expected), initial=0.0))
    np.testing.assert_allclose(actual, expected, rtol=0.0, atol=tolerance * size)


def skew(v: ArrayLike) -> Array:
    """``skew(v) @ w = v x w``."""
    x, y, z = np.asarray(v)
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def rotation_of(quaternion: ArrayLike) -> Rotation:
    """SciPy's rotation of ``[w, x, y, z]``."""
    return Rotation.from_quat(np.roll(quaternion, -1))


def quaternion_of(rotation: Rotation) -> Array:
    """``[w, x, y, z]`` of SciPy's rotation."""
    return np.roll(rotation.as_quat(), 1)


def multiplied(a: Array, b: Array) -> Array:
    """Hamilton's product of two quaternions ``[w, x, y, z]`` of any norm."""
    w = a[0] * b[0] - a[1:] @ b[1:]
    return np.array([w, *(a[0] * b[1:] + b[0] * a[1:] + np.cross(a[1:], b[1:]))])


class RelativeMotion(NamedTuple):
    """A base relative to a desired frame D, by the product rule of quaternions."""

    error: Array
    """q_e = q_d* q, eta >= 0."""
    rate: Array
    """epsdot_e."""
    second_rate: Callable[[Array], Array]
    """epsdd_e for an angular acceleration (3,) of the base, on inertial axes."""

    @classmethod
    def of(cls, desired: Array, state: State) -> RelativeMotion:
        """Of a reference (10,): q_d, omega_d and alpha_d on D's axes; ``state`` is inertial."""
        q_d, omega, alpha = desired[:4], *(np.array([0.0, *desired[k : k + 3]]) for k in (4, 7))
        w = np.array([0.0, *state.w0])
        q = state.quaternion if state.quaternion @ q_d >= 0.0 else -state.quaternion
        d_rate, q_rate = 0.5 * multiplied(q_d, omega), 0.5 * multiplied(w, q)
        d_second = 0.5 * (multiplied(d_rate, omega) + multiplied(q_d, alpha))
        back = [part * [1.0, -1.0, -1.0, -1.0] for part in (q_d, d_rate, d_second)]

        def second_rate(acceleration: Array) -> Array:
            own = multiplied(np.array([0.0, *acceleration]), q) + multiplied(w, q_rate)
            second = multiplied(back[2], q) + 2.0 * multiplied(back[1], q_rate)
            result: Array = (second + multiplied(back[0], 0.5 * own))[1:]
            return result

        rate = multiplied(back[1], q) + multiplied(back[0], q_rate)
        return cls(multiplied(back[0], q), rate[1:], second_rate)


def turned(quaternion: ArrayLike, angle_inertial: ArrayLike) -> Array:
    """``quaternion`` turned by a rotation vector on inertial axes, on the same side."""
    result = quaternion_of(
        Rotation.from_rotvec(np.asarray(angle_inertial)) * rotation_of(quaternion)
    )
    return result if result @ np.asarray(quaternion) >= 0.0 else -result


def attitude_jacobian_inertial(quaternion: ArrayLike) -> Array:
    """``J0 = (eta E - skew(eps)) / 2``: epsdot from the angular velocity on inertial axes."""
    q = np.asarray(quaternion)
    return 0.5 * (q[0] * np.eye(3) - skew(q[1:]))


def attitude_jacobian_base(quaternion: ArrayLike) -> Array:
    """(1): ``J0 = (eta E + skew(eps)) / 2``, epsdot from the angular velocity in the base frame."""
    return np.ascontiguousarray(attitude_jacobian_inertial(quaternion).T)


def pinocchio_model(robot: Robot) -> pin.Model:
    """The same robot in Pinocchio, without gravity: a free-flyer and joints of z.

    Its joints are in the order of ``robot.order``, see `visited`.
    """
    model = pin.Model()
    identity = pin.SE3.Identity()
    joint = model.addJoint(0, pin.JointModelFreeFlyer(), identity, "base")
    model.appendBodyToJoint(
        joint, pin.Inertia(robot.mass[0], robot.com[0], robot.inertia[0]), identity
    )
    numbers = {0: joint}
    for i in robot.order:
        placement = pin.SE3(robot.rotation[i], robot.rotation[i] @ robot.offset[i])
        kind = pin.JointModelPZ() if robot.is_prismatic[i] else pin.JointModelRZ()
        joint = model.addJoint(numbers[robot.parent[i]], kind, placement, f"joint{i + 1}")
        numbers[i + 1] = joint
        inertia = pin.Inertia(robot.mass[i + 1], robot.com[i + 1], robot.inertia[i + 1])
        model.appendBodyToJoint(joint, inertia, identity)
    model.gravity = pin.Motion.Zero()
    return model


def visited(robot: Robot, state: State) -> State:
    """The state with its joints in the order of Pinocchio's model of the robot."""
    order = list(robot.order)
    return state._replace(theta=state.theta[order], rate=state.rate[order])


def pinocchio_state(state: State, position: ArrayLike = (0.0, 0.0, 0.0)) -> tuple[Array, Array]:
    """Configuration and velocity as Pinocchio wants them: base twist in the base frame."""
    q = state.quaternion
    back = rotation_of(q).as_matrix().T
    configuration = np.concatenate([np.asarray(position), q[1:], q[:1], state.theta])
    return configuration, np.concatenate([back @ state.v0, back @ state.w0, state.rate])


def to_base_axes(quaternion: ArrayLike, size: int) -> Array:
    """blkdiag(R^T, R^T, E): base parts of a generalised vector from inertial to base axes."""
    matrix = np.eye(size)
    matrix[:3, :3] = matrix[3:6, 3:6] = rotation_of(quaternion).as_matrix().T
    return matrix


def pinocchio_mass_matrix(robot: Robot, state: State, position: ArrayLike = (0, 0, 0)) -> Array:
    """H of (7) by composite rigid bodies."""
    model = pinocchio_model(robot)
    upper = np.triu(pin.crba(model, model.createData(), pinocchio_state(state, position)[0]))
    to_base = to_base_axes(state.quaternion, robot.joint_count + 6)
    return to_base.T @ (upper + np.triu(upper, 1).T) @ to_base


def rho_space_inertia(robot: Robot, quaternion: Array, theta: Array) -> Array:
    """H_S by Pinocchio, (25) and the elimination of the base's translation."""
    zero = np.zeros(3)
    h = pinocchio_mass_matrix(robot, State(quaternion, theta, zero, zero, 0.0 * theta))
    reduced = h[3:, 3:] - h[3:, :3] @ np.linalg.solve(h[:3, :3], h[:3, 3:])
    inverse = np.eye(robot.n + 3)
    inverse[:3, :3] = np.linalg.inv(attitude_jacobian_inertial(quaternion))
    return inverse.T @ reduced @ inverse


def pinocchio_bias_force(robot: Robot, state: State, position: ArrayLike = (0, 0, 0)) -> Array:
    """c of (7) by recursive Newton-Euler, where the base CoM's acceleration is zero."""
    model = pinocchio_model(robot)
    configuration, velocity = pinocchio_state(state, position)
    spatial = np.zeros(robot.joint_count + 6)
    spatial[:3] = -np.cross(velocity[3:6], velocity[:3])
    force = pin.rnea(model, model.createData(), configuration, velocity, spatial)
    return to_base_axes(state.quaternion, robot.joint_count + 6).T @ force


def pinocchio_forward_dynamics(robot: Robot, state: State, force: Array) -> Array:
    """``[v0dot, w0dot, thetadd]`` on inertial axes by Pinocchio's articulated bodies."""
    model = pinocchio_model(robot)
    return pinocchio_acceleration(model, model.createData(), state, force)


def pinocchio_acceleration(model: Any, data: Any, state: State, force: Array) -> Array:
    """`pinocchio_forward_dynamics` with a model made before."""
    configuration, velocity = pinocchio_state(state)
    to_base = to_base_axes(state.quaternion, force.size)
    spatial = pin.aba(model, data, configuration, velocity, to_base @ force).copy()
    spatial[:3] += np.cross(velocity[3:6], velocity[:3])
    return to_base.T @ spatial


def references_of(states: list[State], accelerations: Array) -> Block:
    """``accelerations``: (N, n+3), of the base about inertial axes, then of the joints."""
    found = np.empty(len(states), Reference.dtype(states[0].theta.size))
    for row, state, acceleration in zip(found, states, accelerations, strict=True):
        back = rotation_of(state.quaternion).as_matrix().T
        row["quaternion"], row["joint_positions"] = state.quaternion, state.theta
        row["omega_base"], row["joint_velocities"] = back @ state.w0, state.rate
        row["alpha_base"], row["joint_accelerations"] = back @ acceleration[:3], acceleration[3:]
    return found


def in_inertial(state: State, torque: Array) -> Array:
    """The force (n+6,) on inertial axes of a torque on the base's axes and the joints."""
    base = rotation_of(state.quaternion).as_matrix() @ torque[:3]
    return np.concatenate([np.zeros(3), base, torque[3:]])


JOINTS = {
    "revolute": pin.JointModelRevoluteUnaligned,
    "prismatic": pin.JointModelPrismaticUnaligned,
}


def pinocchio_tree(tree: RobotTree) -> pin.Model:
    """Links in any order in Pinocchio: joints about their own axes, fixed ones joined there.

    Its frames have the names of the links.
    """
    model = pin.Model()
    model.gravity = pin.Motion.Zero()
    waiting: list[tuple[Base | Body, int, pin.SE3]] = [(tree.base, 0, pin.SE3.Identity())]
    while waiting:  # down each branch: Pinocchio's algorithms want joints in that order
        body, carrier, place = waiting.pop()
        if isinstance(body, Base):
            carrier = model.addJoint(0, pin.JointModelFreeFlyer(), place, "root")
        else:
            place = place * pin.SE3(body.rotation, body.rotation @ body.offset)
            if body.joint != "fixed":
                kind = JOINTS[body.joint](body.axis)
                carrier = model.addJoint(carrier, kind, place, body.joint_label)
                place = pin.SE3.Identity()
        if body.mass:
            inertia = pin.Inertia(body.mass, body.com, body.inertia)
            model.appendBodyToJoint(carrier, inertia, place)
        model.addBodyFrame(body.name, carrier, place, 0)
        waiting += [(link, carrier, place) for link in tree.links if link.parent == body.name]
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


class ToolOracle(TreeOracle):
    """Pinocchio's motion of a tree with zero momenta, and of one of its tools."""

    def __init__(self, robot: Robot, tree: RobotTree, tool: str, seed: int) -> None:
        super().__init__(pinocchio_tree(tree), BASE, robot.all_joint_names, seed)
        name = tool.removeprefix("tool of ")
        frame = next(own for own in tree.tools if own.name == tool)
        carrier = self.model.frames[self.model.getFrameId(name, pin.FrameType.BODY)]
        at = carrier.placement * pin.SE3(frame.rotation, frame.position)
        self.tool = self.model.addFrame(
            pin.Frame(tool, carrier.parentJoint, at, pin.FrameType.OP_FRAME)
        )
        self.data = self.model.createData()
        pin.framesForwardKinematics(self.model, self.data, self.q)
        self.map = pin.computeCentroidalMap(self.model, self.data, self.q).copy()

    def jacobian_of(self, attitude: str) -> Array:
        """Twist of the tool by joint velocities: the base moves as the momenta ask for."""
        base, joints = self.map[:, :6], self.map[:, self.columns]
        if attitude == "held":  # Pinocchio's base velocity is linear first
            base, joints = base[:3, :3], joints[:3]
        velocity = np.zeros((self.model.nv, len(self.columns)))
        velocity[self.columns] = np.eye(len(self.columns))
        velocity[: len(base)] = -np.linalg.solve(base, joints)
        rows: Array = pin.computeFrameJacobian(
            self.model, self.data, self.q, self.tool, pin.LOCAL_WORLD_ALIGNED
        )
        return rows @ velocity


def dynamics_differences(robot: Robot, oracle: TreeOracle, seed: int) -> tuple[float, ...]:
    """Largest differences of H, c and the accelerations, each relative to its largest number."""
    J, quaternion = oracle.jacobian(), oracle.attitude()
    velocity = J @ oracle.v
    motion = (quaternion, oracle.positions, velocity[3:6], oracle.rates)
    H = mass_matrix(robot, quaternion, oracle.positions)
    M = pin.crba(oracle.model, oracle.data, oracle.q)
    M = np.triu(M) + np.triu(M, 1).T
    of_mass = np.abs(J.T @ H @ J - M).max() / np.abs(M).max()

    c = bias_force(robot, *motion)
    expected = pin.nonLinearEffects(oracle.model, oracle.data, oracle.q, oracle.v)
    scale = np.max(np.abs(J.T @ H @ J) @ np.abs(oracle.v)) * np.max(np.abs(oracle.v))
    of_bias = np.abs(J.T @ (H @ oracle.drift() + c) - expected).max() / scale

    force = np.random.default_rng(seed + 1).normal(size=len(c))
    there = pin.aba(oracle.model, oracle.data, oracle.q, oracle.v, J.T @ force)
    here = forward_dynamics(robot, *motion, force)
    parts = np.array([J @ there, oracle.drift()])
    scale = np.max(np.abs(parts)) + np.linalg.norm(np.linalg.inv(H) @ c)
    of_acceleration = np.abs(here - parts.sum(axis=0)).max() / scale
    return float(of_mass), float(of_bias), float(of_acceleration)


def assert_same_dynamics(robot: Robot, oracle: TreeOracle, seed: int) -> None:
    """H, c and the accelerations to 1e-12 of their largest."""
    assert max(dynamics_differences(robot, oracle, seed)) <= 1e-12
