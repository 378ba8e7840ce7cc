"""The mission: rest-to-rest joint trajectories through waypoints, the base's attitude held."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from space_robot_model.elementary.matrices import norm
from space_robot_model.robot import Robot
from space_robot_msgs_py.config.validation import StrictModel
from space_robot_msgs_py.errors import InputError
from space_robot_msgs_py.samples import ReferenceChunk

from .limits import check_positions

Array = NDArray[np.float64]


class MissionSettings(StrictModel):
    """Waypoints as flat lists, as ROS parameters hold them."""

    waypoint_times: list[float] = Field(
        [0.0], description="time of each waypoint, s, increasing from 0", min_length=1
    )
    waypoints_deg: list[float] = Field(
        [0.0],
        description="positions of the actuated joints, waypoint by waypoint, degrees (prismatic "
        "joints: m)",
    )
    base_quaternion: Annotated[list[float], Field(min_length=4, max_length=4)] = Field(
        [1.0, 0.0, 0.0, 0.0], description="base attitude to hold: w, x, y, z"
    )


class Mission:
    """Fifth-order polynomial segments, at rest in every waypoint, sampled at ticks.

    ``theta_d(u) = theta_a + (theta_b - theta_a)(10 u^3 - 15 u^4 + 6 u^5)``. Before the first
    waypoint and after the last the arm is held there.
    """

    def __init__(self, robot: Robot, settings: MissionSettings, period: float) -> None:
        """A mission for the joints with motors of ``robot``.

        Raises:
            InputError: the waypoints do not fit the times or the joints, or are beyond the limits
                of these.
        """
        n, times = robot.n, np.array(settings.waypoint_times)
        if len(settings.waypoints_deg) != n * len(times):
            raise InputError(
                f"waypoints_deg has {len(settings.waypoints_deg)} values; "
                f"{len(times)} waypoint_times and {n} joints need {n * len(times)}"
            )
        if times[0] != 0.0 or np.any(np.diff(times) <= 0.0):
            raise InputError(f"waypoint_times must rise from 0, got {settings.waypoint_times}")
        length = norm(settings.base_quaternion)
        if not 1e-3 <= length <= 1e3:
            raise InputError(f"base_quaternion must have a norm near 1, got {length:g}")
        self._times = times
        self._waypoints = robot.from_degrees(np.reshape(settings.waypoints_deg, (len(times), n)))
        check_positions(robot, self._waypoints)
        self._quaternion = np.array(settings.base_quaternion) / length
        self._period = period

    @property
    def times(self) -> Array:
        """(K,) s, of the waypoints."""
        return self._times

    @property
    def waypoints(self) -> Array:
        """(K, n) rad, or m of prismatic joints."""
        return self._waypoints

    @property
    def duration(self) -> float:
        """Time of the last waypoint, s."""
        return float(self._times[-1])

    def chunk(self, start: int, length: int) -> ReferenceChunk:
        """The reference of ``length`` ticks from tick ``start`` on."""
        time = np.arange(start, start + length, dtype=np.float64) * self._period
        base = np.zeros((length, 10))
        base[:, :4] = self._quaternion
        return ReferenceChunk(start, self._joints(time), base)

    def _joints(self, time: Array) -> Array:
        last = len(self._times) - 1
        if last == 0:
            rows = np.zeros((len(time), 3, self._waypoints.shape[1]))
            rows[:, 0] = self._waypoints[0]
            return rows
        rows = np.empty((len(time), 3, self._waypoints.shape[1]))
        changes = np.searchsorted(time, self._times[1:-1])  # at a waypoint the next leg begins
        legs = zip(np.split(time, changes), np.split(rows, changes), strict=True)
        for index, (part, row) in enumerate(legs):
            begin, span = self._times[index], self._times[index + 1] - self._times[index]
            u = np.clip((part - begin)[:, np.newaxis] / span, 0.0, 1.0)
            leg = self._waypoints[index + 1] - self._waypoints[index]
            course = u * u * u * (10.0 + u * (-15.0 + 6.0 * u))
            row[:, 0] = self._waypoints[index] + leg * course
            row[:, 1] = leg * (30.0 * u * u * (1.0 - u) * (1.0 - u)) / span
            row[:, 2] = leg * (60.0 * u * (1.0 - u) * (1.0 - 2.0 * u)) / (span * span)
        return rows
