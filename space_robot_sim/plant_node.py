"""plant_node: steps the plant against the commands of the graph."""

from __future__ import annotations

import math
import time
from typing import ClassVar, NoReturn

import numpy as np

from space_robot_msgs_py import topics
from space_robot_msgs_py.codecs import CommandCodec, StateCodec
from space_robot_msgs_py.configuration import named_file
from space_robot_msgs_py.errors import MessageError
from space_robot_msgs_py.health import Health, Level
from space_robot_msgs_py.plain_codecs import ClockCodec
from space_robot_msgs_py.ros.endpoints import (
    SPIN_S,
    FollowedIn,
    Out,
    TakenByLoop,
    Waiter,
    flush,
    take_or_wait,
)
from space_robot_msgs_py.ros.shell import Shell, run_node
from space_robot_msgs_py.samples import Command

from .command_guard import CommandGuard
from .plant import Plant
from .plant_settings import PlantNodeSettings
from .robot import Robot
from .wall_clock import WallClock

ASK_AGAIN_S = 0.2
"""Without an answer for this long the state is sent again (lockstep): well before a listener takes
this plant for silent, and soon enough for one that believes a new time only after some states."""
SPIN_BEFORE_DEADLINE_S = 100e-6
GIVE_WAY_S = 100e-6
FLUSH_S = 5.0
"""How long a flight's end waits for its listeners: one may be stopped, or dead."""
STOPPED_FLUSH_S = 1.0
"""How long a plant that was told to stop waits: its listeners may be ending, too."""
MOST_AT_ONCE = 100
"""Commands taken before the clock is looked at again: somebody may flood the topic."""
HOLDING_TICKS = 20
"""A command held for longer is worth a word in the diagnostics."""


class PlantLoop:
    """Sends the state of a tick, waits for its command, steps; paced by the graph or the clock.

    In lockstep a tick waits for its answer. A controller that has fallen silent is not waited
    for: then, and always by the wall clock, a tick lasts its period and the last command is held.
    """

    plant_class: ClassVar[type[Plant]] = Plant

    def __init__(self, shell: Shell, settings: PlantNodeSettings) -> None:
        self._shell, self._settings = shell, settings
        robot = Robot.from_yaml(named_file("robots", settings.robot))
        self._plant = self.plant_class(robot, settings, settings.period)
        at_rest = Command(0, np.zeros(robot.n + 3))
        Plant(robot, settings, settings.period).step(at_rest)  # loads the compiled code
        timebase = settings.timebase
        self._timebase = timebase
        self._states = StateCodec(robot.joint_names, timebase)
        self._commands = CommandCodec(robot.axis_names, timebase)
        self._clock = ClockCodec()
        self._guard = CommandGuard(robot.n + 3, settings.hold_ticks)
        node = shell.node
        self._joint_states = Out(node, topics.JOINT_STATES)
        self._base_state = Out(node, topics.BASE_STATE)
        self._clock_out = Out(node, topics.CLOCK)
        self._command_in = FollowedIn(node, topics.COMMAND, TakenByLoop())
        spin_s = 0.0 if settings.fifo_priority else SPIN_S
        self._waiter = Waiter(node, self._command_in, spin_s=spin_s)
        self.outputs = (self._joint_states, self._base_state, self._clock_out)
        self._wall_clock = WallClock(settings.period)
        self._silence_s = settings.silence_timeout or math.inf
        self._controller_silent = False
        self._heard = -1
        """The newest tick that a command has come for."""
        self._sent, self._clock_sent = (b"", b""), b""
        self._sent_at = 0.0
        self._answers, self._latency_s, self._latency_max_s = 0, 0.0, 0.0
        self.late_ticks = 0
        """Ticks that were not answered before their end."""

    def run(self) -> None:
        """Fly until the last tick, or until told to stop."""
        shell, settings, plant, clock = self._shell, self._settings, self._plant, self._wall_clock
        shell.wait_for_listeners(self.outputs, settings.wait_for)
        began, first = time.monotonic(), plant.tick
        clock.start(plant.tick)
        while not shell.stopping and (not settings.ticks or plant.tick < settings.ticks):
            if not self._exchange():
                break
            if plant.tick == 0:
                clock.start(0)  # time begins when the loop is closed
            elif self._by_the_clock and clock.slip(plant.tick) and (remark := clock.remark()):
                shell.log(remark)
            self._step()
            shell.serve()
        elapsed = time.monotonic() - began
        flush(self.outputs, STOPPED_FLUSH_S if shell.stopping else FLUSH_S)
        late = f", {self.late_ticks} ticks without an answer in time" if self.late_ticks else ""
        late += f", {clock.slipped_s:.3f} s behind the wall clock" if clock.slipped_s else ""
        shell.log(f"flew {(plant.tick - first) * settings.period:.4f} s in {elapsed:.2f} s{late}")

    def stand_down(self) -> None:
        """The actuators are left at zero."""
        self._guard.release()

    def close(self) -> None:
        """Nothing is kept."""

    def health(self) -> Health:
        """Mode, answers, refusals."""
        guard, tick = self._guard, self._plant.tick
        values: dict[str, float | int | str] = {
            "tick": tick,
            "unanswered_ticks": self.late_ticks,
            "held_ticks": guard.held_ticks(tick),
            "saturated_ticks": self._plant.saturated_ticks,
            **{f"refused: {reason}": count for reason, count in guard.refused.items()},
            **self._command_in.counts("refused"),
        }
        if self._answers:
            values["latency_mean_ms"] = 1e3 * self._latency_s / self._answers
            values["latency_max_ms"] = 1e3 * self._latency_max_s
        if guard.answered < 0:
            return Health("waiting for the first command", values=values)
        if guard.is_safe:
            return Health("safe: no good command, the torque is zero", Level.ERROR, values)
        if guard.held_ticks(tick) > HOLDING_TICKS:
            return Health("holding the last good command", Level.WARN, values)
        return Health("nominal", values=values)

    @property
    def _by_the_clock(self) -> bool:
        return self._controller_silent or (self._settings.realtime and self._plant.tick > 0)

    def _exchange(self) -> bool:
        """Send the state of this tick and get its answer, if it comes; False if told to stop."""
        plant = self._plant
        self._publish(*self._states.encode(plant.state))
        self._publish_clock()
        return self._wait(plant.tick)

    def _publish(self, joints: bytes, base: bytes) -> None:
        self._sent = joints, base
        self._joint_states.publish(joints)
        self._base_state.publish(base)
        self._sent_at = time.perf_counter()

    def _publish_clock(self) -> None:
        tick = self._plant.tick
        if tick % self._settings.clock_decimation == 0:
            self._clock_sent = self._clock.encode(self._timebase.stamp_ns(tick))
            self._clock_out.publish(self._clock_sent)

    def _step(self) -> None:
        plant, guard = self._plant, self._guard
        self.late_ticks += guard.answered != plant.tick
        was_safe = guard.is_safe
        command = guard.act(plant.tick)
        if guard.is_safe is not was_safe:
            self._shell.report_soon()
        plant.step(command)

    def _wait(self, stamp: int) -> bool:
        """Wait for the command that answers the state stamped so; False if told to stop."""
        if self._by_the_clock:
            self._wait_by_the_clock(stamp)
            return not self._shell.stopping
        ask_again = time.monotonic() + ASK_AGAIN_S
        give_up = time.monotonic() + self._silence_s
        while True:
            data = take_or_wait(self._command_in, self._waiter, 0.02)
            if data is not None and self._receive(data) == stamp:
                self._time_answer()
                return True
            if self._shell.stopping:
                return False
            now = time.monotonic()
            if now > give_up and self._heard >= 0:
                self._shell.log(f"no command for {self._silence_s:g} s: the controller is silent")
                self._controller_silent = True
                self._wall_clock.start(self._plant.tick)
                return True
            if now > ask_again:
                ask_again = now + ASK_AGAIN_S
                self._publish(*self._sent)
                self._clock_out.publish(self._clock_sent)
            self._shell.serve()

    def _wait_by_the_clock(self, stamp: int) -> None:
        """Take what comes until the tick is over."""
        tick, clock, before = self._plant.tick, self._wall_clock, self._heard
        if clock.left(tick) <= 0.0:  # behind: catch up, but never take the whole processor
            time.sleep(GIVE_WAY_S)
        while (left := clock.left(tick)) > 0.0:
            if left > SPIN_BEFORE_DEADLINE_S and self._heard != stamp:
                self._waiter.wait(left - SPIN_BEFORE_DEADLINE_S)
            elif left > SPIN_BEFORE_DEADLINE_S:
                time.sleep(left - SPIN_BEFORE_DEADLINE_S)
            self._take_all(stamp)
        self._take_all(stamp)
        if self._controller_silent and self._heard > before:
            self._shell.log("the controller answers again")
            self._controller_silent = False

    def _take_all(self, stamp: int) -> None:
        for _ in range(MOST_AT_ONCE):
            data = self._command_in.take()
            if data is None:
                return
            if self._receive(data) == stamp:
                self._time_answer()

    def _receive(self, data: bytes) -> int | None:
        """Take a command that has come, if it is good; the tick it answers, if it can be read."""
        guard, source = self._guard, self._command_in.source
        try:
            self._commands.decode(data, guard.offered)
            if not (source.is_sure or np.isfinite(guard.offered.torque).all()):
                raise MessageError("a number is not finite", "not finite")
        except MessageError as error:
            guard.refuse(error.reason)
            source.doubt()
            return None
        tick = guard.offered.tick
        if self._heard < tick <= self._plant.tick:
            self._heard = tick
            source.follow()
        self._deliver()
        return tick

    def _deliver(self) -> None:
        """Hand the command in the guard's `offered` to the actuators."""
        self._guard.accept(self._plant.tick)

    def _time_answer(self) -> None:
        latency = time.perf_counter() - self._sent_at
        self._answers += 1
        self._latency_s += latency
        self._latency_max_s = max(self._latency_max_s, latency)


def make_loop(shell: Shell, settings: PlantNodeSettings) -> PlantLoop:
    """The loop that the settings ask for."""
    if any(settings.faults):
        from .faulty_plant_loop import FaultyPlantLoop

        return FaultyPlantLoop(shell, settings)
    return PlantLoop(shell, settings)


def main() -> NoReturn:
    """Entry point of plant_node."""
    run_node(PlantNodeSettings, make_loop)


if __name__ == "__main__":
    main()
