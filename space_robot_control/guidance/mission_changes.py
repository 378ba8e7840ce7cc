"""Changes of the mission in flight: the parameter ``goto``, and trajectories."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rcl_interfaces.msg import SetParametersResult

from space_robot_msgs_py import topics
from space_robot_msgs_py.config.text import one_line_of, printable
from space_robot_msgs_py.errors import InputError, MessageError
from space_robot_msgs_py.ros.endpoints import PolledCallbackGroup, RawSubscription
from space_robot_msgs_py.ros.managed_node import ManagedNode
from space_robot_msgs_py.samples import RobotNames
from space_robot_msgs_py.wire.definitions import decode

from .courses import Piece
from .mission import Mission

GOTO = "goto"
UNFORESEEN = (ArithmeticError, AttributeError, LookupError, MemoryError, TypeError, ValueError)
"""What planning raises for numbers that no check has foreseen; the flight must go on."""
WARNING_S = 1.0
"""Time for which a refusal is the node's mode in /diagnostics, from where `fly` prints it, s."""
MOST_WARNINGS = 20
"""Refusals that wait to be reported, if somebody floods the topic."""


class MissionChanges:
    """Applies segments and trajectories to a mission, from the end of what has been sent on."""

    def __init__(
        self,
        node: ManagedNode[Any],
        mission: Mission,
        ticks: Callable[[], tuple[int, int]],
        names: RobotNames,
    ) -> None:
        """Subscribe, and accept the parameter.

        ``ticks`` returns the present tick, and the first one whose reference has not been sent.
        """
        self._node, self._mission, self._ticks = node, mission, ticks
        self.names = names
        self._subscription = RawSubscription(node, topics.JOINT_TRAJECTORY, PolledCallbackGroup())
        node.add_on_set_parameters_callback(self._on_set)
        self._last_text = ""
        self.latest: Piece | None = None
        """The last motion that was asked for in flight."""
        self.counts = {"trajectories accepted": 0, "trajectories refused": 0}
        self._warnings, self._warning = deque[str](maxlen=MOST_WARNINGS), ""
        self._warning_until = 0.0

    @property
    def time(self) -> float:
        """Simulated time, s."""
        return self._ticks()[0] * self._mission.period

    def joints(self) -> NDArray[np.float64]:
        """Return the reference (3, n) of the joints at this time."""
        joints: NDArray[np.float64] = self._mission.chunk(self._ticks()[0], 1).joints[0]
        return joints

    def take(self) -> None:
        """Follow the trajectory that has come last, if any."""
        while (data := self._subscription.take()) is not None:
            try:
                self.follow(decode(data, topics.JOINT_TRAJECTORY.type))
            except MessageError as error:
                self.refuse(str(error))
            except InputError:
                pass  # `follow` has reported it

    def follow(self, trajectory: Any) -> None:
        """Follow a trajectory_msgs/JointTrajectory; a refused one leaves the mission as it was."""
        from .live import TrajectoryPoint  # slow to import, and most flights need none

        stamp = trajectory.header.stamp
        start = stamp.sec + 1e-9 * stamp.nanosec
        points = [
            TrajectoryPoint(
                p.time_from_start.sec + 1e-9 * p.time_from_start.nanosec,
                list(p.positions),
                list(p.velocities),
                list(p.accelerations),
            )
            for p in trajectory.points
        ]
        names = list(trajectory.joint_names)
        try:
            first = self._ticks()[1]
            self._change(partial(self._mission.follow, first, names, points, start or None))
        except InputError as error:
            self.refuse(str(error))
            raise
        self.counts["trajectories accepted"] += 1

    def stop(self) -> None:
        """Bring the reference to rest."""
        self._change(partial(self._mission.go_to, self._ticks()[1], "{hold: 1}"))

    def close(self) -> None:
        """End the subscription, and accept no parameter."""
        self._node.remove_on_set_parameters_callback(self._on_set)
        self._subscription.close()

    def _on_set(self, parameters: list[Any]) -> SetParametersResult:
        for parameter in parameters:
            if parameter.name != GOTO or parameter.value in ("", self._last_text):
                continue  # a call may be repeated if its answer was lost
            try:
                self._change(partial(self._mission.go_to, self._ticks()[1], parameter.value))
                self._last_text = parameter.value
            except InputError as error:
                return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)

    def _change(self, plan: Callable[[], Piece]) -> None:
        try:
            self.latest = piece = plan()
        except InputError:
            raise
        except UNFORESEEN as error:
            raise InputError(f"it cannot be planned ({one_line_of(error)})") from error
        self._node.log(f"{piece.motion} from t = {piece.begin:.4f} s to {piece.end:.4f} s")

    def refuse(self, reason: str) -> None:
        """Count and report a refused trajectory."""
        self.counts["trajectories refused"] += 1
        self.warn(f"refused a trajectory: {reason}")

    def warn(self, text: str) -> None:
        """Write to the log, and report it as the node's mode."""
        self._warnings.append(printable(text))
        self._node.log(self._warnings[-1])

    def next_warning(self) -> str:
        """Return the warning to report: each one at least once, the last one for a second."""
        now = time.monotonic()
        if self._warnings:
            self._warning, self._warning_until = self._warnings.popleft(), now + WARNING_S
        return self._warning if now < self._warning_until else ""
