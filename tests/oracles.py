"""Independent programs to compare with: Pinocchio, MuJoCo, SciPy, and plain NumPy formulas."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import mujoco
import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike, NDArray
from random_robots import State
from scipy.spatial.transform import Rotation

from space_robot_model.robot import Robot

Array = NDArray[np.float64]


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
        joint, pin.Inertia(robot.mass[0], np.zeros(3), robot.inertia[0]), identity
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
    """The state with its joints in the order of Pinocchio's and MuJoCo's models of the robot."""
    order = list(robot.order)
    return state._replace(theta=state.theta[order], rate=state.rate[order])


def visited_rows(robot: Robot) -> list[int]:
    """The rows of generalised vectors, [v0, w0, joints], in the order of those models."""
    return [*range(6), *(6 + joint for joint in robot.order)]


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


def mujoco_numbers(values: Sequence[float] | Array) -> str:
    """As MJCF has them, to the last digit."""
    return " ".join(repr(float(value)) for value in values)


def mujoco_inertial(com: Array, mass: float, tensor: Array) -> str:
    """A body's inertia in MJCF, ``tensor`` about its centre of mass."""
    full = [tensor[ij] for ij in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))]
    return (
        f'<inertial pos="{mujoco_numbers(com)}" mass="{float(mass)!r}" '
        f'fullinertia="{mujoco_numbers(full)}"/>'
    )


def mujoco_model(robot: Robot, base: str = "", on_base: str = "") -> mujoco.MjModel:
    """The same robot in MuJoCo, without gravity: a free joint, and hinges and slides of z.

    In MJCF, ``base`` is another `mujoco_inertial` for the base, and ``on_base`` are more bodies on
    it; their joints stand behind the robot's.
    """

    def inertial(body: int) -> str:
        return mujoco_inertial(robot.com[body], robot.mass[body], robot.inertia[body])

    def branch(body: int) -> str:
        text = inertial(body)
        for i in robot.order:
            if robot.parent[i] != body:
                continue
            place = robot.rotation[i] @ robot.offset[i]
            kind = "slide" if robot.is_prismatic[i] else "hinge"
            turn = mujoco_numbers(quaternion_of(Rotation.from_matrix(robot.rotation[i])))
            text += (
                f'<body pos="{mujoco_numbers(place)}" quat="{turn}">'
                f'<joint type="{kind}" axis="0 0 1"/>{branch(i + 1)}'
                "</body>"
            )
        return text

    text = branch(0).replace(inertial(0), base or inertial(0), 1)
    text = f'<body name="base"><freejoint/>{text}{on_base}</body>'
    return mujoco.MjModel.from_xml_string(
        f'<mujoco><option gravity="0 0 0"/><worldbody>{text}</worldbody></mujoco>'
    )


def mujoco_forward_dynamics(robot: Robot, state: State, force: Array) -> Array:
    """``[v0dot, w0dot, thetadd]`` on inertial axes by MuJoCo."""
    return mujoco_acceleration(mujoco_model(robot), state, force)


def mujoco_acceleration(model: mujoco.MjModel, state: State, force: Array) -> Array:
    """`mujoco_forward_dynamics` with a model made before."""
    data = mujoco.MjData(model)
    rotation = rotation_of(state.quaternion).as_matrix()
    data.qpos[3:7], data.qpos[7:] = state.quaternion, state.theta
    data.qvel[:3], data.qvel[6:] = state.v0, state.rate
    data.qvel[3:6] = rotation.T @ state.w0  # MuJoCo: base turn in the base frame, the rest inertial
    data.qfrc_applied[:] = force
    data.qfrc_applied[3:6] = rotation.T @ force[3:6]
    mujoco.mj_forward(model, data)
    acceleration = data.qacc.copy()
    acceleration[3:6] = rotation @ acceleration[3:6]
    return acceleration
