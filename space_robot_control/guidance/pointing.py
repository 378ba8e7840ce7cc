"""Pointing modes: the base turns with a direction that the assumed orbit gives.

The orbit is that of the reference point, beside which the robot is: its own motion of metres is not
followed. The Sun is where it is also while the Earth hides it.

The frame T has its first axis along p, where the base points, and the second one in the half plane
of p and v, the second direction: on its axes ``p = (P, 0, 0)`` and ``v = (v1, v2, 0)``, ``v2 > 0``.
That both stay so, while p and v change, gives T's angular velocity, and its derivative.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from space_robot_model.dynamics.algebra import Vector, cross, dot, scale, store, vector
from space_robot_model.dynamics.attitude import columns_quaternion, multiply, rotated
from space_robot_model.elementary.matrices import dot_rows, norm
from space_robot_model.orbit.ephemeris import Ephemeris
from space_robot_model.orbit.propagation import Motion, point_motion, target_motion
from space_robot_msgs_py.compiled.kernels import kernel, subroutine
from space_robot_msgs_py.config.validation import short
from space_robot_msgs_py.errors import InputError

from .goals import FAR, LEAST_DEG, PointingGoal

Array = NDArray[np.float64]
Derivatives = tuple[Vector, Vector, Vector]
"""A vector with its first two derivatives, inertial axes."""

FIXED, NADIR, VELOCITY, NORMAL, TARGET = range(5)
"""Kinds of directions."""
KINDS = {"nadir": NADIR, "velocity": VELOCITY, "normal": NORMAL, "target": TARGET}
USUAL_ABOUT = {"nadir": "velocity", "velocity": "nadir", "target": "normal"}
ANCHOR_S = 5.0
"""Time between the attitudes that decide the sign of a quaternion, s."""
NEAREST = 0.1
"""Least distance of a target that is pointed at, m."""
CHECKED_EVERY = 1.0
"""Time between those at which a pointing segment is checked, s."""
AT_ONCE = 10_000
"""Times that are checked together."""


class PointingCourse:
    """The base turns so that it points, at any time: also after the end of its segment."""

    def __init__(
        self, goal: PointingGoal, ephemeris: Ephemeris | None, begin: float, near: Array
    ) -> None:
        """Take what points where from ``begin``, s, on.

        ``near`` (4,) is a quaternion in whose hemisphere the first one is. Without an orbit
        ``ephemeris`` is None, and only fixed directions can be pointed at.
        """
        first: str | list[float] = goal.direction or goal.point
        for key, name in (("point", first), ("about", goal.about)):
            if not isinstance(name, str):
                continue
            if ephemeris is None:
                raise InputError(
                    f"base.{key}: {name} needs an orbit, and flight software knows of none: choose "
                    "one by --orbit NAME"
                )
            if name == "target" and not ephemeris.has_target:
                raise InputError(
                    f"base.{key}: target: flight software knows of no target in orbit: events of "
                    "the mission name one, such as capture@15:neighbouring_satellite"
                )
        self._goal, self._ephemeris, self._begin = goal, ephemeris, begin
        self._fixed, self._kinds = np.zeros((2, 3)), np.zeros(2, dtype=np.int64)
        second = goal.about or USUAL_ABOUT.get(goal.point)
        for k, name in enumerate((first, second)):
            if name is None:  # of a direction that does not move
                pointed = self._fixed[0]
                name = [0.0, 0.0, 1.0] if abs(pointed[2]) <= FAR else [1.0, 0.0, 0.0]
            if name == "sun" and ephemeris is not None:
                name = ephemeris.sun.tolist()
            self._kinds[k] = KINDS[name] if isinstance(name, str) else FIXED
            if not isinstance(name, str):
                self._fixed[k] = np.array(name) / norm(name)
        self._from_base = goal.from_base
        self._anchors = np.empty((0, 4))
        self._near = near

    def check(self, begin: float, end: float) -> None:
        """Check that the attitude is defined from ``begin`` to ``end``, s.

        Raises:
            InputError: the second direction comes within a degree of the line of the first one, or
                the target to where the robot is; names key and time.
        """
        count = math.ceil((end - begin) / CHECKED_EVERY) + 1
        for first in range(0, count, AT_ONCE):
            numbers = np.arange(first, min(first + AT_ONCE, count), dtype=np.float64)
            time = np.minimum(begin + CHECKED_EVERY * numbers, end)
            sines, lengths = np.moveaxis(self._rows(time, self._anchors[:0])[:, 10:], 1, 0)
            nearest = int(np.argmin(lengths))
            if self._goal.point == "target" and not lengths[nearest] >= NEAREST:  # true of NaN
                raise InputError(
                    f"base.point: target is {lengths[nearest]:.3g} m from the reference point at "
                    f"t = {time[nearest]:.6g} s: at least {NEAREST:g} m are needed to point at it"
                )
            smallest = int(np.argmin(sines))
            if not sines[smallest] >= math.sin(math.radians(LEAST_DEG)):
                point, about = self._goal.point, self._goal.about or "its default"
                raise InputError(
                    f"base.about: {short(about)} is {math.degrees(math.asin(sines[smallest])):.2g} "
                    f"degrees from the line of {point} at t = {time[smallest]:.6g} s, at least "
                    f"{LEAST_DEG:g} is needed: choose another direction"
                )

    def at(self, time: Array) -> Array:
        """Return (T, 10) at times (T,), s: quaternion, velocity and acceleration, base frame."""
        return self._rows(time, self._anchors_until(float(time.max(initial=0.0))))[:, :10]

    def _rows(self, time: Array, anchors: Array) -> Array:
        out, has_j2, nodes = np.empty((len(time), 12)), 0.0, np.empty((0, 18))
        if self._ephemeris is not None:
            has_j2 = self._ephemeris.has_j2
            nodes = self._ephemeris.nodes(float(time.max(initial=0.0)))
        turn, begin = self._from_base, self._begin
        times = np.ascontiguousarray(time, dtype=np.float64)
        pointing_into(nodes, has_j2, self._kinds, self._fixed, turn, begin, anchors, times, out)
        return out

    def _anchors_until(self, latest: float) -> Array:
        # each is in the hemisphere of that before it: so a quaternion's sign is a function of time
        # alone, and continuous
        known = len(self._anchors)
        needed = max(int((latest - self._begin) / ANCHOR_S) + 1, 1)
        if needed > known:
            # half as many again, so that a flight that goes on and on seldom needs more
            numbers = np.arange(known, needed + known // 2, dtype=np.float64)
            attitudes = self._rows(self._begin + ANCHOR_S * numbers, self._anchors[:0])[:, :4]
            last = self._anchors[-1] if known else self._near
            before = np.concatenate((last[np.newaxis], attitudes[:-1]))
            signs = np.where(dot_rows(before, attitudes) < 0.0, -1.0, 1.0)
            attitudes = attitudes * np.cumprod(signs, axis=0)
            self._anchors = np.concatenate((self._anchors, attitudes))
        return self._anchors


@kernel
def pointing_into(
    nodes: Array,
    has_j2: float,
    kinds: NDArray[np.int64],
    fixed: Array,
    from_base: Array,
    begin: float,
    anchors: Array,
    time: Array,
    out: Array,
) -> None:
    """Write the motion of a base that points.

    Args:
        nodes: (K, 18) of the orbit, see `propagate`; not read if both directions are fixed.
        has_j2: 1 with the Earth's oblateness, else 0.
        kinds: (2,) integers, of the direction to point in and of the second one.
        fixed: (2, 3) these directions on inertial axes, where they are fixed.
        from_base: (4,) quaternion from the base's frame to T.
        begin: s, of the first anchor.
        anchors: (A, 4) quaternions every `ANCHOR_S`, in whose hemisphere is that of a time after
            them, or (0, 4).
        time: (T,) s.
        out: (T, 12) quaternion, angular velocity, rad/s, and acceleration on the base's axes; then
            the sine of the angle between the directions, and the length of the first one.
    """
    turn = (from_base[0], from_base[1], from_base[2], from_base[3])
    back = (turn[0], -turn[1], -turn[2], -turn[3])
    zero = (0.0, 0.0, 0.0)
    point, target = (zero, zero, zero, zero), (zero, zero, zero, zero)
    for i in range(len(time)):
        if kinds[0] != FIXED or kinds[1] != FIXED:  # else there may be no orbit
            point = point_motion(nodes, time[i], has_j2)
        if kinds[0] == TARGET or kinds[1] == TARGET:
            target = target_motion(nodes, time[i], has_j2, point)
        first = direction(kinds[0], fixed[0], point, target)
        second = direction(kinds[1], fixed[1], point, target)
        t1, t2, t3, length, sine = triad(first[0], second[0])
        q = multiply(columns_quaternion(t1, t2, t3), turn)
        if len(anchors) > 0:
            anchor = anchors[max(int((time[i] - begin) / ANCHOR_S), 0)]
            if q[0] * anchor[0] + q[1] * anchor[1] + q[2] * anchor[2] + q[3] * anchor[3] < 0.0:
                q = (-q[0], -q[1], -q[2], -q[3])
        omega, alpha = turning(first, second, t1, t2, t3)
        out[i, 0], out[i, 1], out[i, 2], out[i, 3] = q
        store(rotated(back, omega), out[i], 4)
        store(rotated(back, alpha), out[i], 7)
        out[i, 10], out[i, 11] = sine, length


@subroutine
def direction(kind: int, fixed: Array, point: Motion, target: Motion) -> Derivatives:
    """Return a direction, of any length, with its derivatives."""
    if kind == FIXED:
        zero = (0.0, 0.0, 0.0)
        return vector(fixed, 0), zero, zero
    if kind == TARGET:
        return target[0], target[1], target[2]
    r, v, a, j = point
    if kind == NADIR:
        return scale(r, -1.0), scale(v, -1.0), scale(a, -1.0)
    if kind == VELOCITY:
        return v, a, j
    va, rj = cross(v, a), cross(r, j)
    return cross(r, v), cross(r, a), (va[0] + rj[0], va[1] + rj[1], va[2] + rj[2])


@subroutine
def triad(p: Vector, v: Vector) -> tuple[Vector, Vector, Vector, float, float]:
    """Return the axes of T, the length of ``p`` and the sine of the angle between the vectors."""
    length, other = np.sqrt(dot(p, p)), np.sqrt(dot(v, v))
    t1, aside = scale(p, 1.0 / length), scale(v, 1.0 / other)
    t3 = cross(t1, aside)
    sine = np.sqrt(dot(t3, t3))
    t3 = scale(t3, 1.0 / sine)
    return t1, cross(t3, t1), t3, length, sine


@subroutine
def turning(
    first: Derivatives, second: Derivatives, t1: Vector, t2: Vector, t3: Vector
) -> tuple[Vector, Vector]:
    """Return angular velocity and acceleration of T, on its axes."""
    (p, pd, pdd), (v, vd, vdd) = first, second
    length, stretch = dot(p, t1), dot(pd, t1)
    v1, v2 = dot(v, t1), dot(v, t2)
    vd1, vd2 = dot(vd, t1), dot(vd, t2)
    # p = (P, 0, 0) has the rate (P', z P, -y P): all that pd has along t2 and t3 is turning
    y, z = -dot(pd, t3) / length, dot(pd, t2) / length
    # v has no part along t3, so that vd t3 = x v2 - y v1
    x = (dot(vd, t3) + y * v1) / v2
    yd = (x * z * length - 2.0 * y * stretch - dot(pdd, t3)) / length
    zd = (dot(pdd, t2) - 2.0 * z * stretch - x * y * length) / length
    # the rates of v1 and v2 are vd1 + z v2 and vd2 - z v1
    xd = (dot(vdd, t3) + yd * v1 + y * (2.0 * vd1 + z * v2) - x * (2.0 * vd2 - z * v1)) / v2
    return (x, y, z), (xd, yd, zd)
