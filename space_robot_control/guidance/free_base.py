"""Motions of the joints in which the base's attitude control has no part.

A reactionless motion asks nothing of it: the joint velocity is the part of the way to the goal that
lies in the reaction null space (Nenchev, Yoshida & Uchiyama 1992)

    dtheta/ds = (E - H~^+ H~)(theta_goal - theta)

with the coupling ``H~`` of angular momentum about the robot's centre of mass. It ends where that
part is zero: at the goal, or as near to it as the null space leads. A free base turns as the
joints' motion turns it.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from space_robot_model.dynamics.inverse_kinematics import FreeBase, free_attitude_into, half_steps
from space_robot_model.dynamics.model import Model
from space_robot_model.dynamics.tool_kinematics import ToolKinematics, tool_kinematics_into
from space_robot_model.elementary.linear_algebra import least_squares_into
from space_robot_model.elementary.matrices import norms
from space_robot_model.elementary.splines import CubicSpline
from space_robot_model.robot import Robot
from space_robot_msgs_py.compiled.kernels import kernel
from space_robot_msgs_py.errors import InputError

from .courses import AttitudeCourse, Course, JointMaker, SegmentStart, SplineCourse, knots, quintic

Array = NDArray[np.float64]

STEP = 0.0025
"""Step in s of the integration, by Runge and Kutta's method of fourth order."""
END = 25.0
"""Where it ends: what is left of a way within reach has fallen by e^-25."""
SHORTEST = 1e-9
"""Length of a path, rad or m, below which there is none."""
KNOTS = 400
"""Of the path, nearly equally far apart."""
MOST_AWAY = 4.0 * np.pi
"""Largest way of a joint in a reactionless motion, rad or m; its steps would be too long."""


def reactionless_course(start: SegmentStart, goal: Array) -> JointMaker:
    """Return the course along a reactionless path to a goal (n,) as a function of the duration."""
    robot, away = start.robot, np.abs(goal - start.joints)
    if away.max() > MOST_AWAY:
        name = robot.joint_names[int(np.argmax(away))]
        raise InputError(
            f"reactionless: joint {name!r} is {away.max():.4g} rad or m away, at most "
            f"{MOST_AWAY:.4g} are planned"
        )
    path = _reactionless_path(robot, start.base.quaternion, start.joints, goal)

    def along(span: float, _: Course) -> Course:
        times = knots(span)
        return SplineCourse(start.time, CubicSpline(times, path.at(quintic(times / span)[0])[:, 0]))

    return along


def _reactionless_path(robot: Robot, quaternion: Array, start: Array, goal: Array) -> CubicSpline:
    row = list(robot.model_rows)
    steps, ordered = np.empty((round(END / STEP) + 1, len(start))), np.empty((2, len(start)))
    ordered[:, row] = start, goal
    work = ToolKinematics.allocate(robot.joint_count)
    integrate_into(robot.model, quaternion, ordered[0], ordered[1], np.eye(3), work, steps)
    path = steps[:, row]
    lengths = np.concatenate(([0.0], np.cumsum(norms(np.diff(path, axis=0)))))
    if lengths[-1] < SHORTEST:
        return CubicSpline(np.array([0.0, 1.0]), np.array([start, start]))
    shares = lengths / lengths[-1]
    # points of the path itself: between them a straight line would have momentum
    nearest = np.searchsorted(shares, np.linspace(0.0, 1.0, KNOTS + 1))
    chosen = np.unique([*nearest[:-1], np.searchsorted(shares, 1.0)])
    places, points = shares[chosen], path[chosen]
    return CubicSpline(
        places, points, _slope(places[:3], points[:3]), _slope(places[:-4:-1], points[:-4:-1])
    )


def _slope(places: Array, points: Array) -> Array:
    near, far = places[1] - places[0], places[2] - places[0]
    rises = (points[1] - points[0]) / near, (points[2] - points[0]) / far
    slope: Array = (rises[0] * far - rises[1] * near) / (far - near)
    return slope


@kernel
def integrate_into(
    model: Model,
    quaternion: Array,
    start: Array,
    goal: Array,
    axes: Array,
    work: ToolKinematics,
    out: Array,
) -> None:
    """Fill ``out`` (S, N) with postures `STEP` apart, in the order of ``model``.

    ``axes`` (3, 3) is the unit matrix.
    """
    n = len(start)
    direction, posture, slopes = np.empty(n), np.empty(n), np.empty((4, n))
    scratch, momentum, origin = np.empty((3, 4)), np.empty(3), np.zeros(3)
    out[0] = start
    for s in range(1, len(out)):
        for stage in range(4):
            part = 0.5 * STEP * half_steps(stage)
            for j in range(n):
                posture[j] = out[s - 1, j]
                if stage:
                    posture[j] += part * slopes[stage - 1, j]
                slopes[stage, j] = goal[j] - posture[j]
            tool_kinematics_into(model, quaternion, posture, 0, axes, origin, work)
            for k in range(3):
                momentum[k] = 0.0
                for j in range(n):
                    momentum[k] += work.coupling[k, j] * slopes[stage, j]
            # H~^+ H~ (theta_goal - theta), the part of the way that has momentum, is taken off it
            least_squares_into(work.coupling, momentum, scratch, direction)
            for j in range(n):
                slopes[stage, j] -= direction[j]
        for j in range(n):
            total = slopes[0, j] + 2.0 * slopes[1, j] + 2.0 * slopes[2, j] + slopes[3, j]
            out[s, j] = out[s - 1, j] + STEP / 6.0 * total


def free_attitude(
    robot: Robot, joints: Course, quaternion: Array, begin: float, times: Array
) -> AttitudeCourse:
    """Return the motion of a free base during a motion of the joints from rest to rest.

    The base begins with ``quaternion`` (4,); ``times`` (K,), s after ``begin``, are equally far
    apart.
    """
    row = list(robot.model_rows)
    motion = joints.at(begin + with_middles(times))
    positions, rates = np.empty((2, len(motion), len(row)))
    positions[:, row], rates[:, row] = motion[:, 0], motion[:, 1]
    attitudes = np.empty((len(times), 4))
    attitudes[0] = quaternion
    work = FreeBase.allocate(robot.joint_count)
    free_attitude_into(robot.model, positions, rates, float(times[1]), work, attitudes)
    return AttitudeCourse(begin, CubicSpline(times, attitudes))


def with_middles(times: Array) -> Array:
    """Return (2 K - 1,) times: those given (K,), and those halfway between."""
    out = np.empty(2 * len(times) - 1)
    out[::2], out[1::2] = times, 0.5 * (times[1:] + times[:-1])
    return out
