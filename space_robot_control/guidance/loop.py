"""The mission node's loop: streams the desired motion in chunks, in advance.

The motion is changed in flight by the parameter ``goto``, by trajectories on a topic, and by goals
of an action.
"""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

from space_robot_model.robot.find import find_robot
from space_robot_msgs_py import topics
from space_robot_msgs_py.errors import MessageError
from space_robot_msgs_py.ros.endpoints import PolledCallbackGroup, RawPublisher, RawSubscription
from space_robot_msgs_py.ros.loop import Health, Level, Wait
from space_robot_msgs_py.ros.managed_node import ManagedNode
from space_robot_msgs_py.samples import RobotNames
from space_robot_msgs_py.wire.cdr import header_stamp_ns
from space_robot_msgs_py.wire.stamp_guard import StampGuard, describe_new_time
from space_robot_msgs_py.wire.telemetry import ReferenceCodec

from .mission import Mission, MissionNodeSettings
from .mission_changes import MissionChanges

if TYPE_CHECKING:
    from .trajectory_action import TrajectoryAction

MOST_AT_ONCE = 100
"""Messages taken before the stream goes on: somebody may flood the topic."""
CLOCK_WAIT_S = RESEND_S = 0.05
MOST_OWED_S = 60.0
"""A mission that was stopped for longer (simulated time) does not send what it owes."""


class MissionLoop:
    """Loop that follows /clock and streams the reference ahead of it."""

    is_complete = False

    def __init__(
        self, node: ManagedNode[MissionNodeSettings], settings: MissionNodeSettings
    ) -> None:
        """Read the robot and the mission."""
        self._node, self._settings = node, settings
        self.wait_for = settings.wait_for
        robot = find_robot(settings.robot)
        self._mission = Mission(robot, settings, settings.period)
        self._codec = ReferenceCodec(robot.joint_names, settings.timebase)
        self._joints = RawPublisher(node, topics.REFERENCE_JOINTS)
        self._base = RawPublisher(node, topics.REFERENCE_BASE)
        self.outputs = (self._joints, self._base)
        self._clock = RawSubscription(node, topics.CLOCK, PolledCallbackGroup())
        self._for_clock = Wait(CLOCK_WAIT_S, (self._clock,))
        self._stamps = StampGuard(round(MOST_OWED_S / settings.period))
        self._is_resumed = True
        """True until the first tick since the activation."""
        self._next = 0
        """The first tick that the stream has not reached."""
        self._invalid_stamps, self._listeners = 0, 0
        self._resend_at = 0.0
        self._changes = MissionChanges(
            node,
            self._mission,
            lambda: (max(self._stamps.last, 0), self._next),
            RobotNames(robot.joint_names, passive=robot.passive_names),
        )
        self._action = self._offer_action()

    def _offer_action(self) -> TrajectoryAction | None:
        try:
            from control_msgs.action import FollowJointTrajectory
        except ImportError:  # without that package there is no action
            return None
        from .trajectory_action import TrajectoryAction

        return TrajectoryAction(self._node, FollowJointTrajectory, self._changes)

    def begin(self) -> None:
        """Begin at the end of the stream."""
        self._is_resumed = True

    def step(self) -> Wait | None:
        """Send due chunks and read the clock."""
        now = time.monotonic()
        if now >= self._resend_at:
            self._resend_at = now + RESEND_S
            self._resend_pending()
            self._changes.take()
        has_taken = self._take_clock()
        if self._next < self._stamps.last + self._settings.lead_ticks:
            self._send_chunk()
            return None
        return None if has_taken else self._for_clock

    def deactivate(self) -> None:
        """Stop streaming; the controller holds the last point."""

    def close(self) -> None:
        """Stop accepting changes."""
        if self._action:
            self._action.close()
        self._changes.close()

    def health(self) -> Health:
        """Report the progress of the stream."""
        values = {"tick": max(self._stamps.last, 0), "rejected: stamp": self._invalid_stamps}
        values |= self._changes.counts
        if warning := self._changes.next_warning():
            return Health(warning, Level.WARN, values)
        return Health("nominal", values=values)

    def _resend_pending(self) -> None:
        listeners = self._joints.listener_count + self._base.listener_count
        # topics keep nothing for subscribers that come later
        if listeners > self._listeners:
            self._next = min(self._next, self._chunk_start(max(self._stamps.last, 0)))
        self._listeners = listeners

    def _chunk_start(self, tick: int) -> int:
        return tick // self._settings.chunk_ticks * self._settings.chunk_ticks

    def _send_chunk(self) -> None:
        chunk = self._mission.chunk(self._next, self._settings.chunk_ticks)
        joints, base = self._codec.encode(chunk)
        self._joints.publish(joints)
        self._base.publish(base)
        self._next = chunk.stop

    def _take_clock(self) -> bool:
        for count in range(MOST_AT_ONCE):
            data = self._clock.take()
            if data is None:
                return count > 0
            try:
                tick = self._settings.timebase.tick(header_stamp_ns(data))
            except MessageError:  # not this graph's clock
                self._invalid_stamps += 1
                continue
            if tick != self._stamps.last and not self._accept(tick):
                self._invalid_stamps += 1
        return True

    def _accept(self, tick: int) -> bool:
        stamps, last = self._stamps, self._stamps.last
        if not stamps.passes(tick):
            return False
        start = self._chunk_start(tick)
        if last < 0:  # in the middle of a flight there is nothing to say of its past
            self._next = max(self._next, start)
        elif stamps.is_new_time:
            new_time = describe_new_time(tick, last, self._is_resumed)
            self._node.log(f"{new_time}: the stream too")
            self._next = start
        self._is_resumed = False
        return True
