"""Courses along trajectories that are given as columns of a CSV or Parquet file.

Columns are ``time`` (s, rising), every joint with a motor by its name (rad, or m of prismatic
joints), and, if the base turns, its quaternion ``q_w, q_x, q_y, q_z``. Columns ``<joint>_rate``
(rad/s or m/s) are optional: they must belong to the positions. Other columns are not read.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from space_robot_model.elementary.matrices import dot_rows, norms, product, unit_rows
from space_robot_model.elementary.splines import CubicSpline
from space_robot_model.robot.mission_document import QUATERNION
from space_robot_msgs_py.config.columns import MOST_ROWS, missing_column
from space_robot_msgs_py.config.validation import short
from space_robot_msgs_py.errors import InputError

from .courses import AttitudeCourse, BaseMotion, Course, SplineCourse, multiplied
from .limits import FARTHEST, SHORTEST_S

Array = NDArray[np.float64]
Columns = Mapping[str, Sequence[float]]

TIME, RATE = "time", "_rate"
SAME_PLACE = 1e-6
"""rad or m, that the first row may be away from where the segment begins."""
SAME_RATE = 0.02
"""Share of a joint's largest rate that a given rate may differ from that of the positions."""


class TrajectoryTable:
    """A trajectory of joints and base, by cubic splines through its rows."""

    def __init__(self, columns: Columns, joint_names: Sequence[str]) -> None:
        """Check the columns and make the splines."""
        missing = [name for name in (TIME, *joint_names) if name not in columns]
        if missing:
            raise InputError(f"trajectory: {missing_column(short(missing[0]), columns)}")
        time = np.array(columns[TIME], dtype=np.float64)
        if not 2 <= (count := len(time)) <= MOST_ROWS:
            raise InputError(f"trajectory: 2 to {MOST_ROWS} rows were expected, got {count}")
        used = (*joint_names, *(f"{name}{RATE}" for name in joint_names), *QUATERNION)
        for name in used:
            if (rows := len(columns.get(name, columns[TIME]))) != count:
                raise InputError(
                    f"trajectory: {name} has {rows} values, {count} were expected, as many as times"
                )
        too_soon = ~(np.diff(time) > 0.999 * SHORTEST_S)  # they are rounded
        if np.any(too_soon):
            row = int(np.argmax(too_soon)) + 1
            raise InputError(
                f"trajectory: time must rise, got {time[row]:.12g} s after "
                f"{time[row - 1]:.12g} s; {SHORTEST_S:g} s between rows are needed"
            )
        self._time = time - time[0]
        self.duration = float(self._time[-1])
        """s."""
        positions = np.column_stack([np.array(columns[name], float) for name in joint_names])
        if not np.all(within := np.abs(positions) <= FARTHEST):
            row, joint = divmod(int(np.argmin(within)), len(joint_names))
            raise InputError(
                f"trajectory: {joint_names[joint]} is {positions[row, joint]:g} at "
                f"{time[row]:.12g} s, at most {FARTHEST:g} (rad or m) can be flown"
            )
        rates = [columns.get(f"{name}{RATE}") for name in joint_names]
        ends = np.array([[r[0], r[-1]] if r is not None else [0.0, 0.0] for r in rates]).T
        self._joints = CubicSpline(self._time, positions, ends[0], ends[1])
        for joint, (name, rate) in enumerate(zip(joint_names, rates, strict=True)):
            if rate is not None:
                _check_rates(name, np.array(rate), self._joints.rates[:, joint], time)
        self._attitude: CubicSpline | None = None
        base_columns = [name for name in QUATERNION if name in columns]
        if base_columns and len(base_columns) < 4:
            raise InputError(
                f"trajectory: {', '.join(base_columns)} without the rest of a quaternion"
            )
        if base_columns:
            self._attitude = CubicSpline(self._time, _quaternions(columns))

    @property
    def leads_base(self) -> bool:
        """Whether there are columns of the base's attitude."""
        return self._attitude is not None

    def courses(self, begin: float, joints: Array, base: BaseMotion) -> tuple[Course, Course]:
        """Return the courses of joints and base from a time, posture and motion of the base on.

        Without columns of its attitude the base goes on as it moves.
        """
        away = np.abs(self._joints.values[0] - joints)
        if away.max() > SAME_PLACE:
            joint = int(np.argmax(away))
            raise InputError(
                f"trajectory: joint {joint + 1} begins at {self._joints.values[0, joint]:.6g}, the "
                f"mission is at {joints[joint]:.6g} then (rad or m)"
            )
        course = SplineCourse(begin, self._joints)
        if self._attitude is None:
            return course, base.held
        first, quaternion = self._attitude.values[0], base.quaternion
        if min(np.abs(first - quaternion).max(), np.abs(first + quaternion).max()) > SAME_PLACE:
            raise InputError("trajectory: the base begins with another attitude than the mission's")
        attitude = self._attitude
        if base.course is not None:
            motion = base.course.at(np.array([begin]))[0]
            sign = 1.0 if product(first, motion[:4]) >= 0.0 else -1.0
            # it goes on with the base's rate: qdot = q (0, omega) / 2
            rate = 0.5 * sign * multiplied(motion[:4], np.append(0.0, motion[4:7]))
            attitude = CubicSpline(self._time, attitude.values, rate, np.zeros(4))
        return course, AttitudeCourse(begin, attitude)


def _quaternions(columns: Columns) -> Array:
    rows = np.column_stack([np.array(columns[name], float) for name in QUATERNION])
    lengths = norms(rows)
    is_unit = np.abs(lengths - 1.0) <= 1e-3
    if not np.all(is_unit):
        k = int(np.argmin(is_unit))
        raise InputError(
            f"trajectory: row {k + 1}: the quaternion has a norm of {lengths[k]:.4g}, 0.999 to "
            "1.001 is allowed"
        )
    rows = unit_rows(rows)
    # q and -q are one attitude, but a spline from one to the other would pass near zero
    products = dot_rows(rows[1:], rows[:-1])
    rows[1:] *= np.cumprod(np.where(products < 0.0, -1.0, 1.0), axis=0)
    return rows


def _check_rates(name: str, rates: Array, of_positions: Array, time: Array) -> None:
    allowed = SAME_RATE * float(np.max(np.abs(of_positions))) + 1e-9
    difference = np.abs(rates - of_positions)
    if not difference.max() <= allowed:
        row = int(np.argmax(difference))
        raise InputError(
            f"trajectory: {name}{RATE} is {rates[row]:.6g} at {time[row]:g} s, the positions of "
            f"{name} change at {of_positions[row]:.6g}"
        )
