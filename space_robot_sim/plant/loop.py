"""The plant node's loop: sends a state, takes its command, steps."""

from __future__ import annotations

import json
import math
import time
from collections import deque

import numpy as np
from rclpy.serialization import serialize_message
from std_msgs.msg import String

from space_robot_model.robot.find import robot_source
from space_robot_msgs_py import topics
from space_robot_msgs_py.errors import MessageError
from space_robot_msgs_py.ros.endpoints import (
    PausedOutput,
    PolledCallbackGroup,
    RawPublisher,
    RawSubscription,
    flush,
)
from space_robot_msgs_py.ros.loop import Health, Level, Wait
from space_robot_msgs_py.ros.managed_node import ManagedNode
from space_robot_msgs_py.samples import Command
from space_robot_msgs_py.wire.codecs import CommandCodec, StateCodec
from space_robot_msgs_py.wire.telemetry import ClockCodec

from .messages import NO_TICK, CommandGuard, PlantMessages, SentState
from .outputs import BaseOutput, SceneOutput, TruthOutput
from .pacing import (
    PAUSED,
    SPIN_BEFORE_DEADLINE_S,
    ControllerWatch,
    LateListeners,
    RunControl,
    WallClock,
)
from .plant import Plant
from .report import ActuatorHealth, plant_description
from .settings import PlantNodeSettings

TIMEOUT_S = 0.02
ASK_AGAIN_S = 0.2
"""Time without an answer after which the state is sent again in lockstep, s: well before a listener
takes the plant for silent, and soon enough for one that accepts a new time after some states."""
GIVE_WAY = Wait(100e-6, is_for_others=True)
HELD = Wait(0.02)
"""The wait of a paused plant, which only a service call ends."""
FLUSH_S = 2.0
"""Longest wait for listeners at the end of a flight, which may be stopped or dead, s."""
STOPPED_FLUSH_S = 1.0
"""Longest wait for listeners of a stopped plant, since they may be ending, too, s."""
MOST_AT_ONCE = 100
"""Commands read before the clock is checked again, in case of a flood."""
HOLDING_TICKS = 20
"""Ticks after which a held command is reported in the diagnostics."""


class PlantLoop:
    """Loop that sends a state, takes its command and steps, in lockstep or by the clock.

    In lockstep a tick waits for its answer. A controller that has fallen silent is not waited
    for: then, and always by the wall clock, a tick lasts its period and the last command is held.
    """

    def __init__(self, node: ManagedNode[PlantNodeSettings], settings: PlantNodeSettings) -> None:
        """Make the plant and its topics."""
        self._node, self._settings = node, settings
        source = robot_source(settings.robot)
        robot = source.robot
        self._plant = Plant(robot, settings, settings.period)
        self._description = plant_description(robot, source.content, self._plant, settings)
        names = self._plant.names
        at_rest = Command(0, np.zeros(len(names.commanded)))
        # a step of another plant: compiled code is loaded now, not in the first tick
        Plant(robot, settings, settings.period).step(at_rest)
        self._actuators = ActuatorHealth(self._plant)
        timebase = settings.timebase
        self._timebase = timebase
        self._states = StateCodec(names, timebase)
        self._commands = CommandCodec(names.commanded, timebase)
        self._clock = ClockCodec()
        self._guard = CommandGuard(len(names.commanded), settings.hold_ticks)
        self._exchange = PlantMessages(settings, names, settings.period, self._states, self._guard)
        self._state_out = tuple(RawPublisher(node, topic) for topic in self._states.topics)
        self._clock_out = RawPublisher(node, topics.CLOCK)
        self._command_in = RawSubscription(node, topics.COMMAND, PolledCallbackGroup())
        self._for_answer = Wait(TIMEOUT_S, (self._command_in,), is_brief=True)
        self._truth = TruthOutput(node, self._plant, timebase)
        self._scene = SceneOutput(node, robot, timebase)
        self._base = BaseOutput(node, settings)
        self._description_out = RawPublisher(node, topics.PLANT_DESCRIPTION)
        self.outputs = (
            *self._state_out,
            self._clock_out,
            *self._truth.outputs,
            *self._scene.outputs,
            self._description_out,
        )
        self._late_listeners = LateListeners(
            (self._state_out[0], self._clock_out, *self._scene.viewed, *self._base.outputs)
        )
        self.wait_for = settings.wait_for
        self.is_complete = False
        self.control = RunControl(settings.paused)
        """Pausing and stepping; each change must be announced by `report_pause`."""
        self._paused_out = PausedOutput(node)
        self._wall_clock = WallClock(settings.period)
        self._silence_s = settings.silence_timeout or math.inf
        self._watch = ControllerWatch(node, self._command_in, settings)
        self._controller_silent = False
        self._by_the_clock = False
        """True if the present tick lasts its period by the wall clock."""
        self._must_give_way = False
        self._is_under_way = False
        """True if the tick's state has been measured."""
        self._unsent: deque[SentState] = deque()
        """States of this tick that are still to be sent: in lockstep, once the one before has been
        answered."""
        self._sent, self._clock_sent = SentState((), NO_TICK), b""
        self._answered_by = NO_TICK
        """Tick of the newest command that can come."""
        self._awaits = False
        """True if lockstep waits for it."""
        self._heard = self._heard_before = NO_TICK
        """Newest tick that a command answers: now, and at this tick's begin."""
        self._sent_at = self._awaited_since = 0.0
        self._began_at, self._first_tick = time.monotonic(), 0
        self._answers, self._latency_s, self._latency_max_s = 0, 0.0, 0.0
        self.missed_deadlines = 0
        """Ticks whose command had not come by their end."""

    def begin(self) -> None:
        """Begin with the state of the present tick."""
        self._is_under_way = self._awaits = False
        self._unsent.clear()
        self._began_at, self._first_tick = time.monotonic(), self._plant.tick
        self._wall_clock.start(self._plant.tick)
        if not self._description_out.sent:
            text = String(data=json.dumps(self._description))
            self._description_out.publish(serialize_message(text))
        self._scene.begin()
        self.report_pause()

    def report_pause(self) -> None:
        """Publish whether the plant is paused."""
        self._paused_out.tell(self.control.is_paused)
        self._node.report()

    def step(self) -> Wait | None:
        """Send a state, or take its answer and step the plant.

        Raises:
            FlightError: the controller that others start does not come, or has fallen silent.
        """
        if not self._is_under_way:
            if self._watch.is_awaited():
                return HELD
            self._begin_tick()
        if self._by_the_clock:
            return self._step_by_the_clock()
        if self._awaits:
            data = self._command_in.take()
            if data is None:
                return self._wait_for_answer()
            if self._receive(data) != self._answered_by:
                return None
            self._time_answer()
            self._awaits = False
        if self._unsent:
            self._send_next()
        elif self.control.holds():
            return self._hold()
        else:
            self._end_tick()
        return None

    def deactivate(self) -> None:
        """Set the actuators to zero, and wait until listeners have all messages."""
        self._guard.release()
        self._truth.flush()
        elapsed = time.monotonic() - self._began_at
        flush(self.outputs, FLUSH_S if self.is_complete else STOPPED_FLUSH_S)
        clock, missed = self._wall_clock, self.missed_deadlines
        late = f", {missed} missed deadlines" if missed else ""
        late += f", {clock.lost_time_s:.3f} s behind the wall clock" if clock.lost_time_s else ""
        flown_s = (self._plant.tick - self._first_tick) * self._settings.period
        self._node.log(f"flew {flown_s:.4f} s in {elapsed:.2f} s{late}")

    def close(self) -> None:
        """Keep nothing."""

    def health(self) -> Health:
        """Report the mode, the answers, and refused commands."""
        guard, tick = self._guard, self._plant.tick
        values: dict[str, float | int | str] = {
            "tick": tick,
            "missed_deadlines": self.missed_deadlines,
            "held_ticks": guard.held_ticks(tick),
            "saturated_ticks": self._plant.saturated_ticks,
            **self._actuators.values,
            **{f"refused: {reason}": count for reason, count in guard.refused.items()},
            **({"faults": "injected"} if any(self._settings.faults) else {}),
        }
        if self._answers:
            values["latency_mean_ms"] = 1e3 * self._latency_s / self._answers
            values["latency_max_ms"] = 1e3 * self._latency_max_s
        if self.control.is_paused:
            return Health(PAUSED, values=values)
        if self._watch.is_missing:
            return Health(
                f"waiting for a node that publishes {self._command_in.full_name}", values=values
            )
        if guard.answered < 0 or tick == 0:  # nothing acts before the first tick ends
            return Health("waiting for the first command", values=values)
        if guard.is_safe:
            return Health("safe: no good command, the torque is zero", Level.ERROR, values)
        if guard.held_ticks(tick) > HOLDING_TICKS:
            return Health("holding the last good command", Level.WARN, values)
        if saturated := self._actuators.saturated():
            return Health("wheels at their limits", Level.WARN, {**values, "saturated": saturated})
        return Health("nominal", values=values)

    def _begin_tick(self) -> None:
        tick = self._plant.tick
        self._is_under_way = True
        self._late_listeners.begin()
        self._by_the_clock = self._controller_silent or (self._settings.realtime and tick > 0)
        self._must_give_way = self._by_the_clock and self._wall_clock.left(tick) <= 0.0
        self._heard_before = self._heard
        self._unsent.extend(self._exchange.send(self._plant.state))
        if self._unsent:
            self._send_next()
        # the state is out: the rest is done while it is being answered
        if tick % self._settings.clock_decimation == 0:
            self._clock_sent = self._clock.encode(self._timebase.stamp_ns(tick))
            self._clock_out.publish(self._clock_sent)
        self._truth.send(self._plant.truth)
        self._scene.send(self._plant.truth)
        self._base.send(self._plant.state)

    def _send_next(self) -> None:
        self._sent = state = self._unsent.popleft()
        self._publish()
        if state.answered_by != NO_TICK:
            self._answered_by, self._awaits = state.answered_by, True
            self._awaited_since = self._sent_at

    def _publish(self) -> None:
        for output, message in zip(self._state_out, self._sent.messages, strict=True):
            output.publish(message)
        self._sent_at = time.monotonic()

    def _wait_for_answer(self) -> Wait | None:
        """Wait on for the answer; send the state again, or take the controller for silent."""
        now = time.monotonic()
        if now > self._awaited_since + self._silence_s and self._heard >= 0:
            self._watch.check_silence(self._plant.tick)
            self._node.log(f"no command for {self._silence_s:g} s: the controller is silent")
            self._controller_silent, self._awaits = True, False
            self._wall_clock.start(self._plant.tick)
            self._by_the_clock = True
            return None
        if self._heard < 0:
            self._watch.check_first(now - self._awaited_since, self._guard.refused)
        if now > self._sent_at + ASK_AGAIN_S:
            self._publish()
            self._clock_out.publish(self._clock_sent)
        return self._for_answer

    def _step_by_the_clock(self) -> Wait | None:
        """Take commands until the tick is over, then step the plant."""
        while self._unsent:
            self._send_next()
        if self._must_give_way:  # behind: catch up, but never take the whole processor
            self._must_give_way = False
            return GIVE_WAY
        self._take_all()
        left = self._wall_clock.left(self._plant.tick)
        if left > SPIN_BEFORE_DEADLINE_S:
            inputs = () if self._heard == self._answered_by else (self._command_in,)
            return Wait(left - SPIN_BEFORE_DEADLINE_S, inputs)
        if left <= 0.0:
            if self.control.holds():
                return self._hold()
            if self._controller_silent and self._heard > self._heard_before:
                self._node.log("the controller answers again")
                self._controller_silent = False
            self._end_tick()
        return None

    def _hold(self) -> Wait:
        """Stay at the present tick; repeat its messages for new listeners.

        Of the state only the joints' part: the controller does not answer a part alone.
        """
        if self._late_listeners.are_due(time.monotonic()):
            self._clock_out.publish(self._clock_sent)
            for output, message in zip(self._state_out[:1], self._sent.messages, strict=False):
                output.publish(message)
            self._scene.show(self._plant.truth)
            self._base.show(self._plant.state)
        return HELD

    def _end_tick(self) -> None:
        """Step the plant under the command in force, and begin the next tick."""
        plant, guard, clock = self._plant, self._guard, self._wall_clock
        tick = plant.tick
        self._exchange.end(tick)
        if self.control.is_at_rest:  # a pause is no lost time
            clock.start(tick + 1)
        if tick == 0:
            clock.start(0)  # time begins when the loop is closed
        elif self._by_the_clock:
            if (tick - self._heard) * self._settings.period > self._silence_s:
                self._watch.check_silence(tick)
            if clock.slip(tick) and (remark := clock.remark()):
                self._node.log(remark)
        self.missed_deadlines += guard.answered != tick
        was_safe = guard.is_safe
        command = guard.act(tick)
        if guard.is_safe is not was_safe:
            self._node.report()
        plant.step(command)
        self.control.begin(plant.tick)
        self._is_under_way = self._awaits = False
        ticks = self._settings.ticks
        self.is_complete = bool(ticks) and plant.tick >= ticks
        if not self.is_complete:
            self._begin_tick()

    def _take_all(self) -> None:
        for _ in range(MOST_AT_ONCE):  # a flood must not hold up the clock
            data = self._command_in.take()
            if data is None:
                return
            if self._receive(data) == self._answered_by:
                self._time_answer()

    def _receive(self, data: bytes) -> int | None:
        """Accept a command if it is good; return the tick that it answers, if it can be read."""
        guard = self._guard
        try:
            self._commands.decode(data, guard.offered)
        except MessageError as error:
            guard.refuse(error.reason)
            return None
        tick = guard.offered.tick
        if self._heard < tick <= self._plant.tick:  # a stamp of the future answers nothing
            self._heard = tick
        self._exchange.take(self._plant.tick)
        return tick

    def _time_answer(self) -> None:
        latency = time.monotonic() - self._sent_at
        self._answers += 1
        self._latency_s += latency
        self._latency_max_s = max(self._latency_max_s, latency)
