"""Jacobians of a tool on a robot whose base moves.

The tool's twist is ``xdot = [v; w]`` (m/s, rad/s): the velocity of its origin and its angular
velocity, both on inertial axes. With the generalised velocity ``[v0, w0, thetadot]`` of (7)

    xdot = J_b [v0; w0] + J_m thetadot

Linear and angular momentum (the latter about the robot's centre of mass, inertial axes) are

    P = M v0 + H_vw w0 + H_vm thetadot
    L = H~_ww w0 + H~_wm thetadot,    H~ = H_w. - H_wv H_v. / M

No force acts on the robot as a whole, so P is constant. It is zero here: velocities are seen from
the axes that move with the robot's centre of mass. That eliminates ``v0``:

- attitude held or led: ``xdot = J_w w0 + J_held thetadot``
- base free (L = 0): ``w0 = -H~_ww^-1 H~_wm thetadot`` and ``xdot = J_g thetadot``, the generalised
  Jacobian (Umetani & Yoshida 1989). Its singularities depend on masses: dynamic singularities.

Joint motions with ``H~_wm thetadot = 0`` need no torque on the base: the reaction null space
(Nenchev, Yoshida & Uchiyama 1992).
"""

from __future__ import annotations

from space_robot_msgs_py.compiled.kernels import kernel, subroutine
from space_robot_msgs_py.compiled.records import Record, nested, shaped

from ..elementary.matrices import Array
from .algebra import (
    Vector,
    add,
    cross,
    dot,
    inverse_symmetric,
    load_frame,
    scale,
    store,
    subtract,
    symmetric,
    transform,
    transform_symmetric,
    vector,
)
from .crba import crba
from .kinematics import forward_kinematics
from .model import Data, Model


class ToolKinematics(Record):
    """Pose and Jacobians of a tool, for N joints in the order of `Model`."""

    position: Array = shaped(lambda n: (3,))
    """Origin of the tool from the robot's centre of mass, inertial axes, m."""
    centre_of_mass: Array = shaped(lambda n: (3,))
    """The robot's centre of mass from the base's, inertial axes, m."""
    rotation: Array = shaped(lambda n: (3, 3))
    """Rotation from the tool's frame to the inertial frame."""
    base: Array = shaped(lambda n: (6, 6), "``J_b``")
    joints: Array = shaped(lambda n: (6, n), "``J_m``")
    attitude: Array = shaped(lambda n: (6, 3))
    """``J_w``: twist by angular velocity of the base, P = 0."""
    held: Array = shaped(lambda n: (6, n))
    """``J_held``: twist by joint velocities, attitude held, P = 0."""
    free: Array = shaped(lambda n: (6, n))
    """``J_g``: twist by joint velocities, base free, P = 0 and L = 0."""
    turn: Array = shaped(lambda n: (3, n))
    """``-H~_ww^-1 H~_wm``: angular velocity of a free base by joint velocities, inertial axes."""
    coupling: Array = shaped(lambda n: (3, n))
    """``H~_wm``: angular momentum about the centre of mass by joint velocities, N m s per rad/s."""
    inertia: Array = shaped(lambda n: (6,))
    """``H~_ww``: inertia of the whole about its centre of mass, xx, yy, zz, xy, xz, yz, kg m2."""
    full_inertia: Array = shaped(lambda n: (n + 6, n + 6), "H of (7)")
    data: Data = nested(Data)


@kernel
def tool_kinematics_into(
    model: Model,
    quaternion: Array,
    joint_positions: Array,
    body: int,
    mounting: Array,
    point: Array,
    out: ToolKinematics,
) -> None:
    """Fill ``out`` for a tool that is fixed to a body.

    Args:
        model: the robot.
        quaternion: (4,) base attitude, unit.
        joint_positions: (N,) rad, or m of prismatic joints, in the order of ``model``.
        body: number of the body in ``model`` that carries the tool.
        mounting: (3, 3) rotation from the tool's frame to the body's.
        point: (3,) origin of the tool in the body's frame, m.
        out: results and scratch.
    """
    forward_kinematics(model, quaternion, joint_positions, out.data)
    crba(model, out.data, out.full_inertia)
    axes, origin = load_frame(out.data.frame[body])
    tool = add(origin, transform(axes, vector(point, 0)))
    for k in range(3):
        column = transform(axes, (mounting[0, k], mounting[1, k], mounting[2, k]))
        out.rotation[0, k], out.rotation[1, k], out.rotation[2, k] = column
    _fixed_base(model, body, tool, out)
    _momentum_coupling(tool, out)
    _eliminate_base(out)


@subroutine
def _fixed_base(model: Model, body: int, tool: Vector, out: ToolKinematics) -> None:
    out.base[:] = 0.0
    out.joints[:] = 0.0
    for k in range(6):
        out.base[k, k] = 1.0
    out.base[0, 4], out.base[0, 5] = tool[2], -tool[1]  # w0 x tool
    out.base[1, 3], out.base[1, 5] = -tool[2], tool[0]
    out.base[2, 3], out.base[2, 4] = tool[1], -tool[0]
    i = body
    # only joints between the tool and the base move it
    while i > 0:
        angular, linear = vector(out.data.motion[i], 0), vector(out.data.motion[i], 3)
        linear = add(linear, cross(angular, tool))
        for k in range(3):
            out.joints[k, i - 1], out.joints[3 + k, i - 1] = linear[k], angular[k]
        i = int(model.parent[i - 1])


@subroutine
def _momentum_coupling(tool: Vector, out: ToolKinematics) -> None:
    full = out.full_inertia
    mass = full[0, 0]
    com = (full[1, 5] / mass, full[2, 3] / mass, full[0, 4] / mass)
    store(com, out.centre_of_mass, 0)
    store(subtract(tool, com), out.position, 0)
    for j in range(out.coupling.shape[1]):
        linear = (full[0, 6 + j], full[1, 6 + j], full[2, 6 + j])
        moment = cross(com, linear)
        for k in range(3):
            out.coupling[k, j] = full[3 + k, 6 + j] - moment[k]
    # H~_ww: H_w moved from the base to the centre of mass, parallel axes
    square = dot(com, com)
    out.inertia[0] = full[3, 3] - mass * (square - com[0] * com[0])
    out.inertia[1] = full[4, 4] - mass * (square - com[1] * com[1])
    out.inertia[2] = full[5, 5] - mass * (square - com[2] * com[2])
    out.inertia[3] = full[3, 4] + mass * com[0] * com[1]
    out.inertia[4] = full[3, 5] + mass * com[0] * com[2]
    out.inertia[5] = full[4, 5] + mass * com[1] * com[2]


@subroutine
def _eliminate_base(out: ToolKinematics) -> None:
    full = out.full_inertia
    # P = 0 gives v0, L = 0 gives w0; each is put into the twist
    mass, mobility = full[0, 0], inverse_symmetric(symmetric(out.inertia))
    for c in range(3):
        for r in range(3):
            out.attitude[r, c] = out.base[r, 3 + c] - full[r, 3 + c] / mass
            out.attitude[3 + r, c] = out.base[3 + r, 3 + c]
    for j in range(out.coupling.shape[1]):
        momentum = (out.coupling[0, j], out.coupling[1, j], out.coupling[2, j])
        turn = scale(transform_symmetric(mobility, momentum), -1.0)
        for r in range(3):
            out.turn[r, j] = turn[r]
            out.held[r, j] = out.joints[r, j] - full[r, 6 + j] / mass
            out.held[3 + r, j] = out.joints[3 + r, j]
        for r in range(6):
            out.free[r, j] = out.held[r, j] + dot(vector(out.attitude[r], 0), turn)
