"""plant_node: steps the plant against the commands of the graph."""

from __future__ import annotations

import time
from typing import ClassVar, NoReturn

import numpy as np

from space_robot_msgs_py import topics
from space_robot_msgs_py.codecs import ClockCodec, CommandCodec, StateCodec
from space_robot_msgs_py.configuration import named_file
from space_robot_msgs_py.ros.endpoints import SPIN_S, In, Out, TakenByLoop, Waiter, take_or_wait
from space_robot_msgs_py.ros.shell import Shell, run_node
from space_robot_msgs_py.samples import Command

from .plant import Plant
from .plant_settings import PlantNodeSettings
from .robot import Robot

ASK_AGAIN_S = 0.5
"""Without an answer for this long the state is sent again (lockstep)."""
SPIN_BEFORE_DEADLINE_S = 100e-6
GIVE_WAY_S = 100e-6
SLIP_S = 0.25
"""Further behind the wall clock than this, the plant gives up catching up."""
FLUSH_S = 5.0


class PlantLoop:
    """Sends the state of a tick, waits for its command, steps; paced by the graph or the clock."""

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
        self._command = Command(-1, self._plant.state.applied_torque.copy())
        node = shell.node
        self._joint_states = Out(node, topics.JOINT_STATES)
        self._base_state = Out(node, topics.BASE_STATE)
        self._clock_out = Out(node, topics.CLOCK)
        self._command_in = In(node, topics.COMMAND, TakenByLoop())
        spin_s = 0.0 if settings.fifo_priority else SPIN_S
        self._waiter = Waiter(node, self._command_in, spin_s=spin_s)
        self._outputs = (self._joint_states, self._base_state, self._clock_out)
        self.late_ticks = 0
        """Ticks by the wall clock that were not answered before their end."""
        self.slipped_s = 0.0
        """How far the wall clock has run ahead for good."""

    def run(self) -> None:
        """Fly until the last tick, or until told to stop."""
        shell, settings, plant = self._shell, self._settings, self._plant
        shell.wait_for_listeners(self._outputs, settings.wait_for)
        begin = time.monotonic()
        while not shell.stopping and (not settings.ticks or plant.tick < settings.ticks):
            self._send()
            if settings.realtime and plant.tick > 0:
                answered = self._answer_by_the_clock(begin)
            else:
                answered = self._answer_in_lockstep()
            if not answered:
                break
            if plant.tick == 0:  # the clock starts when the loop is closed
                begin = time.monotonic() - settings.period
            elif settings.realtime:
                begin += self._slip(begin)
            plant.step(self._command)
            shell.serve()
        elapsed = time.monotonic() - begin
        for output in self._outputs:
            output.flush(FLUSH_S)
        flown = plant.tick * settings.period
        late = ""
        if settings.realtime:
            late = f", {self.late_ticks} ticks without an answer in time"
            late += f", {self.slipped_s:.3f} s behind the wall clock" if self.slipped_s else ""
        shell.log(f"flew {flown:.4f} s in {elapsed:.2f} s{late}")

    def _send(self) -> None:
        tick = self._plant.tick
        joints, base = self._states.encode(self._plant.state)
        self._joint_states.publish(joints)
        self._base_state.publish(base)
        if tick % self._settings.clock_decimation == 0:
            self._clock_out.publish(self._clock.encode(self._timebase.stamp_ns(tick)))

    def _answer_in_lockstep(self) -> bool:
        """Wait for the command that answers this tick; False if told to stop."""
        tick, command = self._plant.tick, self._command
        ask_again = time.monotonic() + ASK_AGAIN_S
        while True:
            data = take_or_wait(self._command_in, self._waiter, 0.02)
            if data is not None:
                self._commands.decode(data, command)
                if command.tick == tick:
                    return True
                continue
            if self._shell.stopping:
                return False
            if time.monotonic() > ask_again:
                ask_again = time.monotonic() + ASK_AGAIN_S
                self._send()
            self._shell.serve()

    def _answer_by_the_clock(self, begin: float) -> bool:
        """Take what comes until the tick is over; an unanswered tick keeps the last command."""
        tick, command = self._plant.tick, self._command
        deadline = begin + (tick + 1) * self._settings.period
        if time.monotonic() >= deadline:  # behind: catch up, but never take the whole processor
            time.sleep(GIVE_WAY_S)
        while (left := deadline - time.monotonic()) > 0.0:
            if left > SPIN_BEFORE_DEADLINE_S and command.tick != tick:
                self._waiter.wait(left - SPIN_BEFORE_DEADLINE_S)
            elif left > SPIN_BEFORE_DEADLINE_S:
                time.sleep(left - SPIN_BEFORE_DEADLINE_S)
            self._take_newest()
        self._take_newest()
        self.late_ticks += command.tick != tick
        return not self._shell.stopping

    def _slip(self, begin: float) -> float:
        """By how much to set the clock back, s: 0 unless the plant is hopelessly behind it."""
        behind = time.monotonic() - begin - (self._plant.tick + 1) * self._settings.period
        if behind < SLIP_S:
            return 0.0
        self.slipped_s += behind
        self._shell.log(f"{behind:.3f} s behind the wall clock: time goes on from here")
        return behind

    def _take_newest(self) -> None:
        while (data := self._command_in.take()) is not None:
            self._commands.decode(data, self._command)


def main() -> NoReturn:
    """Entry point of plant_node."""
    run_node(PlantNodeSettings, PlantLoop)


if __name__ == "__main__":
    main()
