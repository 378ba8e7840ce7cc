"""The action ``~/follow_joint_trajectory``, by which MoveIt moves a robot.

Its type is in control_msgs; without that package there is no action.
"""

from __future__ import annotations

import time
from contextlib import closing
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from rclpy.action.server import ActionServer, CancelResponse, GoalResponse, ServerGoalHandle
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.time import Time

from space_robot_msgs_py import topics
from space_robot_msgs_py.errors import InputError, MessageError
from space_robot_msgs_py.ros.endpoints import PolledCallbackGroup, RawSubscription
from space_robot_msgs_py.ros.managed_node import ManagedNode
from space_robot_msgs_py.ros.service_calls import until
from space_robot_msgs_py.samples import RobotNames
from space_robot_msgs_py.wire.codecs import CompiledCodec
from space_robot_msgs_py.wire.messages import describe

from .courses import Piece
from .live import GoalTolerances, GoalVerdict

if TYPE_CHECKING:
    from .mission_changes import MissionChanges

Array = NDArray[np.float64]

NAME = "~/follow_joint_trajectory"
FEEDBACK_S = 0.1
MOST_AT_ONCE = 1_000
"""States taken before the node goes on."""
OF_OTHER_JOINTS = ("component_path_tolerance", "component_goal_tolerance")


class Pursuit:
    """The trajectory of a goal, and how the joints follow it, as /joint_states reports them."""

    def __init__(
        self, node: ManagedNode[Any], piece: Piece, tolerances: GoalTolerances, names: RobotNames
    ) -> None:
        """Subscribe, if there are tolerances: else nothing is measured."""
        assert node.settings is not None
        self.piece, self._tolerances, self._names = piece, tolerances, names
        self._subscription: RawSubscription | None = None
        if tolerances.are_given:
            self._subscription = RawSubscription(node, topics.JOINT_STATES, PolledCallbackGroup())
        self._codec = CompiledCodec(describe(topics.JOINT_STATES, names, node.settings.timebase))
        self._verdict: GoalVerdict | None = None

    def verdict(self, time: float) -> GoalVerdict | None:
        """Return how the goal ends at simulated time ``time``, s; None: it goes on."""
        if self._subscription is None:
            return GoalVerdict("SUCCESSFUL") if time >= self.piece.end else None
        if self._verdict is None:
            measured = self._measured(self._subscription)
            self._verdict = self._tolerances.evaluate(self.piece, self._names.joints, *measured)
        return self._verdict

    def _measured(self, subscription: RawSubscription) -> tuple[Array, Array]:
        n, all_joints = len(self._names.joints), len(self._names.all_joints)
        times: list[float] = []
        states: list[tuple[Array, Array]] = []
        values = np.zeros(2 * all_joints + n)
        while len(times) < MOST_AT_ONCE and (data := subscription.take()) is not None:
            try:
                times.append(self._codec.decode(data, values) / 1e9)
            except MessageError:  # of another robot
                continue
            states.append((values[:n].copy(), values[all_joints : all_joints + n].copy()))
        return np.array(times), np.array(states).reshape(-1, 2, n)

    def close(self) -> None:
        """End the subscription."""
        if self._subscription is not None:
            self._subscription.close()


class TrajectoryAction:
    """Server of the action: one goal at a time, the last one counts.

    A goal succeeds when the reference has reached the end of its trajectory, and the measured
    joints are within its tolerances, if it has any. With a violated one the reference is brought
    to rest.
    """

    def __init__(self, node: ManagedNode[Any], action: Any, changes: MissionChanges) -> None:
        """Offer the action, a control_msgs.action.FollowJointTrajectory."""
        self._node, self._action, self._changes = node, action, changes
        self._goal: ServerGoalHandle | None = None
        """The last one."""
        self._is_closed = False
        self._server = ActionServer(
            node,
            action,
            NAME,
            self._lead,  # never called so: each goal is started by `_start`
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
        # a refusal's reason is logged: the action has no field for it
        try:
            if request.multi_dof_trajectory.joint_names or any(
                getattr(request, name) for name in OF_OTHER_JOINTS
            ):
                raise InputError("multi_dof_trajectory and its tolerances are not for this robot")
            self._tolerances = GoalTolerances.read(request, self._changes.names.joints)
        except InputError as error:
            self._changes.refuse(str(error))
            return GoalResponse.REJECT
        try:
            self._changes.follow(request.trajectory)
        except InputError:
            return GoalResponse.REJECT
        if any(e.acceleration > 0.0 for e in (*request.path_tolerance, *request.goal_tolerance)):
            self._changes.warn("accelerations are not measured: their tolerances are ignored")
        return GoalResponse.ACCEPT

    def _start(self, goal: ServerGoalHandle) -> None:
        self._goal, piece = goal, self._changes.latest
        assert piece is not None
        pursuit = Pursuit(self._node, piece, self._tolerances, self._changes.names)
        goal.execute(partial(self._lead, pursuit=pursuit))

    def _cancel(self, goal: ServerGoalHandle) -> CancelResponse:
        if goal is not self._goal:
            return CancelResponse.REJECT
        return CancelResponse.ACCEPT if self._stop("to cancel a goal") else CancelResponse.REJECT

    def _stop(self, purpose: str) -> bool:
        try:
            self._changes.stop()
        except InputError as error:  # a joint would leave its limits meanwhile
            self._changes.warn(f"refused {purpose}: {error}")
            return False
        return True

    async def _lead(self, goal: ServerGoalHandle, pursuit: Pursuit) -> Any:
        with closing(pursuit):
            while (verdict := self._verdict(goal, pursuit)) is None:
                goal.publish_feedback(self._feedback())
                await self._pause(goal, pursuit)
        code, text = verdict
        if code.endswith("VIOLATED"):
            self._changes.warn(f"a goal is aborted, the reference is brought to rest: {text}")
            self._stop("to bring the reference to rest")
        if code != "SUCCESSFUL":
            goal.abort()
        elif goal.is_cancel_requested:
            goal.canceled()
        else:
            goal.succeed()
        return self._action.Result(error_code=getattr(self._action.Result, code), error_string=text)

    async def _pause(self, goal: ServerGoalHandle, pursuit: Pursuit) -> None:
        wake_at = time.monotonic() + FEEDBACK_S
        await until(lambda: time.monotonic() >= wake_at or self._verdict(goal, pursuit) is not None)

    def _verdict(self, goal: ServerGoalHandle, pursuit: Pursuit) -> GoalVerdict | None:
        if self._is_closed:
            return GoalVerdict("INVALID_GOAL", "the mission has ended")
        if goal.is_cancel_requested:
            return GoalVerdict("SUCCESSFUL", "the reference is brought to rest")
        if self._changes.latest is not pursuit.piece:
            return GoalVerdict("INVALID_GOAL", "another motion took its place")
        return pursuit.verdict(self._changes.time)

    def _feedback(self) -> Any:
        changes, feedback = self._changes, self._action.Feedback()
        feedback.header.stamp = Time(nanoseconds=round(changes.time * 1e9)).to_msg()
        feedback.joint_names = list(changes.names.joints)
        desired = feedback.desired
        desired.positions, desired.velocities, desired.accelerations = changes.joints().tolist()
        return feedback
