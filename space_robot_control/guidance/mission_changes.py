"""Changes of the mission in flight: the parameter ``goto``, and the topic /joint_trajectory."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from rcl_interfaces.msg import SetParametersResult

from space_robot_msgs_py import topics
from space_robot_msgs_py.errors import InputError, MessageError
from space_robot_msgs_py.ros.endpoints import PolledCallbackGroup, RawSubscription
from space_robot_msgs_py.ros.managed_node import ManagedNode
from space_robot_msgs_py.wire.definitions import decode

from .courses import Piece
from .mission import Mission

NAME = "goto"


class MissionChanges:
    """Applies segments and trajectories to a mission, from the end of what has been sent on."""

    def __init__(
        self, node: ManagedNode[Any], mission: Mission, next_tick: Callable[[], int]
    ) -> None:
        """Subscribe, and accept the parameter.

        Args:
            node: of the mission.
            mission: to be changed.
            next_tick: returns the first tick whose reference has not been sent.
        """
        self._node, self._mission, self._next_tick = node, mission, next_tick
        self._subscription = RawSubscription(node, topics.JOINT_TRAJECTORY, PolledCallbackGroup())
        node.add_on_set_parameters_callback(self._on_set)
        self._last = ""
        """Text of the last segment."""
        self.counts = {"trajectories accepted": 0, "trajectories refused": 0}

    def take(self) -> None:
        """Follow the trajectory that has come last, if any."""
        while (data := self._subscription.take()) is not None:
            try:
                piece = self._followed(data)
            except (InputError, MessageError) as error:
                self.counts["trajectories refused"] += 1
                self._node.log(f"refused a trajectory on /joint_trajectory: {error}")
                continue
            self.counts["trajectories accepted"] += 1
            self._tell(piece)

    def _followed(self, data: bytes) -> Piece:
        """Follow a serialized trajectory_msgs/JointTrajectory; return its plan."""
        from .live import TrajectoryPoint  # slow to import, and most flights need none

        message = decode(data, topics.JOINT_TRAJECTORY.type)
        points = [
            TrajectoryPoint(
                p.time_from_start.sec + 1e-9 * p.time_from_start.nanosec,
                list(p.positions),
                list(p.velocities),
                list(p.accelerations),
            )
            for p in message.points
        ]
        return self._mission.follow(self._next_tick(), list(message.joint_names), points)

    def close(self) -> None:
        """End the subscription, and accept no parameter."""
        self._node.remove_on_set_parameters_callback(self._on_set)
        self._subscription.close()

    def _on_set(self, parameters: list[Any]) -> SetParametersResult:
        for parameter in parameters:
            if parameter.name != NAME or parameter.value in ("", self._last):
                continue  # a call may be repeated if its answer was lost
            try:
                self._tell(self._mission.go_to(self._next_tick(), parameter.value))
                self._last = parameter.value
            except InputError as error:
                return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)

    def _tell(self, piece: Piece) -> None:
        self._node.log(f"{piece.motion} from t = {piece.begin:.4f} s to {piece.end:.4f} s")
