"""The Earth's gravity (J2 is its oblateness, about z), and free fall in it.

The reference point, and a target beside it, fall from one node of time to the next.

Leapfrog steps have an error in even powers of their length. A node's step is taken in one, two,
three and four of them, and what is left of the error is of the ninth power (Hairer, Norsett,
Wanner, Solving Ordinary Differential Equations I, 1993, section II.9). Between nodes the motion is
a quintic through position, velocity and acceleration.
"""

from __future__ import annotations

import numpy as np

from space_robot_msgs_py.compiled.kernels import kernel, subroutine
from space_robot_msgs_py.compiled.lanes import uniform

from ..dynamics.algebra import Vector, add, dot, scale, store, subtract, vector
from ..elementary.matrices import Array
from .elements import MU, OBLATENESS

Motion = tuple[Vector, Vector, Vector, Vector]
"""Position, m, velocity, acceleration and jerk."""

STEP = 10.0
"""Time between nodes, s."""
NUMBERS = 18
"""Of a node: position, velocity, acceleration of the point, then of the target from the point."""
TARGET = 9
"""Where those of the target begin."""
WEIGHTS = (-1.0 / 360.0, 16.0 / 45.0, -729.0 / 280.0, 1024.0 / 315.0)
"""Of the results with one to four leapfrog steps."""


@kernel
def gravity(position: Array, has_j2: float, out: Array) -> None:
    """Write the acceleration of free fall at ``position`` (3,) into ``out`` (3,), m/s2."""
    store(gravity_at(vector(position, 0), has_j2), out, 0)


@subroutine
def gravity_at(r: Vector, has_j2: float) -> Vector:
    """Return the acceleration of free fall at ``r``, m/s2."""
    square = dot(r, r)
    distance = np.sqrt(square)
    fall = scale(r, -MU / (square * distance))
    if uniform(has_j2) != 0.0:
        factor = -OBLATENESS / (square * square * distance)
        # J2: 3/2 J2 mu R^2 / r^5 times (x (5 z^2/r^2 - 1), the same y, z (5 z^2/r^2 - 3))
        height = 5.0 * r[2] * r[2] / square
        pull = (r[0] * (1.0 - height), r[1] * (1.0 - height), r[2] * (3.0 - height))
        fall = add(fall, scale(pull, factor))
    return fall


@subroutine
def gravity_rate(r: Vector, v: Vector, has_j2: float) -> Vector:
    """Return the rate of change of `gravity_at` for a point that moves with ``v``, m/s3."""
    square = dot(r, r)
    distance, approach = np.sqrt(square), dot(r, v) / square
    rate = scale(subtract(v, scale(r, 3.0 * approach)), -MU / (square * distance))
    if uniform(has_j2) != 0.0:
        factor = -OBLATENESS / (square * square * distance)
        height = 5.0 * r[2] * r[2] / square
        lift = 10.0 * r[2] * v[2] / square - 2.0 * height * approach
        # of the pull, whose factor falls with the fifth power of the distance
        across, up = 1.0 - height, 3.0 - height
        fading, polar = lift + 5.0 * approach * across, lift + 5.0 * approach * up
        pull = (
            v[0] * across - r[0] * fading,
            v[1] * across - r[1] * fading,
            v[2] * up - r[2] * polar,
        )
        rate = add(rate, scale(pull, factor))
    return rate


@kernel
def propagate(nodes: Array, first: int, has_j2: float) -> None:
    """Write the nodes (K, 18) from ``first`` on; that before it has position and velocity."""
    for k in range(first, len(nodes)):
        node, after = nodes[k - 1], nodes[k]
        r, v = vector(node, 0), vector(node, 3)
        d, w = vector(node, TARGET), vector(node, TARGET + 3)
        pull = gravity_at(r, has_j2)
        # relative to the point: the difference of two positions would lose seven digits
        tide = subtract(gravity_at(add(r, d), has_j2), pull)
        store(pull, node, 6)
        store(tide, node, TARGET + 6)
        zero = (0.0, 0.0, 0.0)
        dr, dv, dd, dw = zero, zero, zero, zero
        for count in range(1, 5):
            # increments since the node: less is rounded away
            step, weight = STEP / count, WEIGHTS[count - 1]
            x, u, a = zero, zero, pull
            y, s, b = zero, zero, tide
            for _ in range(count):
                # kick, drift, kick
                u, s = add(u, scale(a, 0.5 * step)), add(s, scale(b, 0.5 * step))
                x, y = add(x, scale(add(v, u), step)), add(y, scale(add(w, s), step))
                position = add(r, x)
                a = gravity_at(position, has_j2)
                b = subtract(gravity_at(add(position, add(d, y)), has_j2), a)
                u, s = add(u, scale(a, 0.5 * step)), add(s, scale(b, 0.5 * step))
            dr, dv = add(dr, scale(x, weight)), add(dv, scale(u, weight))
            dd, dw = add(dd, scale(y, weight)), add(dw, scale(s, weight))
        store(add(r, dr), after, 0)
        store(add(v, dv), after, 3)
        store(add(d, dd), after, TARGET)
        store(add(w, dw), after, TARGET + 3)
        r, d = vector(after, 0), vector(after, TARGET)
        pull = gravity_at(r, has_j2)
        store(pull, after, 6)
        store(subtract(gravity_at(add(r, d), has_j2), pull), after, TARGET + 6)


@subroutine
def interpolated(nodes: Array, time: float, part: int) -> tuple[Vector, Vector]:
    """Return position, m, and velocity, m/s, of the part of nodes (K, 18) that begins there."""
    since = max(time, 0.0)
    k = min(int(since / STEP), len(nodes) - 2)
    u = (since - k * STEP) / STEP
    first, last = nodes[k], nodes[k + 1]
    p0, p1 = vector(first, part), vector(last, part)
    c1, v1 = scale(vector(first, part + 3), STEP), scale(vector(last, part + 3), STEP)
    c2 = scale(vector(first, part + 6), 0.5 * STEP * STEP)
    a1 = scale(vector(last, part + 6), STEP * STEP)
    # what is left of the values at the end, and of STEP and STEP^2 times their derivatives
    p = subtract(subtract(subtract(p1, p0), c1), c2)
    v = subtract(subtract(v1, c1), scale(c2, 2.0))
    a = subtract(a1, scale(c2, 2.0))
    c3 = add(subtract(scale(p, 10.0), scale(v, 4.0)), scale(a, 0.5))
    c4 = subtract(subtract(scale(v, 7.0), scale(p, 15.0)), a)
    c5 = add(subtract(scale(p, 6.0), scale(v, 3.0)), scale(a, 0.5))
    position = add(c4, scale(c5, u))
    position = add(c2, scale(add(c3, scale(position, u)), u))
    position = add(p0, scale(add(c1, scale(position, u)), u))
    velocity = add(scale(c4, 4.0), scale(c5, 5.0 * u))
    velocity = add(scale(c2, 2.0), scale(add(scale(c3, 3.0), scale(velocity, u)), u))
    return position, scale(add(c1, scale(velocity, u)), 1.0 / STEP)


@subroutine
def point_motion(nodes: Array, time: float, has_j2: float) -> Motion:
    """Return the motion of the reference point from the Earth's centre, inertial axes."""
    r, v = interpolated(nodes, time, 0)
    return r, v, gravity_at(r, has_j2), gravity_rate(r, v, has_j2)


@subroutine
def target_motion(nodes: Array, time: float, has_j2: float, point: Motion) -> Motion:
    """Return the motion of the target from the reference point, which moves as given."""
    d, w = interpolated(nodes, time, TARGET)
    place, motion = add(point[0], d), add(point[1], w)
    return (
        d,
        w,
        subtract(gravity_at(place, has_j2), point[2]),
        subtract(gravity_rate(place, motion, has_j2), point[3]),
    )


@kernel
def motions_into(nodes: Array, has_j2: float, of_target: bool, time: Array, out: Array) -> None:
    """Write position, velocity, acceleration and jerk at times (T,), s, into ``out`` (4, T, 3)."""
    for i in range(len(time)):
        motion = point_motion(nodes, time[i], has_j2)
        if of_target:
            motion = target_motion(nodes, time[i], has_j2, motion)
        for k in range(4):
            store(motion[k], out[k, i], 0)
