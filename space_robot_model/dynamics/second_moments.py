"""The second moments of a free-floating robot's mass, in which its model is exactly linear.

With a base whose translation floats, the model (`.rho_space`) is not linear in masses, centres of
mass and inertias: the kinetic energy has a part ``-|p|^2 / (2 M)``, with p the momentum relative to
the base. It is linear in other constants. The position of every mass point from the centre of mass
of the robot is ``sum_k y_k u_k(q)``: each ``u_k`` is one of 2n+3 vectors that move with the robot
(`.regressor`), and the ``y_k`` are constants of the point. So

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
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.compiled.kernels import kernel, subroutine
from space_robot_msgs_py.compiled.lanes import uniform, where, whole
from space_robot_msgs_py.compiled.records import Record, shaped

from .algebra import Symmetric, dot, scale, symmetric, transform_symmetric, vector
from .model import Model

Array = NDArray[np.float64]

THINNEST = 1e-8
"""Smallest second moment of a body relative to their sum: a plate or a wire without thickness gets
this one, so that D is positive definite beyond rounding."""


class MassCoordinates(Record):
    """Coefficients of the bodies' frames in the 2n+3 vectors, and scratch."""

    frame: Array = shaped(lambda n: (n + 1, 4, 2 * n + 3))
    """Axes x, y, z of each body and its origin, m, as sums of the vectors."""
    centre: Array = shaped(lambda n: (2 * n + 3,))
    """Centre of mass of the robot."""
    arm: Array = shaped(lambda n: (2 * n + 3,))
    """From there to the centre of mass of one body."""


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
    """Write the robot's centre of mass into ``coordinates.centre``."""
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
