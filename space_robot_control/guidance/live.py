"""Changes of a mission in flight, from now on: a segment, or a trajectory with its tolerances.

Position and rate of the reference do not jump. Before a segment the reference is brought to rest;
a trajectory is joined with the reference's present rate and acceleration. A base that points, or
is on its way there, goes on. Tolerances are measured as joint_trajectory_controller does.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from space_robot_model.elementary.splines import CubicSpline, QuinticSpline
from space_robot_model.robot import Robot
from space_robot_msgs_py.config.validation import one_of
from space_robot_msgs_py.errors import InputError

from .courses import BaseMotion, BrakedTurn, Course, Piece, SplineCourse
from .limits import FARTHEST, FASTEST, HALFWAY, SHARPEST, check_piece

Array = NDArray[np.float64]
MOST = {"positions": FARTHEST, "velocities": FASTEST, "accelerations": SHARPEST}
"""Largest numbers of a point, rad or m, and per s."""

BRAKE_S = 2.0
"""Time in which a moving reference is brought to rest, s."""
AT_REST = 1e-9
"""rad/s or m/s."""
MOST_POINTS = 100_000
START_WITHIN_S = 86_400.0
"""Longest wait for the start of a trajectory, s: a day. A stamp of the wall clock is later."""
NO_LIMIT = (0.0, -1.0)
"""Values of a `control_msgs/JointTolerance` that give no limit: the default, or none at all."""
MEASURED = ("position", "velocity")


class TrajectoryPoint(NamedTuple):
    """A point of a `trajectory_msgs/JointTrajectory`."""

    time: float
    """s from the start."""
    positions: Sequence[float]
    velocities: Sequence[float]
    """Empty: not given."""
    accelerations: Sequence[float]


def braking_pieces(
    robot: Robot, begin: float, joints: Array, rates: Array, base: BaseMotion
) -> list[Piece]:
    """Return the piece that brings a moving reference to rest, or none if it is at rest.

    Args:
        robot: as the flight software knows it; the piece is checked against its limits.
        begin: s.
        joints: (3, n) reference of the joints at ``begin``.
        rates: (10,) reference of the base.
        base: how the base goes on; one without a course comes to rest.
    """
    base_rate = 0.0 if base.course else np.abs(rates[4:]).max()
    if not max(np.abs(joints[1:]).max(), base_rate) > AT_REST:
        return []
    rest = np.zeros_like(joints)
    rest[0] = joints[0] + 0.5 * BRAKE_S * joints[1]
    spline = QuinticSpline(np.array([0.0, BRAKE_S]), np.array([joints, rest]))
    turn, course = _onwards(begin, rates, base), SplineCourse(begin, spline)
    end = begin + BRAKE_S
    attitude = turn.at(np.array([end]))[0, :4]
    piece = Piece(begin, end, course, turn, rest[0], attitude, "braking", base.mode)
    check_piece(robot, piece)
    return [piece]


def _onwards(begin: float, rates: Array, base: BaseMotion) -> Course:
    return base.course or BrakedTurn(begin, BRAKE_S, rates[:4], rates[4:7], rates[7:])


@np.errstate(all="ignore")  # numbers that overflow are refused, in one line
def joined_trajectory(
    robot: Robot,
    names: Sequence[str],
    points: Sequence[TrajectoryPoint],
    begin: float,
    joints: Array,
    rates: Array,
    base: BaseMotion,
    late: float = 0.0,
) -> Piece:
    """Return a trajectory of the joints that begins with the present reference.

    Its points until ``begin`` are left out, as the first one of a plan that begins with the present
    state; of one that is joined late also those that the joints cannot reach in time any more.

    Args:
        robot: see `braking_pieces`, as ``begin``, ``joints``, ``rates`` and ``base``.
        names: of the joints, in the order of the points' numbers.
        points: with rising times from 0 on; velocities and accelerations that are missing are
            those of a cubic spline through the positions. It ends at rest unless the last point
            says otherwise.
        begin: s.
        joints: of the reference.
        rates: of the reference.
        base: of the reference.
        late: s, from the trajectory's start to ``begin``.

    Raises:
        InputError: a joint is missing or unknown, times do not rise, numbers are missing, no point
            is left, or the trajectory is beyond the joints' limits.
    """
    for name in names:
        one_of(name, robot.joint_names, "joint", " of the trajectory")
    if missing := [name for name in robot.joint_names if name not in names]:
        raise InputError(f"the trajectory lacks joint {missing[0]!r}")
    if len(set(names)) < len(names):
        raise InputError("the trajectory has a joint twice")
    if not 1 <= len(points) <= MOST_POINTS:
        raise InputError(f"1 to {MOST_POINTS} points were expected, got {len(points)}")
    times = np.array([point.time for point in points])
    if times[0] < 0.0 or not np.all(np.diff(times) > 0.0):
        raise InputError(f"the times of points must rise from 0 on, got {times.tolist()[:8]} s")
    if times[-1] <= late:
        raise InputError(
            f"the last point is for t = {begin - late + times[-1]:.4f} s, and the reference has "
            f"been sent until t = {begin:.4f} s"
        )
    order = [list(names).index(name) for name in robot.joint_names]
    first = int(np.argmax(times > late))
    if late > 0.0:
        rise = np.array([_row(p.positions, order, "positions") for p in points[first:]]) - joints[0]
        fastest = np.array([limits.velocity for limits in robot.limits])
        span = times[first:, np.newaxis] - late
        first += int(np.argmax(np.all(HALFWAY * np.abs(rise) <= fastest * span, axis=1)))
    times, points = np.array([0.0, *(times[first:] - late)]), points[first:]
    states = _states(times, points, order, joints)
    course = SplineCourse(begin, QuinticSpline(times, states))
    end = begin + float(times[-1])
    turn = _onwards(begin, rates, base)
    attitude = turn.at(np.array([begin + BRAKE_S]))[0, :4]
    left_out = f" without its first {'point' if first == 1 else f'{first} points'}" if first else ""
    motion = f"trajectory{left_out}"
    piece = Piece(begin, end, course, turn, states[-1, 0], attitude, motion, base.mode)
    check_piece(robot, piece)
    return piece


def _states(
    times: Array, points: Sequence[TrajectoryPoint], order: Sequence[int], joints: Array
) -> Array:
    positions = np.array([joints[0], *(_row(p.positions, order, "positions") for p in points)])
    last = points[-1].velocities
    final = _row(last, order, "velocities") if len(last) else np.zeros(len(order))
    spline = CubicSpline(times, positions, joints[1], final)
    states = spline.at(times)
    states[0] = joints  # nothing jumps, not even the acceleration
    states[-1, 2] = 0.0
    for k, point in enumerate(points, 1):
        if len(point.velocities):
            states[k, 1] = _row(point.velocities, order, "velocities")
        if len(point.accelerations):
            states[k, 2] = _row(point.accelerations, order, "accelerations")
    return states


def _row(values: Sequence[float], order: Sequence[int], quantity: str) -> Array:
    if len(values) != len(order):
        raise InputError(f"a point has {len(values)} {quantity} of {len(order)} joints")
    row = np.array(values, dtype=np.float64)[list(order)]
    if not np.all(np.isfinite(row)):
        raise InputError(f"a point has {quantity} that are not finite")
    largest, most = np.abs(row).max(), MOST[quantity]
    if largest > most:
        raise InputError(f"a point has {quantity} of {largest:g}, at most {most:g} can be flown")
    return row


class GoalVerdict(NamedTuple):
    """How a goal ends."""

    code: str
    """Name of the ``error_code`` in the action's result."""
    text: str = ""


class GoalTolerances(NamedTuple):
    """Largest errors (2, n) of positions and velocities, rad or m, and per s; infinite: any."""

    path: Array
    """Between begin and end of the trajectory."""
    goal: Array
    """After its end, from its last point."""
    time: float
    """s after the end, within which the errors must be within ``goal``; infinite: at any time."""

    @classmethod
    def read(cls, goal: Any, names: Sequence[str]) -> GoalTolerances:
        """Read the tolerances of a FollowJointTrajectory.Goal for n joints."""
        duration = goal.goal_time_tolerance
        seconds = duration.sec + 1e-9 * duration.nanosec
        return cls(
            _limits("path_tolerance", goal.path_tolerance, names),
            _limits("goal_tolerance", goal.goal_tolerance, names),
            seconds if seconds > 0.0 else np.inf,
        )

    @property
    def are_given(self) -> bool:
        """Whether any error is limited."""
        return bool(np.isfinite(self.path).any() or np.isfinite(self.goal).any())

    def evaluate(
        self, piece: Piece, names: Sequence[str], time: Array, measured: Array
    ) -> GoalVerdict | None:
        """Compare measured joints with a trajectory; None: the goal goes on.

        ``measured`` (T, 2, n) are positions and velocities at rising times (T,), s.
        """
        error = np.abs(measured - piece.joints.at(np.minimum(time, piece.end))[:, :2])
        is_after = time >= piece.end
        beyond = (error > self.path).any(axis=(1, 2)) & (time >= piece.begin) & ~is_after
        if beyond.any():
            k = int(np.argmax(beyond))
            text = _excess("path_tolerance", names, time[k], error[k], self.path)
            return GoalVerdict("PATH_TOLERANCE_VIOLATED", text)
        reached = (error <= self.goal).all(axis=(1, 2)) & is_after
        late = time > piece.end + self.time
        # `True` behind the last time: never late
        if reached.any() and np.argmax(reached) <= np.argmax([*late, True]):
            return GoalVerdict("SUCCESSFUL")
        if late.any():
            k = int(np.argmax(late))
            text = _excess("goal_tolerance", names, time[k], error[k], self.goal)
            return GoalVerdict("GOAL_TOLERANCE_VIOLATED", text)
        return None


def _limits(key: str, entries: Sequence[Any], names: Sequence[str]) -> Array:
    limits = np.full((len(MEASURED), len(names)), np.inf)
    for entry in entries:
        joint = list(names).index(one_of(entry.name, names, "joint", f" of {key}"))
        for order, quantity in enumerate(MEASURED):
            value = getattr(entry, quantity)
            if value > 0.0:
                limits[order, joint] = value
            elif value not in NO_LIMIT:
                raise InputError(
                    f"{key}: {quantity} of joint {entry.name!r}: a number above 0 was expected, "
                    f"or 0 or -1 for no limit, got {value:g}"
                )
    return limits


def _excess(key: str, names: Sequence[str], time: float, error: Array, limits: Array) -> str:
    # a number that is missing is the largest error
    ratio = np.where(np.isnan(error) & np.isfinite(limits), np.inf, error / limits)
    order, joint = divmod(int(np.nanargmax(ratio)), len(names))
    return (
        f"the {MEASURED[order]} of joint {names[joint]!r} is off by {error[order, joint]:.4g} at "
        f"t = {time:.4f} s, {key} is {limits[order, joint]:g}"
    )
