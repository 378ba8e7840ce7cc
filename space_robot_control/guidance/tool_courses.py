"""Courses of joints and base that lead a tool along a straight line and the shortest turn."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from space_robot_model.dynamics.attitude import rotation_matrix
from space_robot_model.elementary.matrices import norm, norms, product, unit_rows
from space_robot_model.elementary.rotations import quaternion_of_rotation
from space_robot_model.elementary.splines import CubicSpline
from space_robot_model.robot import Robot
from space_robot_msgs_py.errors import InputError

from .courses import KNOT_S, MOST_KNOTS, Course, knots, multiplied, quintic, turn_between, turned_by
from .demand import demand
from .free_base import twists_along, with_middles
from .segments import ToolGoal
from .spline_courses import AttitudeCourse, SplineCourse
from .tool_path import ToolFollower

Array = NDArray[np.float64]

MOMENTUM_WEIGHTS = (0.1, 1.0, 10.0, 100.0, 1000.0)
"""Tried where the momentum is to be least: of a joint's mean momentum beside its motion."""
JOIN_S = 1.0
"""Longest time in which a tool that the base carries along joins its path, and leaves it, s."""
CARRIED = 1e-9
"""Rate of the base against the path's axes above which it carries the tool along, rad/s."""
FREE_TOLERANCE = 1e-7
"""Largest error of a tool on its path with the base free, m and rad."""


class SegmentStart(NamedTuple):
    """Where a segment begins."""

    time: float
    """s."""
    joints: Array
    """(n,) rad, or m of prismatic joints."""
    quaternion: Array
    """(4,) of the base, unit."""


class ToolCourses:
    """Courses towards a goal of a tool from a start, for any duration."""

    def __init__(
        self,
        robot: Robot,
        follower: ToolFollower,
        goal: ToolGoal,
        start: SegmentStart,
        origin: Array,
        orbit_axes: Course | None = None,
    ) -> None:
        """Prepare a segment.

        Args:
            robot: as the flight software knows it.
            follower: of the tool that the goal is of.
            goal: of the segment.
            start: of the segment.
            origin: (3,) origin of the inertial frame from the robot's centre of mass, m.
            orbit_axes: how the axes of a goal with ``frame: orbit`` turn, as a course of the base.
        """
        self._robot, self._follower, self._goal = robot, follower, goal
        self._start, self._origin, self._orbit_axes = start, origin, orbit_axes

    def led(self, turn: Callable[[float], Course], span: float) -> tuple[Course, Course]:
        """Return the courses of joints and base while the base turns as it is led.

        Raises:
            InputError: a pose cannot be reached.
        """
        if self._goal.least == "motion":
            return self._led(turn(span), span, 0.0)
        return self._least_torque(turn(span), span)

    def _least_torque(self, slew: Course, span: float) -> tuple[Course, Course]:
        """Return those with the weight of momentum that asks for the least torque on the base."""
        coupling = self._follower.coupling(self._start.quaternion, self._start.joints)
        mean = float(np.sum(coupling * coupling)) / coupling.shape[1]
        best = self._led(slew, span, 0.0)
        least = self._largest_torque(best, span)
        for weight in MOMENTUM_WEIGHTS:
            try:
                courses = self._led(slew, span, weight / mean)
            except InputError:  # near a singular posture of tool and momentum
                continue
            if (torque := self._largest_torque(courses, span)) < least:
                least, best = torque, courses
        return best

    def _largest_torque(self, courses: tuple[Course, Course], span: float) -> float:
        begin = self._start.time
        return float(demand(self._robot, *courses, begin, begin + span).base_torque.max())

    def _led(self, slew: Course, span: float, momentum_weight: float) -> tuple[Course, Course]:
        begin, joints, _ = self._start
        times, follower, goal = knots(span), self._follower, self._goal
        share, _, _ = quintic(times / span)
        attitudes = slew.at(begin + times)[:, :4]
        axes = self._axes(begin + times)
        positions, rotations = self._path(attitudes if axes is None else axes[:, :4], share)
        if goal.frame != "base":
            self._join(slew, axes, times, positions, rotations)
        from_base = goal.frame == "base"
        postures, reached = follower.follow(
            attitudes, positions, rotations, from_base, joints, momentum_weight
        )
        if reached < len(times):
            pose = follower.pose(attitudes[reached], postures[reached])
            left = positions[-1] - (pose.from_base if from_base else pose.position)
            raise InputError(
                f"the tool cannot follow its path beyond t = {begin + times[reached]:.2f} s, "
                f"{norm(left):.3g} m from its goal: out of reach, or a singular posture"
            )
        return SplineCourse(begin, CubicSpline(times, postures)), slew

    def free(self, span: float) -> tuple[Course, Course]:
        """Return the courses while the base turns freely, to a goal on inertial axes.

        Raises:
            InputError: a pose cannot be reached.
        """
        begin, joints, quaternion = self._start
        times, goal = knots(span), self._goal
        share = with_middles(times) / span
        if goal.frame == "orbit":
            raise InputError("base: free does not go with tool.frame: orbit")
        positions, rotations = self._path(np.empty((0, 4)), quintic(share)[0])
        # in a long one knots are far apart: the same path is followed in less time
        slower = float(times[1]) / KNOT_S if len(times) == MOST_KNOTS else 1.0
        twists = twists_along(positions, rotations, share, span / slower)
        postures, attitudes, error = self._follower.follow_free(
            positions, rotations, twists, float(times[1]) / slower, joints, quaternion
        )
        if not error <= FREE_TOLERANCE:
            raise InputError(
                f"the tool cannot follow its path with the base free, it is {error:.3g} m or rad "
                "off: out of reach, or near a dynamic singularity"
            )
        base = AttitudeCourse(begin, CubicSpline(times, attitudes))
        return SplineCourse(begin, CubicSpline(times, postures)), base

    def _axes(self, time: Array) -> Array | None:
        """Return how the axes of the path turn at times (K,), (K, 10); None: as the frame says."""
        return None if self._orbit_axes is None else self._orbit_axes.at(time)

    def _path(self, attitudes: Array, share: Array) -> tuple[Array, Array]:
        """Return positions (K, 3), and orientations (K, 3, 3) on inertial axes; (0, 3, 3): free.

        ``attitudes`` (K, 4) are those of the axes that the path lies on: the base's, or the orbit's
        """
        goal = self._goal
        here = self._follower.pose(self._start.quaternion, self._start.joints)
        turn = _matrix(goal.unit_quaternion) if goal.is_given else None
        xyz = None if goal.xyz is None else np.array(goal.xyz)
        if goal.frame in ("base", "orbit"):
            axes = np.array([_matrix(attitude) for attitude in attitudes])
            back, is_shift = axes[0].T, goal.frame == "orbit"
            first = product(back, here.position if is_shift else here.from_base)
            last = first if xyz is None else first + xyz if is_shift else xyz
            line = _line(first, last, share)
            positions = np.array([product(a, p) for a, p in zip(axes, line, strict=True)])
            if turn is None:
                return positions, np.empty((0, 3, 3))
            rotation = product(back, here.rotation)
            inner = _turned(rotation, product(turn, rotation) if is_shift else turn, share)
            return positions, np.array([product(a, r) for a, r in zip(axes, inner, strict=True)])
        end = here.position
        if xyz is not None:
            end = (here.position if goal.frame == "start" else self._origin) + xyz
        positions = _line(here.position, end, share)
        if turn is None:
            return positions, np.empty((0, 3, 3))
        last = product(turn, here.rotation) if goal.frame == "start" else turn
        return positions, _turned(here.rotation, last, share)

    def _join(
        self, base: Course, axes: Array | None, times: Array, positions: Array, rotations: Array
    ) -> None:
        """Let the tool leave a base that turns against the path's axes, and come back to it.

        Within `JOIN_S` of both ends the path bends towards what the base carries along, so that
        the joints begin and end at rest.

        Args:
            base: its course.
            axes: (K, 10) motion of the path's axes; None: they are inertial.
            times: (K,) s from the begin.
            positions: (K, 3) of the path, to be bent.
            rotations: (K, 3, 3), or (0, 3, 3).
        """
        begin, span = self._start.time, float(times[-1])
        within = min(JOIN_S, 0.5 * span)
        still = np.array([1.0, 0.0, 0.0, 0.0])
        frame = np.tile(still, (len(times), 1)) if axes is None else axes[:, :4]
        for row, since in ((0, times), (-1, span - times)):
            weight = 1.0 - quintic(np.clip(since / within, 0.0, 1.0))[0]
            near = weight > 0.0
            moment = begin + float(times[row])
            motion = base.at(np.array([moment]))[0]
            quaternion, omega, alpha = motion[:4], motion[4:7], motion[7:]
            rate = product(_matrix(quaternion), omega)
            if axes is not None:
                rate = rate - product(_matrix(axes[row, :4]), axes[row, 4:7])
            if norm(rate) <= CARRIED:
                continue
            time = (times[near] - times[row])[:, np.newaxis]
            steady = multiplied(quaternion, _turns(time * (omega + 0.5 * time * alpha)))
            carried = multiplied(steady, quaternion * BACK)
            fixed = multiplied(frame[near], frame[row] * BACK)
            share, place = weight[near, np.newaxis], positions[row]
            away = product(_matrices(carried), place) - product(_matrices(fixed), place)
            if len(rotations):
                turn = multiplied(carried, fixed * BACK)
                turn = _matrices(unit_rows(still + share * (turn - still)))
                rotations[near] = np.array(
                    [product(t, r) for t, r in zip(turn, rotations[near], strict=True)]
                )
            positions[near] += share * away


BACK = np.array([1.0, -1.0, -1.0, -1.0])
"""Conjugates a quaternion."""


def _turns(vectors: Array) -> Array:
    """Return the quaternions (K, 4) of rotation vectors (K, 3), rad."""
    from space_robot_model.elementary.functions import sines_cosines  # slow to import

    angles = norms(vectors)
    sines, cosines = sines_cosines(0.5 * angles)
    return np.column_stack((cosines, vectors * (sines / np.maximum(angles, 1e-300))[:, np.newaxis]))


def _matrices(quaternions: Array) -> Array:
    return np.array([_matrix(quaternion) for quaternion in quaternions])


def _matrix(quaternion: Array) -> Array:
    matrix = np.empty((3, 3))
    rotation_matrix(quaternion, matrix)
    return matrix


def _line(first: Array, last: Array, share: Array) -> Array:
    return first + (last - first) * share[:, np.newaxis]


def _turned(first: Array, last: Array, share: Array) -> Array:
    """Return rotations (K, 3, 3) on the shortest turn from ``first`` to ``last``."""
    start, goal = quaternion_of_rotation(first), quaternion_of_rotation(last)
    axis, angle = turn_between(start, goal)
    steps = multiplied(start, turned_by(axis, angle * share))
    return np.array([_matrix(step) for step in steps])
