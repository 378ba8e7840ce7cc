"""controller_node: answers every state with a command, under a law that can be swapped live."""

from __future__ import annotations

from typing import Any, ClassVar, NoReturn

import numpy as np
from rcl_interfaces.msg import ParameterDescriptor, SetParametersResult

from space_robot_msgs_py import topics
from space_robot_msgs_py.codecs import CommandCodec, StateCodec, TelemetryCodec
from space_robot_msgs_py.configuration import named_file, nest
from space_robot_msgs_py.errors import InputError, SpaceRobotError
from space_robot_msgs_py.reference_codec import ReferenceCodec
from space_robot_msgs_py.ros.endpoints import SPIN_S, In, Out, TakenByLoop, Waiter, take_or_wait
from space_robot_msgs_py.ros.parameters import overrides
from space_robot_msgs_py.ros.shell import Shell, run_node
from space_robot_msgs_py.samples import RobotState
from space_robot_sim.robot import Robot

from .controller import Controller
from .laws import ControlLaw, find_law
from .reference import ReferenceBuffer
from .settings import ControllerNodeSettings, available_laws, build_law, check_gains


class Laws:
    """The laws of the gain set as parameters: ``law``, and ``<law>.<gain>`` for each."""

    def __init__(self, shell: Shell, settings: ControllerNodeSettings, axes: int) -> None:
        self._settings, self._axes = settings, axes
        self._laws: dict[str, ControlLaw] = {}
        names = dict.fromkeys([find_law(settings.law).name, *available_laws(settings)])
        for name in names:
            wanted = settings.law if name == find_law(settings.law).name else name
            law = build_law(wanted, settings, axes)
            given = overrides(shell.node, [f"{name}.{gain}" for gain in law.gain_descriptions])
            tree = {**law.gains, **nest(given).get(name, {})}
            law.gains = check_gains(tree, type(law), axes, "controller parameters")
            for gain, description in law.gain_descriptions.items():
                shell.node.declare_parameter(
                    f"{name}.{gain}", law.gains[gain].tolist(),
                    ParameterDescriptor(description=description), ignore_override=True,
                )  # fmt: skip
            self._laws[name] = law
        self.chosen = self._laws[find_law(settings.law).name]
        self._shell = shell
        shell.node.add_on_set_parameters_callback(self._on_set)

    def warm_up(self, robot: Robot) -> None:
        """Load every law's compiled code, so that no first tick and no swap comes late."""
        rest = RobotState.allocate(robot.n)
        for law in self._laws.values():
            controller = Controller(robot, law, self._settings.period)
            controller.update(rest, np.zeros((3, robot.n)), np.eye(10)[0])

    def _on_set(self, parameters: list[Any]) -> SetParametersResult:
        """Check all changes first, then make them; the loop sees them at its next tick."""
        gains = {name: dict(law.gains) for name, law in self._laws.items()}
        chosen = self.chosen
        try:
            for parameter in parameters:
                law_name, _, gain = parameter.name.partition(".")
                if parameter.name == "law":
                    if parameter.value not in self._laws:
                        raise InputError(
                            f"law {parameter.value!r}: choose one of {', '.join(self._laws)}"
                        )
                    chosen = self._laws[parameter.value]
                elif law_name in gains and gain:
                    law = self._laws[law_name]
                    changed = {**gains[law_name], gain: list(parameter.value)}
                    gains[law_name] = check_gains(changed, type(law), self._axes, "parameter")
        except SpaceRobotError as error:
            return SetParametersResult(successful=False, reason=str(error))
        for name, law in self._laws.items():
            law.gains = gains[name]
        if chosen is not self.chosen:
            self._shell.log(f"law {self.chosen.name} -> {chosen.name}")
        self.chosen = chosen
        return SetParametersResult(successful=True)


class ControllerLoop:
    """Takes the newest state, waits for its reference, answers; never answers a tick anew."""

    controller_class: ClassVar[type[Controller]] = Controller

    def __init__(self, shell: Shell, settings: ControllerNodeSettings) -> None:
        self._shell, self._settings = shell, settings
        robot = Robot.from_yaml(named_file("robots", settings.robot))
        self._laws = Laws(shell, settings, robot.n + 3)
        self._laws.warm_up(robot)
        self._controller = self.controller_class(robot, self._laws.chosen, settings.period)
        self._references = ReferenceBuffer(robot.n)
        timebase = settings.timebase
        self._states = StateCodec(robot.joint_names, timebase)
        self._commands = CommandCodec(robot.axis_names, timebase)
        self._reference_codec = ReferenceCodec(robot.joint_names, timebase)
        self._telemetry = TelemetryCodec(robot.axis_names)
        self._state = RobotState.allocate(robot.n)
        node, group = shell.node, TakenByLoop()
        self._command_out = Out(node, topics.COMMAND)
        self._telemetry_out = Out(node, topics.TELEMETRY)
        self._joints_in = In(node, topics.JOINT_STATES, group)
        self._base_in = In(node, topics.BASE_STATE, group)
        self._reference_joints_in = In(node, topics.REFERENCE_JOINTS, group)
        self._reference_base_in = In(node, topics.REFERENCE_BASE, group)
        spin_s = 0.0 if settings.fifo_priority else SPIN_S
        self._base_waiter = Waiter(node, self._base_in, spin_s=spin_s)
        self._joints_waiter = Waiter(node, self._joints_in, spin_s=spin_s)
        self._reference_waiter = Waiter(node, self._reference_joints_in, self._reference_base_in)
        self._answered, self._answer = -1, b""

    def run(self) -> None:
        """Answer states until told to stop."""
        shell = self._shell
        outputs = (self._command_out, self._telemetry_out)
        shell.wait_for_listeners(outputs, self._settings.wait_for)
        while not shell.stopping:
            tick = self._take_state()
            if tick is None:
                self._take_references()  # ahead of need
            elif self._have_reference(tick):
                self._answer_tick(tick)
            shell.serve()
        for output in outputs:
            output.flush(1.0)

    def _answer_tick(self, tick: int) -> None:
        if tick == self._answered:  # the plant asked again: the same answer
            self._command_out.publish(self._answer)
            return
        controller = self._controller
        if controller.law is not self._laws.chosen:
            controller.law = self._laws.chosen
        self._state.tick = tick
        command = controller.update(self._state, *self._references.at(tick))
        self._answer = self._commands.encode(command)
        self._command_out.publish(self._answer)
        self._answered = tick
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
        tick = self._states.decode_joints(data, self._state)
        base_tick = -1
        while base_tick < tick and not self._shell.stopping:
            data = take_or_wait(self._base_in, self._base_waiter, 0.02)
            if data is None:
                return None
            base_tick = self._states.decode_base(data, self._state)
        return tick if base_tick == tick else None

    def _have_reference(self, tick: int) -> bool:
        """Wait until the reference of ``tick`` is there; False if told to stop."""
        while not self._references.covers(tick):
            if not self._take_references():
                self._reference_waiter.wait(0.02)
                self._shell.serve()
            if self._shell.stopping:
                return False
        return True

    def _take_references(self) -> bool:
        joints, base = self._reference_joints_in.take(), self._reference_base_in.take()
        if joints is not None:
            self._references.add_joints(*self._reference_codec.decode_joints(joints))
        if base is not None:
            self._references.add_base(*self._reference_codec.decode_base(base))
        return joints is not None or base is not None


def main() -> NoReturn:
    """Entry point of controller_node."""
    run_node(ControllerNodeSettings, ControllerLoop, changeable=("law",))


if __name__ == "__main__":
    main()
