"""The mission node's loop: streams the desired motion in chunks, ahead of need."""

from __future__ import annotations

from space_robot_msgs_py import topics
from space_robot_msgs_py.config.files import named_file
from space_robot_msgs_py.errors import MessageError
from space_robot_msgs_py.ros.endpoints import (
    FollowedSubscription,
    PolledCallbackGroup,
    RawPublisher,
    Waiter,
)
from space_robot_msgs_py.ros.health import Health
from space_robot_msgs_py.ros.node_host import NodeHost
from space_robot_msgs_py.wire.cdr import header_stamp_ns
from space_robot_msgs_py.wire.reference_codec import ReferenceCodec
from space_robot_msgs_py.wire.stamp_guard import StampGuard
from space_robot_sim.robot import Robot

from .mission import Mission
from .settings import MissionNodeSettings

CLOCK_DEPTH = 1_000
"""All of a plant's messages are needed to tell them from another's."""
MOST_AT_ONCE = 100
"""Messages taken before the stream goes on: somebody may flood the topic."""
MOST_OWED_S = 60.0
"""A mission that was stopped for longer (simulated time) does not send what it owes."""


class MissionLoop:
    """Follows /clock and keeps the stream a lead ahead of it."""

    def __init__(self, host: NodeHost, settings: MissionNodeSettings) -> None:
        self._host, self._settings = host, settings
        robot = Robot.from_yaml(named_file("robots", settings.robot))
        self._mission = Mission(robot.n, settings, settings.period)
        self._codec = ReferenceCodec(robot.joint_names, settings.timebase)
        self._joints = RawPublisher(host.node, topics.REFERENCE_JOINTS)
        self._base = RawPublisher(host.node, topics.REFERENCE_BASE)
        self.outputs = (self._joints, self._base)
        self._clock = FollowedSubscription(
            host.node, topics.CLOCK, PolledCallbackGroup(), depth=CLOCK_DEPTH
        )
        self._waiter = Waiter(host.node, self._clock)
        self._stamps = StampGuard(round(MOST_OWED_S / settings.period))
        self._next = 0
        """The first tick that the stream has not reached."""
        self._strange, self._listeners = 0, 0

    def stand_down(self) -> None:
        """The controller holds the last point."""

    def close(self) -> None:
        """Nothing is kept."""

    def health(self) -> Health:
        """How far the stream has come."""
        values = {"tick": max(self._stamps.last, 0), "rejected: stamp": self._strange}
        return Health("nominal", values={**values, **self._clock.counts("rejected")})

    def run(self) -> None:
        """Stream until told to stop."""
        host, lead_ticks = self._host, self._settings.lead_ticks
        while not host.stopping:
            self._greet()
            if self._next < self._stamps.last + lead_ticks:
                self._send_chunk()
            else:
                self._waiter.wait(0.05)
            self._take_clock()
            host.serve()

    def _greet(self) -> None:
        """Say again what is still needed if somebody has joined."""
        listeners = self._joints.listener_count + self._base.listener_count
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

    def _take_clock(self) -> None:
        for _ in range(MOST_AT_ONCE):
            data = self._clock.take()
            if data is None:
                return
            try:
                tick = self._settings.timebase.tick(header_stamp_ns(data))
            except MessageError:  # not this graph's clock
                self._strange += 1
                self._clock.source.doubt()
                continue
            if tick != self._stamps.last and not self._believe(tick):
                self._strange += 1
                self._clock.source.doubt()
            else:
                self._clock.source.follow()

    def _believe(self, tick: int) -> bool:
        """Let ``tick`` be now if the guard believes it; a new time has a new stream."""
        stamps, last = self._stamps, self._stamps.last
        if not stamps.passes(tick):
            return False
        start = self._chunk_start(tick)
        if last < 0:  # in the middle of a flight there is nothing to say of its past
            self._next = max(self._next, start)
        elif stamps.is_new_time:
            self._host.log(f"a new time begins at tick {tick}, after {last}: the stream too")
            self._next = start
        return True
