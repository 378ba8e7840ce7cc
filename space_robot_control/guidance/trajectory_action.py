"""The action ``~/follow_joint_trajectory``, by which MoveIt moves a robot.

Its type is in control_msgs; without that package there is no action.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import partial
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray
from rclpy.action.server import ActionServer, CancelResponse, GoalResponse, ServerGoalHandle
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.time import Time

from space_robot_msgs_py.errors import InputError
from space_robot_msgs_py.ros.managed_node import ManagedNode
from space_robot_msgs_py.ros.restart import until

from .courses import Piece

NAME = "~/follow_joint_trajectory"
FEEDBACK_S = 0.1
TOLERANCES = (
    "path_tolerance",
    "component_path_tolerance",
    "goal_tolerance",
    "component_goal_tolerance",
)


class Motions(Protocol):
    """The motion of a mission, which a goal replaces."""

    latest: Piece | None
    """The last motion that was asked for in flight."""

    @property
    def time(self) -> float:
        """Simulated time, s."""
        ...

    @property
    def joint_names(self) -> list[str]:
        """Names of the joints with motors."""
        ...

    def joints(self) -> NDArray[np.float64]:
        """Return the reference (3, n) of the joints at this time."""
        ...

    def follow(self, trajectory: Any) -> None:
        """Follow a trajectory_msgs/JointTrajectory from now on.

        Raises:
            InputError: it is wrong; the reason has been logged.
        """
        ...

    def stop(self) -> None:
        """Bring the reference to rest."""
        ...


class TrajectoryAction:
    """Server of the action: one goal at a time, the last one counts.

    A goal succeeds when the reference has reached the end of its trajectory. The errors of the
    controller are not looked at.
    """

    def __init__(self, node: ManagedNode[Any], action: Any, motions: Motions) -> None:
        """Offer the action.

        Args:
            node: of the mission.
            action: control_msgs.action.FollowJointTrajectory.
            motions: of the mission.
        """
        self._node, self._action, self._motions = node, action, motions
        self._goal: ServerGoalHandle | None = None
        """The last one."""
        self._is_closed = False
        self._server = ActionServer(
            node,
            action,
            NAME,
            self._lead,
            callback_group=ReentrantCallbackGroup(),
            goal_callback=self._accept,
            handle_accepted_callback=self._start,
            cancel_callback=self._cancel,
        )

    def close(self) -> None:
        """Give up the goal, and offer the action no more."""
        self._is_closed = True
        self._server.destroy()

    def _accept(self, request: Any) -> GoalResponse:
        """Check a goal and follow it; the action has no field for a reason."""
        if tolerances := [name for name in TOLERANCES if getattr(request, name)]:
            self._node.log(f"refused a goal: {tolerances[0]} is not checked here, leave it empty")
            return GoalResponse.REJECT
        if request.multi_dof_trajectory.joint_names:
            self._node.log("refused a goal: multi_dof_trajectory is not for this robot")
            return GoalResponse.REJECT
        try:
            self._motions.follow(request.trajectory)
        except InputError:
            return GoalResponse.REJECT
        return GoalResponse.ACCEPT

    def _start(self, goal: ServerGoalHandle) -> None:
        self._goal = goal
        goal.execute(partial(self._lead, piece=self._motions.latest))

    def _cancel(self, goal: ServerGoalHandle) -> CancelResponse:
        if goal is not self._goal:
            return CancelResponse.REJECT
        try:
            self._motions.stop()
        except InputError as error:  # a joint would leave its limits meanwhile
            self._node.log(f"refused to cancel a goal: {error}")
            return CancelResponse.REJECT
        return CancelResponse.ACCEPT

    async def _lead(self, goal: ServerGoalHandle, piece: Piece | None = None) -> Any:
        """Wait for the end of a trajectory, telling the reference meanwhile."""
        while (outcome := self._outcome(goal, piece)) is None:
            goal.publish_feedback(self._feedback())
            await self._pause(goal, piece)
        end, text = outcome
        end()
        return self._action.Result(error_string=text)

    async def _pause(self, goal: ServerGoalHandle, piece: Piece | None) -> None:
        wake_at = time.monotonic() + FEEDBACK_S
        await until(lambda: time.monotonic() >= wake_at or self._outcome(goal, piece) is not None)

    def _outcome(
        self, goal: ServerGoalHandle, piece: Piece | None
    ) -> tuple[Callable[[], None], str] | None:
        """Return how a goal ends, and what to say of it; None: it goes on."""
        motions = self._motions
        if self._is_closed:
            return goal.abort, "the mission has ended"
        if goal.is_cancel_requested:
            return goal.canceled, "the reference is brought to rest"
        if motions.latest is not piece or piece is None:
            return goal.abort, "another motion took its place"
        return (goal.succeed, "") if motions.time >= piece.end else None

    def _feedback(self) -> Any:
        """Return the reference of the joints at this time."""
        motions, feedback = self._motions, self._action.Feedback()
        feedback.header.stamp = Time(nanoseconds=round(motions.time * 1e9)).to_msg()
        feedback.joint_names = motions.joint_names
        desired = feedback.desired
        desired.positions, desired.velocities, desired.accelerations = motions.joints().tolist()
        return feedback
