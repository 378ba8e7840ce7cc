"""The nominal model as a linear function of the second moments of mass, for adaptive laws.

With a base whose translation floats, the model (`.rho_space`) is not linear in masses, centres of
mass and inertias: the kinetic energy has a part ``-|p|^2 / (2 M)``, with p the momentum relative to
the base. It is linear in other constants. The position of every mass point from the centre of mass
of the robot is ``sum_k y_k u_k(q)``: each ``u_k`` is one of 2n+3 vectors that move with the robot,
and the ``y_k`` are constants of the point. So

    T = 1/2 tr(Udot D Udot^T),   U = [u_1 ... u_(2n+3)],   D = integral of y y^T dm

The 2n+3 vectors are the axes x, y, z of the base, x and y of each body with a revolute joint (its z
is the joint's axis, which is fixed in its parent), and for a prismatic joint its axis times its
position. The coefficients of the bodies' centres of mass are the barycentric vectors of Wittenburg,
Dynamics of Systems of Rigid Bodies, 1977. D is positive definite for every robot whose bodies are.

If every body's mass, first moments and second moments lie between ``1 - r`` and ``1 + r`` times
nominal ones (as pseudo-inertia matrices: Wensing, Kim & Slotine, IEEE Robotics and Automation
Letters 3(1), 2018), then D lies between those of the two robots with all bodies scaled by ``1 - r``
and ``1 + r``: before the centre of mass is taken as origin the moments are a sum over the bodies,
and a Schur complement, which takes it, keeps the order of positive semidefinite matrices.

The robot moves with ``qdot = [w0, thetadot]``, w0 in inertial axes. With ``J_k`` the Jacobian of
``u_k``, so that its rate is ``J_k qdot``, the inertia matrix and bias force are

    H_r = sum_kl D_kl J_k^T J_l,   C_r = sum_kl D_kl J_k^T Jdot_l,   c_r = C_r qdot

``Hdot_r - 2 C_r`` is skew-symmetric, since D is symmetric. For any velocities v and s,

    s^T (H_r vdot + C_r v) = sum_kl D_kl (J_k s) . (J_l vdot + Jdot_l v)

so no matrix of the regressor is needed: the force is that of forces ``f_k = sum_l D_kl
(J_l vdot + Jdot_l v)`` on the vectors, and the gradient by D is the product of the two factors.
In ``rho = [eps_e, theta]`` the same holds with ``w0 = J0^-1 epsdot_e + omega_d`` (`take_rho`,
`force_in_rho`).
"""

from __future__ import annotations

from space_robot_msgs_py.compiled.kernels import kernel, subroutine
from space_robot_msgs_py.compiled.lanes import uniform, where, whole
from space_robot_msgs_py.compiled.records import Record, shaped

from ..elementary.functions import sin_cos
from ..elementary.matrices import Array
from .algebra import (
    Matrix,
    Symmetric,
    Vector,
    add,
    cross,
    dot,
    rotate_axes,
    scale,
    store,
    subtract,
    symmetric,
    transform,
    transform_symmetric,
    transform_transposed,
    vector,
)
from .attitude import attitude_jacobian_inverse, rotation_matrix
from .model import Model

THINNEST = 1e-8
"""Smallest second moment of a body relative to their sum: a plate or a wire without thickness gets
this one, so that D is positive definite beyond rounding."""


class MassCoordinates(Record):
    """Coefficients of the bodies' frames in the 2n+3 vectors, and scratch."""

    frame: Array = shaped(lambda n: (n + 1, 4, 2 * n + 3))
    """Axes x, y, z of each body and its origin, m, as sums of the vectors."""
    centre: Array = shaped(lambda n: (2 * n + 3,), "Centre of mass of the robot")
    arm: Array = shaped(lambda n: (2 * n + 3,), "From there to the centre of mass of one body")


@kernel
def mass_coordinates_into(model: Model, out: MassCoordinates) -> None:
    """Write the coefficients ``out.frame`` of all bodies of a robot without passive joints."""
    frame = out.frame
    for i in range(frame.shape[0]):
        for c in range(4):
            for k in range(frame.shape[2]):
                frame[i, c, k] = 0.0
    for c in range(3):
        frame[0, c, c] = 1.0
    for j in range(whole(model.joint_count)):
        own, parent, e = frame[j + 1], frame[whole(model.parent[j])], model.rotation[j]
        for k in range(frame.shape[2]):
            x, y, z = parent[0, k], parent[1, k], parent[2, k]
            for c in range(3):
                own[c, k] = x * e[c] + y * e[3 + c] + z * e[6 + c]
            axes = (own[0, k], own[1, k], own[2, k])
            own[3, k] = parent[3, k] + dot(axes, vector(model.offset[j], 0))
        if uniform(model.is_prismatic[j]) == 0.0:
            for c in range(2):
                for k in range(frame.shape[2]):
                    own[c, k] = 0.0
                own[c, 3 + 2 * j + c] = 1.0
        else:
            # the vector of a prismatic joint is its travel
            own[3, 3 + 2 * j] = 1.0


@kernel
def second_moments_into(
    model: Model, coordinates: MassCoordinates, factor: Array, out: Array
) -> None:
    """Write the second moments D of a robot whose bodies are scaled.

    Args:
        model: the robot.
        coordinates: by `mass_coordinates_into`; scratch is written.
        factor: (n+1,) by which mass and inertia of each body are multiplied, base first.
        out: (2n+3, 2n+3) D, kg m2; kg m and kg for the vectors of prismatic joints.
    """
    size = out.shape[0]
    _find_centre(model, coordinates, factor)
    for k in range(size):
        for c in range(size):
            out[k, c] = 0.0
    for i in range(coordinates.frame.shape[0]):
        mass, arm, frame = factor[i] * model.mass[i], coordinates.arm, coordinates.frame[i]
        for k in range(size):
            axes = (frame[0, k], frame[1, k], frame[2, k])
            arm[k] = frame[3, k] + dot(axes, vector(model.com[i], 0)) - coordinates.centre[k]
        inertia = symmetric(model.inertia[i])
        # second moments 1/2 tr(I) E - I, which are linear in I
        half = 0.5 * (inertia[0] + inertia[1] + inertia[2])
        half += _lacking_moment(inertia, half)
        moments = (
            factor[i] * (half - inertia[0]),
            factor[i] * (half - inertia[1]),
            factor[i] * (half - inertia[2]),
            -factor[i] * inertia[3],
            -factor[i] * inertia[4],
            -factor[i] * inertia[5],
        )
        for k in range(size):
            axes = (frame[0, k], frame[1, k], frame[2, k])
            row, weight = transform_symmetric(moments, axes), mass * arm[k]
            for c in range(size):
                axes = (frame[0, c], frame[1, c], frame[2, c])
                out[k, c] += dot(row, axes) + weight * arm[c]
    for j in range(whole(model.joint_count)):
        if uniform(model.is_prismatic[j]) != 0.0:  # its second vector is zero: any number will do
            out[4 + 2 * j, 4 + 2 * j] = factor[j + 1]
    for k in range(size):
        for c in range(k):
            out[c, k] = out[k, c]


@subroutine
def _lacking_moment(inertia: Symmetric, half: float) -> float:
    """Return what the second moments of a body lack to be positive definite, kg m2; mostly 0."""
    xx, yy, zz = half - inertia[0], half - inertia[1], half - inertia[2]
    xy, xz, yz = inertia[3], inertia[4], inertia[5]  # of the products only squares and xyz count
    minors = xx * yy - xy * xy + xx * zz - xz * xz + yy * zz - yz * yz
    determinant = xx * (yy * zz - yz * yz) - yy * xz * xz - zz * xy * xy - 2.0 * xy * xz * yz
    least = THINNEST * half
    lacking: float = where(determinant > least * abs(minors), 0.0, least)  # by 1 / sum(1 / moment)
    return lacking


@kernel
def _find_centre(model: Model, coordinates: MassCoordinates, factor: Array) -> None:
    centre, total = coordinates.centre, 0.0
    for k in range(centre.size):
        centre[k] = 0.0
    for i in range(coordinates.frame.shape[0]):
        frame, mass = coordinates.frame[i], factor[i] * model.mass[i]
        total += mass
        moment = scale(vector(model.com[i], 0), mass)
        for k in range(centre.size):
            axes = (frame[0, k], frame[1, k], frame[2, k])
            centre[k] += mass * frame[3, k] + dot(axes, moment)
    for k in range(centre.size):
        centre[k] /= total


class Regressor(Record):
    """Vectors and their motion for n joints, in inertial axes.

    The vectors of the base are the columns 0 to 2, those of joint j the columns ``3 + 2 j`` and
    ``4 + 2 j``; the second of a prismatic joint is zero.
    """

    velocity: Array = shaped(lambda n: (n + 3,), "qdot, rad/s and m/s")
    s: Array = shaped(lambda n: (n + 3,), "Any other velocity")
    v: Array = shaped(lambda n: (n + 3,), "And one more")
    v_rate: Array = shaped(lambda n: (n + 3,), "vdot, rad/s2 and m/s2")
    axes: Array = shaped(lambda n: (n + 1, 9), "Axes x, y and z of each body")
    motion: Array = shaped(lambda n: (n + 1, 12))
    """Angular velocity of each body with qdot, s and v, and the rate of the last."""
    torque: Array = shaped(lambda n: (n + 1, 3))
    """Torque on each body and all bodies that it carries, N m."""
    jacobian_inverse: Array = shaped(lambda n: (3, 3))
    """``J0^-1`` in the base frame; in inertial axes it is the transpose."""
    rotation: Array = shaped(lambda n: (3, 3), "Rotation from the base frame to the outer one")
    vectors: Array = shaped(lambda n: (3, 2 * n + 3), "``u_k``")
    sliding: Array = shaped(lambda n: (3, 2 * n + 3), "``J_k s``")
    acceleration: Array = shaped(lambda n: (3, 2 * n + 3), "``J_k vdot + Jdot_k v``")


@kernel
def vectors_into(model: Model, quaternion: Array, joint_positions: Array, out: Regressor) -> None:
    """Write ``out.axes`` and ``out.vectors`` of a robot without passive joints.

    Args:
        model: the robot.
        quaternion: (4,) base attitude, unit.
        joint_positions: (n,) rad, or m for prismatic joints.
        out: ``rotation`` is written, too.
    """
    rotation_matrix(quaternion, out.rotation)
    for k in range(3):
        for c in range(3):
            out.axes[0, 3 * k + c] = out.vectors[c, k] = out.rotation[c, k]
    for j in range(whole(model.joint_count)):
        parent = out.axes[whole(model.parent[j])]
        x, y, z = vector(parent, 0), vector(parent, 3), vector(parent, 6)
        x, y, z = rotate_axes(x, y, z, model.rotation[j])
        if uniform(model.is_prismatic[j]) == 0.0:
            st, ct = sin_cos(joint_positions[j])
            x, y = add(scale(x, ct), scale(y, st)), subtract(scale(y, ct), scale(x, st))
            store_column(x, out.vectors, 3 + 2 * j)
            store_column(y, out.vectors, 4 + 2 * j)
        else:
            store_column(scale(z, joint_positions[j]), out.vectors, 3 + 2 * j)
            store_column((0.0, 0.0, 0.0), out.vectors, 4 + 2 * j)
        store(x, out.axes[j + 1], 0)
        store(y, out.axes[j + 1], 3)
        store(z, out.axes[j + 1], 6)


@kernel
def take_rho(
    quaternion: Array,
    omega_desired: Array,
    alpha_desired: Array,
    rate: Array,
    s: Array,
    v: Array,
    v_rate: Array,
    out: Regressor,
) -> None:
    """Write ``out.velocity``, ``s``, ``v`` and ``v_rate`` from those in ``rho = [eps_e, theta]``.

    Args:
        quaternion: (4,) q_e, see `.rho_space`, unit; singular at eta = 0.
        omega_desired: (3,) desired angular velocity, on the desired frame's axes, rad/s.
        alpha_desired: (3,) desired angular acceleration, on the same, rad/s2.
        rate: (m,) rhodot.
        s: (m,) velocity in rho.
        v: (m,) velocity in rho.
        v_rate: (m,) its rate.
        out: ``jacobian_inverse`` is written, too.
    """
    attitude_jacobian_inverse(quaternion, out.jacobian_inverse)
    inverse = _nine(out.jacobian_inverse)
    epsilon_rate = vector(rate, 0)
    w = transform_transposed(inverse, epsilon_rate)
    wv = transform_transposed(inverse, vector(v, 0))
    # (2)
    eta_rate = -0.5 * dot(vector(quaternion, 1), w)
    # J0dot = (etadot E - skew(epsdot)) / 2 on the outer axes
    convective = scale(subtract(scale(wv, eta_rate), cross(epsilon_rate, wv)), 0.5)
    desired = vector(omega_desired, 0)
    of_frame = add(vector(alpha_desired, 0), cross(desired, wv))
    acceleration = transform_transposed(inverse, subtract(vector(v_rate, 0), convective))
    store(add(w, desired), out.velocity, 0)
    store(transform_transposed(inverse, vector(s, 0)), out.s, 0)
    store(add(wv, desired), out.v, 0)
    store(add(acceleration, of_frame), out.v_rate, 0)
    for i in range(3, rate.size):
        out.velocity[i], out.s[i], out.v[i], out.v_rate[i] = rate[i], s[i], v[i], v_rate[i]


@kernel
def motions_into(model: Model, out: Regressor) -> None:
    """Write ``out.sliding`` and ``out.acceleration`` from vectors and velocities."""
    w, ws, wv = vector(out.velocity, 0), vector(out.s, 0), vector(out.v, 0)
    a = vector(out.v_rate, 0)
    _keep(w, ws, wv, a, out.motion[0])
    for k in range(3):
        _move(w, ws, wv, a, k, out)
    for j in range(whole(model.joint_count)):
        row, first, z = out.motion[whole(model.parent[j])], 3 + 2 * j, vector(out.axes[j + 1], 6)
        rate, s, v = out.velocity[3 + j], out.s[3 + j], out.v[3 + j]
        w, ws, wv, a = vector(row, 0), vector(row, 3), vector(row, 6), vector(row, 9)
        # d/dt (v z): the axis turns with the parent
        along = add(scale(z, out.v_rate[3 + j]), scale(cross(w, z), v))
        if uniform(model.is_prismatic[j]) == 0.0:
            w, a = add(w, scale(z, rate)), add(a, along)
            ws, wv = add(ws, scale(z, s)), add(wv, scale(z, v))
            _move(w, ws, wv, a, first, out)
            _move(w, ws, wv, a, first + 1, out)
        else:
            _move(w, ws, wv, a, first, out)
            sliding = column(out.sliding, first)
            acceleration = column(out.acceleration, first)
            along = add(along, cross(wv, scale(z, rate)))
            store_column(add(sliding, scale(z, s)), out.sliding, first)
            store_column(add(acceleration, along), out.acceleration, first)
            store_column((0.0, 0.0, 0.0), out.sliding, first + 1)
            store_column((0.0, 0.0, 0.0), out.acceleration, first + 1)
        _keep(w, ws, wv, a, out.motion[j + 1])


@kernel
def force_on_vectors_into(model: Model, forces: Array, out: Regressor, total: Array) -> None:
    """Write ``sum_k J_k^T f_k``, after `vectors_into`.

    Args:
        model: the robot.
        forces: (3, 2n+3) f_k, inertial axes.
        out: with the vectors; ``torque`` is written.
        total: (m,) torque on the base in inertial axes and those of the joints, N m.
    """
    n = whole(model.joint_count)
    for i in range(n + 1):
        store((0.0, 0.0, 0.0), out.torque[i], 0)
    for j in range(n - 1, -1, -1):
        first, z, parent = 3 + 2 * j, vector(out.axes[j + 1], 6), out.torque[whole(model.parent[j])]
        own = _moment(first, forces, out)
        torque = add(vector(out.torque[j + 1], 0), own)
        torque = add(torque, _moment(first + 1, forces, out))
        if uniform(model.is_prismatic[j]) == 0.0:
            total[3 + j] = dot(z, torque)
        else:
            force = column(forces, first)
            total[3 + j] = dot(z, force)
        store(add(vector(parent, 0), torque), parent, 0)
    torque = vector(out.torque[0], 0)
    for k in range(3):
        torque = add(torque, _moment(k, forces, out))
    store(torque, total, 0)


@kernel
def force_in_rho(out: Regressor, force: Array) -> None:
    """Convert a force (m,) to the generalised force F_S, after `take_rho`."""
    inverse = _nine(out.jacobian_inverse)
    store(transform(inverse, vector(force, 0)), force, 0)


@subroutine
def column(vectors: Array, k: int) -> Vector:
    """Return column k of ``vectors`` (3, N)."""
    return vectors[0, k], vectors[1, k], vectors[2, k]


@subroutine
def store_column(a: Vector, vectors: Array, k: int) -> None:
    """Write ``a`` into column k of ``vectors`` (3, N)."""
    vectors[0, k], vectors[1, k], vectors[2, k] = a


@subroutine
def _moment(k: int, forces: Array, out: Regressor) -> Vector:
    u = column(out.vectors, k)
    force = column(forces, k)
    return cross(u, force)


@subroutine
def _move(w: Vector, ws: Vector, wv: Vector, a: Vector, k: int, out: Regressor) -> None:
    """Write the motion of a vector that is fixed in a body, see `Regressor.motion`."""
    u = column(out.vectors, k)
    store_column(cross(ws, u), out.sliding, k)
    store_column(add(cross(a, u), cross(wv, cross(w, u))), out.acceleration, k)


@subroutine
def _keep(w: Vector, ws: Vector, wv: Vector, a: Vector, row: Array) -> None:
    store(w, row, 0)
    store(ws, row, 3)
    store(wv, row, 6)
    store(a, row, 9)


@subroutine
def _nine(m: Array) -> Matrix:
    return m[0, 0], m[0, 1], m[0, 2], m[1, 0], m[1, 1], m[1, 2], m[2, 0], m[2, 1], m[2, 2]
