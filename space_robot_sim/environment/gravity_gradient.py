"""The Earth's gravity on a robot, as seen from a reference point that falls with it.

With R the position of the reference point from the Earth's centre and d that of a body's centre of
mass from the reference point, a body of mass m is drawn by ``m (g(R + d) - g(R))``. The difference
is computed without cancellation (Battin, An Introduction to the Mathematics and Methods of
Astrodynamics, 1999, section 8.4): with ``q = (2 R . d + d . d) / R^2``

    (1 + q)^(-k/2) - 1 = ((1 + q)^-k - 1) / ((1 + q)^(-k/2) + 1)

so that it is exact also for d of millimetres. J2 is the Earth's oblateness, about z.

A body's inertia I adds to its potential ``mu / (2 r^3) (3 u . I u - tr I)``, u = r / |r|, hence

    torque  3 mu / r^3  u x I u
    force  -3 mu / r^4 (I u + (tr I / 2 - 5/2 u . I u) u)

(Hughes, Spacecraft Attitude Dynamics, 1986, section 8.1). The force is some 1e-13 of the weight;
with it, energy and momentum about the Earth are conserved. J2 is left out of these two.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from space_robot_model.dynamics.algebra import (
    Vector,
    add,
    cross,
    dot,
    scale,
    store,
    subtract,
    symmetric,
    transform_symmetric,
    vector,
)
from space_robot_model.dynamics.model import Data, Model
from space_robot_model.orbit.elements import MU, OBLATENESS
from space_robot_msgs_py.compiled.kernels import kernel, subroutine
from space_robot_msgs_py.compiled.lanes import uniform, whole

Array = NDArray[np.float64]


@subroutine
def gravity_difference(r: Vector, d: Vector, has_j2: float) -> tuple[Vector, float]:
    """Return ``g(r + d) - g(r)``, m/s2, and ``|r + d| / |r|``."""
    square = dot(r, r)
    distance, per_square = np.sqrt(square), 1.0 / square
    q = (2.0 * dot(r, d) + dot(d, d)) * per_square
    c, end = 1.0 + q, add(r, d)
    root = np.sqrt(c)
    c3 = c * root
    # p_k = (1 + q)^(-k/2) - 1 of the module's formula, the polynomials by Horner's rule
    p3 = -q * (3.0 + q * (3.0 + q)) / (c3 * (1.0 + c3))
    fall = scale(add(d, scale(end, p3)), -MU / (square * distance))
    if uniform(has_j2) != 0.0:
        c5 = c3 * c
        c7 = c5 * c
        p5 = -q * (5.0 + q * (10.0 + q * (10.0 + q * (5.0 + q)))) / (c5 * (1.0 + c5))
        p7 = q * (7.0 + q * (21.0 + q * (35.0 + q * (35.0 + q * (21.0 + q * (7.0 + q))))))
        p7 = -p7 / (c7 * (1.0 + c7))
        # of a = 1/r^5 and b = 5 z^2/r^7, relative to r^5: their values at the end, and changes
        z, z_end = r[2], end[2]
        b = 5.0 * z_end * z_end * per_square
        change_a = p5
        change_b = b * p7 + 5.0 * (z_end + z) * d[2] * per_square
        a_end, b_end = 1.0 + p5, b * (1.0 + p7)
        across = a_end - b_end
        pull = (
            d[0] * across + r[0] * (change_a - change_b),
            d[1] * across + r[1] * (change_a - change_b),
            d[2] * (3.0 * a_end - b_end) + z * (3.0 * change_a - change_b),
        )
        fall = add(fall, scale(pull, -OBLATENESS / (square * square * distance)))
    return fall, root


@kernel
def add_gravity_gradient(
    model: Model, reference: Array, base_position: Array, has_j2: float, data: Data
) -> None:
    """Add gravity to the bias forces of all bodies, which oppose the forces on them.

    ``reference`` is the reference point's position from the Earth's centre, ``base_position`` that
    of the base's CoM from there, m, inertial axes; ``data`` has the bodies' places.
    """
    r, base = vector(reference, 0), vector(base_position, 0)
    away = np.sqrt(dot(r, r))
    for i in range(whole(model.joint_count) + 1):
        mass = model.mass[i]
        first = vector(data.first_moment[i], 0)
        com = scale(first, 1.0 / mass)
        place = add(base, com)
        fall, ratio = gravity_difference(r, place, has_j2)
        force = scale(fall, mass)
        # of the body's extent: inertia about its centre of mass, from that about its frame
        nearness = 1.0 / (away * ratio)
        u = scale(add(r, place), nearness)
        own = symmetric(data.inertia[i])
        along = dot(com, u)
        reach = dot(first, com)
        turned = add(subtract(transform_symmetric(own, u), scale(u, reach)), scale(first, along))
        rate = 3.0 * MU * nearness * nearness * nearness
        trace = own[0] + own[1] + own[2] - 2.0 * reach
        lift = add(turned, scale(u, 0.5 * trace - 2.5 * dot(u, turned)))
        force = subtract(force, scale(lift, rate * nearness))
        moment = add(cross(com, force), scale(cross(u, turned), rate))
        store(subtract(vector(data.bias[i], 0), moment), data.bias[i], 0)
        store(subtract(vector(data.bias[i], 3), force), data.bias[i], 3)
