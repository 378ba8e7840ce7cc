"""Tolerances of a goal of `FollowJointTrajectory`, as joint_trajectory_controller measures them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.config.validation import one_of
from space_robot_msgs_py.errors import InputError

from .courses import Piece

Array = NDArray[np.float64]

NONE = (0.0, -1.0)
"""Values of a `control_msgs/JointTolerance` that give no limit: the default, or none at all."""
MEASURED = ("position", "velocity")


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
        """Read those of a goal.

        Args:
            goal: a FollowJointTrajectory.Goal.
            names: of the n joints.

        Raises:
            InputError: a joint is unknown, or a number is negative or none.
        """
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

    def judge(
        self, piece: Piece, names: Sequence[str], time: Array, measured: Array
    ) -> GoalVerdict | None:
        """Compare measured joints with a trajectory; None: the goal goes on.

        Args:
            piece: the trajectory.
            names: of the n joints.
            time: (T,) s, rising.
            measured: (T, 2, n) positions and velocities at these times.
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
        if reached.any() and np.argmax(reached) <= np.argmax([*late, True]):
            return GoalVerdict("SUCCESSFUL")
        if late.any():
            k = int(np.argmax(late))
            text = _excess("goal_tolerance", names, time[k], error[k], self.goal)
            return GoalVerdict("GOAL_TOLERANCE_VIOLATED", text)
        return None


def _limits(what: str, entries: Sequence[Any], names: Sequence[str]) -> Array:
    limits = np.full((len(MEASURED), len(names)), np.inf)
    for entry in entries:
        joint = list(names).index(one_of(entry.name, names, "joint", f" of {what}"))
        for order, quantity in enumerate(MEASURED):
            value = getattr(entry, quantity)
            if value > 0.0:
                limits[order, joint] = value
            elif value not in NONE:
                raise InputError(
                    f"{what}: {quantity} of joint {entry.name!r}: a number above 0 was expected, "
                    f"or 0 or -1 for no limit, got {value:g}"
                )
    return limits


def _excess(what: str, names: Sequence[str], time: float, error: Array, limits: Array) -> str:
    """Name the quantity that is farthest beyond its limit, with a joint that is not known first."""
    ratio = np.where(np.isnan(error) & np.isfinite(limits), np.inf, error / limits)
    order, joint = divmod(int(np.nanargmax(ratio)), len(names))
    return (
        f"the {MEASURED[order]} of joint {names[joint]!r} is off by {error[order, joint]:.4g} at "
        f"t = {time:.4f} s, {what} is {limits[order, joint]:g}"
    )
