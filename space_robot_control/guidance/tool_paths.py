"""Courses that lead a tool along a straight line and the shortest turn."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from space_robot_model.dynamics.attitude import rotation_matrix
from space_robot_model.dynamics.inverse_kinematics import (
    FreeBase,
    follow_free_path_into,
    follow_path_into,
)
from space_robot_model.dynamics.tool_kinematics import ToolKinematics, tool_kinematics_into
from space_robot_model.elementary.functions import sines_cosines
from space_robot_model.elementary.matrices import norm, norms, product, unit_rows
from space_robot_model.elementary.rotations import quaternion_of_rotation
from space_robot_model.elementary.splines import CubicSpline
from space_robot_model.robot import Robot
from space_robot_model.robot.kinematics import mounted_tool
from space_robot_msgs_py.errors import InputError

from .courses import (
    KNOT_S,
    MOST_KNOTS,
    AttitudeCourse,
    Course,
    SegmentStart,
    SplineCourse,
    knots,
    multiplied,
    quintic,
    turn_between,
    turned_by,
)
from .demand import demand
from .free_base import with_middles
from .goals import PointingGoal, ToolGoal
from .pointing import PointingCourse

Array = NDArray[np.float64]

MOMENTUM_WEIGHTS = (0.1, 1.0, 10.0, 100.0, 1000.0)
"""Tried where the momentum is to be least: of a joint's mean momentum beside its motion."""
JOIN_S = 1.0
"""Longest time in which a tool that the base carries along joins its path, and leaves it, s."""
CARRIED = 1e-9
"""Rate of the base against the path's axes above which it carries the tool along, rad/s."""
FREE_TOLERANCE = 1e-7
"""Largest error of a tool on its path with the base free, m and rad."""
NEEDS_ORBIT = "needs an orbit: choose one (--orbit NAME), or set mission.assumed_orbit"
ORBIT_AXES = PointingGoal(point="nadir")
"""The frame of tools' goals that turns with the orbit, as a base that points."""
BACK = np.array([1.0, -1.0, -1.0, -1.0])
"""Conjugates a quaternion."""


class ToolPoses:
    """Poses of a tool of a robot whose joints are all actuated."""

    def __init__(self, robot: Robot, tool: str | None) -> None:
        """Take a tool by name; None: the first."""
        self.model, self.mounted = robot.model, mounted_tool(robot, tool)
        self.rows = list(robot.model_rows)
        """Place of each joint in the order of ``model``."""
        self.work = ToolKinematics.allocate(robot.joint_count)

    def ordered(self, joints: Array) -> Array:
        """Return joint positions (N,) in the order of ``model``."""
        positions = np.empty(len(joints))
        positions[self.rows] = joints
        return positions

    def pose(self, quaternion: Array, joints: Array) -> tuple[Array, Array, Array]:
        """Return the pose of the tool at an attitude (4,) and joint positions (N,).

        Returns:
            Positions (3,) from the robot's centre of mass and from the base's frame, m, and the
            rotation (3, 3) from the tool's frame, all to inertial axes. ``work`` has the Jacobians.
        """
        work = self.work
        tool_kinematics_into(self.model, quaternion, self.ordered(joints), *self.mounted, work)
        return work.position.copy(), work.position + work.centre_of_mass, work.rotation.copy()


class ToolCourses:
    """Courses towards a goal of a tool from a start, for any duration."""

    def __init__(self, goal: ToolGoal, start: SegmentStart) -> None:
        """Prepare the courses; there may be no such tool, or no orbit whose axes the goal is on."""
        self._goal, self._start = goal, start
        self._quaternion = start.base.quaternion
        self._tool = ToolPoses(start.robot, goal.link)
        self._orbit_axes: Course | None = None
        """How the axes of a goal with ``frame: orbit`` turn, as a course of the base."""
        if goal.frame == "orbit":
            if (ephemeris := start.ephemeris()) is None:
                raise InputError(f"tool.frame: orbit {NEEDS_ORBIT}")
            begin, near = start.time, self._quaternion
            self._orbit_axes = PointingCourse(ORBIT_AXES, ephemeris, begin, near)

    def led(self, span: float, base: Course) -> Course:
        """Return the course of the joints while the base moves along a course."""
        course = self._led(base, span, 0.0)
        if self._goal.least == "motion":
            return course
        self._tool.pose(self._quaternion, self._start.joints)
        coupling = self._tool.work.coupling[:, self._tool.rows]
        # weights are relative to this robot's mass, by the mean square of a joint's momentum
        mean = float(np.sum(coupling * coupling)) / coupling.shape[1]
        least = self._largest_torque(course, base, span)
        for weight in MOMENTUM_WEIGHTS:
            try:
                other = self._led(base, span, weight / mean)
            except InputError:  # near a singular posture of tool and momentum
                continue
            if (torque := self._largest_torque(other, base, span)) < least:
                least, course = torque, other
        return course

    def _largest_torque(self, joints: Course, base: Course, span: float) -> float:
        begin = self._start.time
        asked = demand(self._start.robot, joints, base, begin, begin + span)
        return float(asked.base_torque.max())

    def _led(self, base: Course, span: float, momentum_weight: float) -> Course:
        begin, joints, times = self._start.time, self._start.joints, knots(span)
        tool, from_base = self._tool, self._goal.frame == "base"
        share, _, _ = quintic(times / span)
        attitudes = base.at(begin + times)[:, :4]
        axes = None if self._orbit_axes is None else self._orbit_axes.at(begin + times)
        positions, rotations = self._path(attitudes if axes is None else axes[:, :4], share)
        if not from_base:
            self._join(base, axes, times, positions, rotations)
        out = np.zeros((len(times), len(joints)))
        path, near = (attitudes, positions, rotations, from_base), tool.ordered(joints)
        reached = follow_path_into(
            tool.model, *path, *tool.mounted, momentum_weight, near, tool.work, out
        )
        postures = out[:, tool.rows]
        if reached < len(times):
            position, position_from_base, _ = tool.pose(attitudes[reached], postures[reached])
            left = positions[-1] - (position_from_base if from_base else position)
            raise InputError(
                f"the tool cannot follow its path beyond t = {begin + times[reached]:.2f} s, "
                f"{norm(left):.3g} m from its goal: out of reach, or a singular posture"
            )
        return SplineCourse(begin, CubicSpline(times, postures))

    def free(self, span: float) -> tuple[Course, Course]:
        """Return the courses while the base turns freely, to a goal on inertial axes."""
        begin, times, tool = self._start.time, knots(span), self._tool
        share = with_middles(times) / span
        if self._goal.frame == "orbit":
            raise InputError("base: free does not go with tool.frame: orbit")
        positions, rotations = self._path(np.empty((0, 4)), quintic(share)[0])
        # in a long one knots are far apart: the same path is followed in less time, as without
        # momentum the motion of the base depends on the path alone
        slower = float(times[1]) / KNOT_S if len(times) == MOST_KNOTS else 1.0
        twists = _twists(positions, rotations, share, span / slower)
        out, attitudes = np.empty((len(times), len(tool.rows))), np.empty((len(times), 4))
        out[0], attitudes[0] = tool.ordered(self._start.joints), self._quaternion
        path, spacing = (positions, rotations, twists), float(times[1]) / slower
        work = FreeBase.allocate(len(tool.rows))
        error = follow_free_path_into(
            tool.model, *path, spacing, *tool.mounted, work, out, attitudes
        )
        if not error <= FREE_TOLERANCE:
            raise InputError(
                f"the tool cannot follow its path with the base free, it is {error:.3g} m or rad "
                "off: out of reach, or near a dynamic singularity"
            )
        base = AttitudeCourse(begin, CubicSpline(times, attitudes))
        return SplineCourse(begin, CubicSpline(times, out[:, tool.rows])), base

    def _path(self, attitudes: Array, share: Array) -> tuple[Array, Array]:
        # attitudes (K, 4) of the axes that the path lies on: the base's, or the orbit's; returns
        # positions (K, 3) and orientations (K, 3, 3) on inertial axes, or (0, 3, 3) if it has none
        goal = self._goal
        position, from_base, rotation = self._tool.pose(self._quaternion, self._start.joints)
        turn = _matrix(goal.unit_quaternion) if goal.is_given else None
        xyz = None if goal.xyz is None else np.array(goal.xyz)
        if goal.frame in ("base", "orbit"):
            axes = _matrices(attitudes)
            back, is_shift = axes[0].T, goal.frame == "orbit"
            first = product(back, position if is_shift else from_base)
            last = first if xyz is None else first + xyz if is_shift else xyz
            line = _line(first, last, share)
            positions = _products(axes, line)
            if turn is None:
                return positions, np.empty((0, 3, 3))
            rotation = product(back, rotation)
            inner = _turned(rotation, product(turn, rotation) if is_shift else turn, share)
            return positions, _products(axes, inner)
        end = position
        if xyz is not None:
            end = (position if goal.frame == "start" else self._start.origin()) + xyz
        positions = _line(position, end, share)
        if turn is None:
            return positions, np.empty((0, 3, 3))
        last = product(turn, rotation) if goal.frame == "start" else turn
        return positions, _turned(rotation, last, share)

    def _join(
        self, base: Course, axes: Array | None, times: Array, positions: Array, rotations: Array
    ) -> None:
        # A base that turns against the path's axes carries the tool along: within `JOIN_S` of both
        # ends the path bends towards that motion, so that the joints begin and end at rest.
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
                rotations[near] = _products(turn, rotations[near])
            positions[near] += share * away


def _turns(vectors: Array) -> Array:
    angles = norms(vectors)
    sines, cosines = sines_cosines(0.5 * angles)
    shares = sines / np.maximum(angles, 1e-300)  # 0 of a vector that is 0
    return np.column_stack((cosines, vectors * shares[:, np.newaxis]))


def _matrices(quaternions: Array) -> Array:
    return np.array([_matrix(quaternion) for quaternion in quaternions])


def _matrix(quaternion: Array) -> Array:
    matrix = np.empty((3, 3))
    rotation_matrix(quaternion, matrix)
    return matrix


def _products(matrices: Array, others: Array) -> Array:
    return np.array([product(a, b) for a, b in zip(matrices, others, strict=True)])


def _line(first: Array, last: Array, share: Array) -> Array:
    return first + (last - first) * share[:, np.newaxis]


def _turned(first: Array, last: Array, share: Array) -> Array:
    start, goal = quaternion_of_rotation(first), quaternion_of_rotation(last)
    axis, angle = turn_between(start, goal)
    steps = multiplied(start, turned_by(axis, angle * share))
    return _matrices(steps)


def _twists(positions: Array, rotations: Array, share: Array, span: float) -> Array:
    rate = quintic(share)[1][:, np.newaxis] / span
    twists = np.zeros((len(share), 6))
    twists[:, :3] = (positions[-1] - positions[0]) * rate
    if len(rotations):
        first, last = (quaternion_of_rotation(rotations[k]) for k in (0, -1))
        axis, angle = turn_between(first, last)
        twists[:, 3:] = product(rotations[0], axis) * angle * rate
    return twists
