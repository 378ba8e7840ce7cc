"""mission_node: streams the desired motion in chunks, ahead of need."""

from __future__ import annotations

from typing import NoReturn

from space_robot_msgs_py import topics
from space_robot_msgs_py.cdr import header_stamp_ns
from space_robot_msgs_py.configuration import named_file
from space_robot_msgs_py.errors import MessageError
from space_robot_msgs_py.health import Health
from space_robot_msgs_py.reference_codec import ReferenceCodec
from space_robot_msgs_py.ros.endpoints import In, Out, TakenByLoop, Waiter
from space_robot_msgs_py.ros.shell import Shell, run_node
from space_robot_sim.robot import Robot

from .mission import Mission
from .settings import MissionNodeSettings


class MissionLoop:
    """Follows /clock and keeps the stream a lead ahead of it."""

    def __init__(self, shell: Shell, settings: MissionNodeSettings) -> None:
        self._shell, self._settings = shell, settings
        robot = Robot.from_yaml(named_file("robots", settings.robot))
        self._mission = Mission(robot.n, settings, settings.period)
        self._codec = ReferenceCodec(robot.joint_names, settings.timebase)
        self._joints = Out(shell.node, topics.REFERENCE_JOINTS)
        self._base = Out(shell.node, topics.REFERENCE_BASE)
        self.outputs = (self._joints, self._base)
        self._clock = In(shell.node, topics.CLOCK, TakenByLoop(), depth=1)
        self._waiter = Waiter(shell.node, self._clock)

        self._now, self._strange = 0, 0

    def stand_down(self) -> None:
        """The controller holds the last point."""

    def close(self) -> None:
        """Nothing is kept."""

    def health(self) -> Health:
        """How far the stream has come."""
        return Health("nominal", values={"tick": self._now, "rejected: stamp": self._strange})

    def run(self) -> None:
        """Stream until told to stop."""
        chunk_ticks, next_tick, now = self._settings.chunk_ticks, 0, -1
        while not self._shell.stopping:
            while next_tick < now + self._settings.lead_ticks:
                joints, base = self._codec.encode(self._mission.chunk(next_tick, chunk_ticks))
                self._joints.publish(joints)
                self._base.publish(base)
                next_tick += chunk_ticks
            self._waiter.wait(0.05)
            while (data := self._clock.take()) is not None:
                try:
                    tick = self._settings.timebase.tick(header_stamp_ns(data))
                except MessageError:  # not this graph's clock
                    self._strange += 1
                    continue
                began, now = now < 0, tick
                self._now = now
                if began:  # in the middle of a flight there is nothing to say of its past
                    next_tick = max(next_tick, now // chunk_ticks * chunk_ticks)
            self._shell.serve()


def main() -> NoReturn:
    """Entry point of mission_node."""
    run_node(MissionNodeSettings, MissionLoop)


if __name__ == "__main__":
    main()
