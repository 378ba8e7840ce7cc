"""controller_node: answers every state with a command, under a law that can be swapped live."""

from __future__ import annotations

import time
from collections import Counter
from typing import ClassVar, NoReturn

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py import topics
from space_robot_msgs_py.codecs import CommandCodec, StateCodec
from space_robot_msgs_py.configuration import named_file
from space_robot_msgs_py.errors import MessageError
from space_robot_msgs_py.health import Health, Level
from space_robot_msgs_py.plain_codecs import LawCodec, TelemetryCodec
from space_robot_msgs_py.reference_codec import ReferenceCodec
from space_robot_msgs_py.ros.endpoints import (
    SPIN_S,
    In,
    Out,
    TakenByLoop,
    Waiter,
    flush,
    take_or_wait,
)
from space_robot_msgs_py.ros.shell import Shell, run_node
from space_robot_msgs_py.samples import RobotState
from space_robot_msgs_py.stamp_guard import StampGuard
from space_robot_sim.robot import Robot

from .controller import Controller
from .law_set import LawSet
from .reference import ReferenceBuffer
from .settings import ControllerNodeSettings
from .supervisor import Mode, Supervisor

Array = NDArray[np.float64]

FLUSH_S = 1.0
STAND_DOWN_S = 0.1
"""How long a controller that stands down waits for a state to answer."""


class ControllerLoop:
    """Takes the newest state, waits for its reference, answers; never answers a tick anew."""

    controller_class: ClassVar[type[Controller]] = Controller

    def __init__(self, shell: Shell, settings: ControllerNodeSettings) -> None:
        self._shell, self._settings = shell, settings
        robot = Robot.from_yaml(named_file("robots", settings.robot))
        self._laws = LawSet(shell, settings, robot.n + 3)
        self._laws.warm_up(robot)
        self._controller = self.controller_class(
            robot, self._laws.chosen, settings.period, settings.acceleration_filter_hz
        )
        self._supervisor = Supervisor(self._controller, robot.n + 3, settings.hold_ticks)
        self._stamps = StampGuard(settings.longest_jump)
        self._references = ReferenceBuffer(robot.n)
        timebase = settings.timebase
        self._states = StateCodec(robot.joint_names, timebase)
        self._commands = CommandCodec(robot.axis_names, timebase)
        self._reference_codec = ReferenceCodec(robot.joint_names, timebase)
        self._telemetry = TelemetryCodec(robot.axis_names)
        self._law = LawCodec(timebase)
        self._state = RobotState.allocate(robot.n)
        node, group = shell.node, TakenByLoop()
        self._command_out = Out(node, topics.COMMAND)
        self._telemetry_out = Out(node, topics.TELEMETRY)
        self._law_out = Out(node, topics.LAW)
        self.outputs = (self._command_out, self._telemetry_out, self._law_out)
        self._joints_in = In(node, topics.JOINT_STATES, group)
        self._base_in = In(node, topics.BASE_STATE, group)
        self._reference_joints_in = In(node, topics.REFERENCE_JOINTS, group)
        self._reference_base_in = In(node, topics.REFERENCE_BASE, group)
        spin_s = 0.0 if settings.fifo_priority else SPIN_S
        self._base_waiter = Waiter(node, self._base_in, spin_s=spin_s)
        self._joints_waiter = Waiter(node, self._joints_in, spin_s=spin_s)
        self._reference_waiter = Waiter(node, self._reference_joints_in, self._reference_base_in)
        self._answered, self._answer = -1, b""
        self._rejected: Counter[str] = Counter()
        self._state_at = time.monotonic()
        self._held_references = 0
        self._reference_missing = False

    def run(self) -> None:
        """Answer states until told to stop."""
        shell = self._shell
        shell.wait_for_listeners(self.outputs, self._settings.wait_for)
        while not shell.stopping:
            tick = self._take_state()
            if tick is None:
                self._take_references()  # ahead of need
            else:
                self._answer_tick(tick)
            shell.serve()
        flush(self.outputs, FLUSH_S)

    def stand_down(self) -> None:
        """Answer one more state, with no torque: the plant holds that."""
        if self._answered < 0 or not self._shell.node.count_publishers(topics.JOINT_STATES.name):
            return
        until = time.monotonic() + STAND_DOWN_S
        while time.monotonic() < until:
            tick = self._take_state()
            if tick is not None and tick > self._answered:
                self._command_out.publish(self._commands.encode(self._supervisor.stand_down(tick)))
                return

    def close(self) -> None:
        """Leave the parameters alone."""
        self._laws.close()

    def health(self) -> Health:
        """Mode, law, rejections."""
        supervisor, rejected = self._supervisor, self._rejected + self._supervisor.rejected
        silence = time.monotonic() - self._state_at
        values: dict[str, float | int | str] = {
            "tick": self._answered,
            "controller": self._controller.law.name,
            "references_held": self._held_references,
            **{f"rejected: {reason}": count for reason, count in rejected.items()},
        }
        if self._answered < 0:
            return Health("waiting for the first state", values=values)
        if supervisor.mode is not Mode.NOMINAL:
            level = Level.ERROR if supervisor.mode is Mode.SAFE else Level.WARN
            return Health(f"{supervisor.mode.value}: {supervisor.reason}", level, values)
        if silence > self._settings.state_timeout:
            values["silence_s"] = silence
            return Health("safe: no new state, so no command", Level.ERROR, values)
        if self._reference_missing:
            return Health("holding the reference: the mission is silent", Level.WARN, values)
        return Health("nominal", values=values)

    def _answer_tick(self, tick: int) -> None:
        if tick == self._answered:  # the plant asked again: the same answer
            self._command_out.publish(self._answer)
            return
        if not self._stamps.passes(tick):
            self._rejected["stamp"] += 1
            return
        reference = self._reference(tick)
        if reference is None:
            return
        controller = self._controller
        change = self._laws.change_at(tick)
        if change:
            self._law_out.publish(self._law.encode(change.law))
            if controller.law is not self._laws.chosen:
                controller.law = self._laws.chosen
        self._state.tick = tick
        mode = self._supervisor.mode
        command = self._supervisor.answer(self._state, *reference)
        if self._supervisor.mode is not mode:
            self._shell.report_soon()
        self._answer = self._commands.encode(command)
        self._command_out.publish(self._answer)
        self._answered, self._state_at = tick, time.monotonic()
        if change:
            self._laws.tell(change)
        if tick % self._settings.telemetry_decimation == 0:
            self._telemetry_out.publish(self._telemetry.encode(tick, controller.telemetry()))

    def _take_state(self) -> int | None:
        """The tick of the newest whole state, decoded into ``_state``; None if there is none.

        The joints' part is sent first: it is decoded while the base's part is on its way.
        """
        data = take_or_wait(self._joints_in, self._joints_waiter, 0.02)
        if data is None:
            return None
        while (newer := self._joints_in.take()) is not None:
            data = newer
        try:
            tick = self._states.decode_joints(data, self._state)
            base_tick = -1
            while base_tick < tick:
                data = take_or_wait(self._base_in, self._base_waiter, 0.02)
                if data is None:
                    return None
                base_tick = self._states.decode_base(data, self._state)
        except MessageError as error:
            self._rejected[error.reason] += 1
            return None
        return tick if base_tick == tick else None

    def _reference(self, tick: int) -> tuple[Array, Array] | None:
        """The reference of ``tick``, or its last point where the mission stays away.

        None if told to stop, or while nothing has come at all.
        """
        if self._references.covers(tick):
            self._reference_missing = False
            return self._references.at(tick)
        patience = 0.0 if self._reference_missing else self._settings.reference_timeout
        until = time.monotonic() + patience
        while not self._references.covers(tick):
            if self._shell.stopping:
                return None
            if not self._take_references():
                if time.monotonic() >= until and (held := self._references.hold(tick)):
                    self._reference_missing = True
                    self._held_references += 1
                    return held
                self._reference_waiter.wait(0.02)
                self._shell.serve()
        self._reference_missing = False
        return self._references.at(tick)

    def _take_references(self) -> bool:
        """Take what has come of the reference; whether anything has."""
        codec, references = self._reference_codec, self._references
        joints, base = self._reference_joints_in.take(), self._reference_base_in.take()
        try:
            if joints is not None:
                references.add_joints(*codec.decode_joints(joints))
            if base is not None:
                references.add_base(*codec.decode_base(base))
        except MessageError as error:
            self._rejected[f"reference: {error.reason}"] += 1
        return joints is not None or base is not None


def main() -> NoReturn:
    """Entry point of controller_node."""
    run_node(ControllerNodeSettings, ControllerLoop, changeable=("controller",))


if __name__ == "__main__":
    main()
