"""The controller node's loop: answers every state with a command."""

from __future__ import annotations

import time

from space_robot_msgs_py import topics
from space_robot_msgs_py.config.files import named_file
from space_robot_msgs_py.ros.endpoints import SPIN_S, RawPublisher, flush
from space_robot_msgs_py.ros.health import Health, Level
from space_robot_msgs_py.ros.node_host import NodeHost
from space_robot_msgs_py.wire.codecs import CommandCodec
from space_robot_msgs_py.wire.plain_codecs import LawCodec, TelemetryCodec
from space_robot_msgs_py.wire.stamp_guard import StampGuard
from space_robot_sim.robot import Robot

from .controller import Controller
from .law_set import LawSet
from .reference_input import ReferenceInput
from .settings import ControllerNodeSettings
from .state_input import StateInput
from .supervisor import Mode, Supervisor

FLUSH_S = 1.0
LOOK_AHEAD_S = 0.02
"""The reference is looked for this often though it is not needed yet, so that no flood of others'
messages pushes it out of its queue."""
STAND_DOWN_S = 0.1
"""How long a controller that stands down waits for a state to answer."""


class ControllerLoop:
    """Takes the newest state, waits for its reference, answers; never answers a tick anew."""

    def __init__(self, host: NodeHost, settings: ControllerNodeSettings) -> None:
        self._host, self._settings = host, settings
        robot = Robot.from_yaml(named_file("robots", settings.robot))
        self._laws = LawSet(host, settings, robot.n + 3)
        self._laws.warm_up(robot)
        self._controller = Controller(
            robot, self._laws.chosen, settings.period, settings.acceleration_filter_hz
        )
        self._supervisor = Supervisor(self._controller, robot.n + 3, settings.hold_ticks)
        self._stamps = StampGuard(settings.longest_jump)
        timebase = settings.timebase
        spin_s = 0.0 if settings.fifo_priority else SPIN_S
        self._states = StateInput(host.node, robot, timebase, spin_s)
        self._references = ReferenceInput(host, robot, timebase, settings.reference_timeout)
        self._commands = CommandCodec(robot.axis_names, timebase)
        self._telemetry = TelemetryCodec(robot.axis_names)
        self._law = LawCodec(timebase)
        node = host.node
        self._command_out = RawPublisher(node, topics.COMMAND)
        self._telemetry_out = RawPublisher(node, topics.TELEMETRY)
        self._law_out = RawPublisher(node, topics.LAW)
        self.outputs = (self._command_out, self._telemetry_out, self._law_out)
        self._answered, self._answer = -1, b""
        self._state_at = time.monotonic()

    def run(self) -> None:
        """Answer states until told to stop."""
        host = self._host
        host.wait_for_listeners(self.outputs, self._settings.wait_for)
        look_ahead = 0.0
        while not host.stopping:
            tick = self._states.take()
            if tick is None:
                self._references.take()  # ahead of need
            else:
                self._answer_tick(tick)
                if self._state_at > look_ahead:
                    self._references.take()
                    look_ahead = self._state_at + LOOK_AHEAD_S
            host.serve()
        flush(self.outputs, FLUSH_S)

    def stand_down(self) -> None:
        """Answer one more state, with no torque: the plant holds that."""
        if self._answered < 0 or not self._host.node.count_publishers(topics.JOINT_STATES.name):
            return
        until = time.monotonic() + STAND_DOWN_S
        while time.monotonic() < until:
            tick = self._states.take()
            if tick is not None and tick > self._answered:
                self._command_out.publish(self._commands.encode(self._supervisor.stand_down(tick)))
                return

    def close(self) -> None:
        """Leave the parameters alone."""
        self._laws.close()

    def health(self) -> Health:
        """Mode, law, rejections."""
        supervisor, references = self._supervisor, self._references
        rejected = self._states.rejected + references.rejected + supervisor.rejected
        silence = time.monotonic() - self._state_at
        values: dict[str, float | int | str] = {
            "tick": self._answered,
            "controller": self._controller.law.name,
            "references_held": references.held,
            **{f"rejected: {reason}": count for reason, count in rejected.items()},
        }
        for entry in (*self._states.inputs, *references.inputs):
            values |= entry.counts("rejected")
        if references.is_waited_for:
            return Health("waiting for the reference: no mission sends it", Level.WARN, values)
        if self._answered < 0:
            return Health("waiting for the first state", values=values)
        if supervisor.mode is not Mode.NOMINAL:
            level = Level.ERROR if supervisor.mode is Mode.SAFE else Level.WARN
            return Health(f"{supervisor.mode.value}: {supervisor.reason}", level, values)
        if silence > self._settings.state_timeout:
            values["silence_s"] = silence
            return Health("safe: no new state, so no command", Level.ERROR, values)
        if references.is_missing:
            return Health("holding the reference: the mission is silent", Level.WARN, values)
        return Health("nominal", values=values)

    def _answer_tick(self, tick: int) -> None:
        if tick == self._answered:  # the plant asked again: the same answer
            self._command_out.publish(self._answer)
            return
        if tick != self._stamps.last and not self._believe(tick):
            return
        reference = self._references.at(tick)
        if reference is None:
            return
        controller = self._controller
        change = self._laws.change_at(tick)
        if change:
            self._law_out.publish(self._law.encode(change.law))
            if controller.law is not self._laws.chosen:
                controller.law = self._laws.chosen
        state = self._states.state
        state.tick = tick
        mode = self._supervisor.mode
        command = self._supervisor.answer(state, *reference)
        if self._supervisor.mode is not mode:
            self._host.report_soon()
        self._answer = self._commands.encode(command)
        self._command_out.publish(self._answer)
        self._answered = tick
        if change:
            self._laws.tell(change)
        if tick % self._settings.telemetry_decimation == 0:
            self._telemetry_out.publish(self._telemetry.encode(tick, controller.telemetry()))

    def _believe(self, tick: int) -> bool:
        """Whether a state's stamp fits, or begins a new time; then its sender is followed."""
        stamps, last = self._stamps, self._stamps.last
        if not stamps.passes(tick):
            self._states.reject("stamp")
            return False
        self._states.follow()
        references = self._references.buffer
        if stamps.is_new_time:
            references.begin(tick)
            if last >= 0:
                self._host.log(f"a new time begins at tick {tick}, after {last}")
        references.now = tick
        self._state_at = time.monotonic()
        return True
