"""Attitude kinematics with unit quaternions ``[w, x, y, z]`` = ``{eta, eps}`` (Section II-A).

Two angular velocities are used: ``omega_base`` in the base frame, for which (1) holds, and
``omega_inertial``, for which its skew term has the opposite sign.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.compiled.kernels import kernel
from space_robot_msgs_py.compiled.lanes import where

Array = NDArray[np.float64]

SINGULAR_ETA = 1e-6
"""Limit of |eta| below which J0 counts as singular: a rotation by 180 degrees."""


@kernel
def rotation_matrix(quaternion: Array, out: Array) -> None:
    """Write into ``out`` (3, 3) the rotation from the base frame to the inertial frame."""
    w, x, y, z = quaternion[0], quaternion[1], quaternion[2], quaternion[3]
    out[0, 0] = 1.0 - 2.0 * (y * y + z * z)
    out[0, 1] = 2.0 * (x * y - w * z)
    out[0, 2] = 2.0 * (x * z + w * y)
    out[1, 0] = 2.0 * (x * y + w * z)
    out[1, 1] = 1.0 - 2.0 * (x * x + z * z)
    out[1, 2] = 2.0 * (y * z - w * x)
    out[2, 0] = 2.0 * (x * z - w * y)
    out[2, 1] = 2.0 * (y * z + w * x)
    out[2, 2] = 1.0 - 2.0 * (x * x + y * y)


@kernel
def quaternion_rate(quaternion: Array, omega_inertial: Array, out: Array) -> None:
    """Write into ``out`` (4,) the rate of ``quaternion``, 1/s, by ``J0^T`` of (1).

    ``omega_inertial`` (3,) is in inertial axes, rad/s.
    """
    w, x, y, z = quaternion[0], quaternion[1], quaternion[2], quaternion[3]
    p, q, r = omega_inertial[0], omega_inertial[1], omega_inertial[2]
    out[0] = -0.5 * (x * p + y * q + z * r)
    out[1] = 0.5 * (w * p + z * q - y * r)
    out[2] = 0.5 * (w * q - z * p + x * r)
    out[3] = 0.5 * (w * r + y * p - x * q)


@kernel
def attitude_jacobian(quaternion: Array, out: Array) -> None:
    """Write into ``out`` (3, 3) ``J0 = (eta E + skew(eps)) / 2`` of (1): epsdot = J0 omega_base."""
    w, x, y, z = 0.5 * quaternion[0], 0.5 * quaternion[1], 0.5 * quaternion[2], 0.5 * quaternion[3]
    out[0, 0], out[0, 1], out[0, 2] = w, -z, y
    out[1, 0], out[1, 1], out[1, 2] = z, w, -x
    out[2, 0], out[2, 1], out[2, 2] = -y, x, w


@kernel
def attitude_jacobian_inverse(quaternion: Array, out: Array) -> None:
    """Write into ``out`` (3, 3) ``J0^-1 = 2 (eta E - skew(eps) + eps eps^T / eta)``.

    Exact for a unit quaternion; the caller must avoid eta = 0 (``SINGULAR_ETA``).
    """
    w, x, y, z = quaternion[0], quaternion[1], quaternion[2], quaternion[3]
    out[0, 0] = 2.0 * (w + x * x / w)
    out[0, 1] = 2.0 * (z + x * y / w)
    out[0, 2] = 2.0 * (-y + x * z / w)
    out[1, 0] = 2.0 * (-z + y * x / w)
    out[1, 1] = 2.0 * (w + y * y / w)
    out[1, 2] = 2.0 * (x + y * z / w)
    out[2, 0] = 2.0 * (y + z * x / w)
    out[2, 1] = 2.0 * (-x + z * y / w)
    out[2, 2] = 2.0 * (w + z * z / w)


@kernel
def attitude_error_into(desired: Array, actual: Array, out: Array) -> None:
    """Write ``q_e = q_d* q`` (4,) into ``out``, with the sign nearer to what is there.

    Where there are zeros, eta is not negative.
    """
    a, b, c, d = desired[0], desired[1], desired[2], desired[3]
    w, x, y, z = actual[0], actual[1], actual[2], actual[3]
    eta = a * w + b * x + c * y + d * z
    ex = a * x - b * w - c * z + d * y
    ey = a * y + b * z - c * w - d * x
    ez = a * z - b * y + c * x - d * w
    near = out[0] * eta + out[1] * ex + out[2] * ey + out[3] * ez
    near = where(near == 0.0, eta, near)
    side = where(near < 0.0, -1.0, 1.0)
    out[0], out[1], out[2], out[3] = side * eta, side * ex, side * ey, side * ez


@kernel
def rotate(matrix: Array, vector: Array, out: Array) -> None:
    """Write ``matrix @ vector`` into ``out`` (3,); ``out`` must not be ``vector``."""
    for i in range(3):
        out[i] = matrix[i, 0] * vector[0] + matrix[i, 1] * vector[1] + matrix[i, 2] * vector[2]


@kernel
def rotate_back(matrix: Array, vector: Array, out: Array) -> None:
    """Write ``matrix.T @ vector`` into ``out`` (3,); ``out`` must not be ``vector``."""
    for i in range(3):
        out[i] = matrix[0, i] * vector[0] + matrix[1, i] * vector[1] + matrix[2, i] * vector[2]
