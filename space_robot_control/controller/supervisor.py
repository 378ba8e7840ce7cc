"""Answers to received states, with a safe mode while inputs are bad, and recovery from it.

    nominal --bad state--> holding --hold_ticks of them--> safe --good state--> nominal
    nominal --attitude error near 180 degrees--> safe

A reference that is not finite or too large is held at the last good one, in nominal mode.
Holding repeats the last good torque, but closes the valves of thrusters: how long a pulse is to be
is not known there. Safe commands none. Coming back, the law takes over from the
applied force (`Controller.engage`). All of it happens in the kernels of `tick`.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py import topics
from space_robot_msgs_py.bag.law_history import LawChange
from space_robot_msgs_py.compiled.records import Block, assign
from space_robot_msgs_py.samples import Command, LawInForce, RobotState
from space_robot_msgs_py.wire.codecs import CommandCodec
from space_robot_msgs_py.wire.telemetry import NODE, LawCodec, SignalsCodec, TelemetryCodec

from ..allocation.allocation import Diagnosis
from ..laws import ControlLaw
from ..laws.base import CompiledLaw, LawCode, force_of
from .controller import STATUS_WORDS, Controller
from .law_choice import LawChoice
from .reference_buffer import ReferenceBuffer
from .settings import ControllerNodeSettings
from .signals import USABLE
from .tick import (
    NEW,
    Supervision,
    admit_state,
    answer_state,
    conclude,
    is_for_law,
    judge_stamp,
    takes_over,
)

Array = NDArray[np.float64]


KINDS = (*STATUS_WORDS, "reference held", "no reference")
"""What is wrong with a state or its reference, in a word or two, by its status."""


class Supervisor:
    """Supervisor that answers every state, with the controller's command if it is safe."""

    def __init__(self, controller: Controller, hold_ticks: int, longest_jump: int = 2000) -> None:
        """Supervise a controller.

        ``hold_ticks``: invalid states for which the last torque is held; ``longest_jump``: largest
        number of ticks from one state to the next.
        """
        self.controller = controller
        self.block = Supervision.block(len(controller.names.joints))
        """The `Supervision`."""
        self._record: Supervision = self.block[0]
        assign(
            self._record,
            hold_ticks=hold_ticks,
            first_valve=controller.valves.start,
            answered=-1.0,
            last_tick=-1.0,
        )
        assign(self._record.stamps, longest_jump=longest_jump, last=-1.0, other=-1.0)
        stamps = self.block["stamps"]
        self._mode: Array = self.block["mode"]
        self._last: Array = stamps["last"]  # read at every tick: faster than from a record
        self._is_new_time: Array = stamps["is_new_time"]
        self._command = Command(-1, self._record.command[: len(controller.names.commanded)])
        self._law: CompiledLaw | None = None
        self._code: LawCode

    @property
    def mode(self) -> int:
        """Mode of the last answer, one of `MODES` by number."""
        return int(self._mode[0])

    @property
    def reason(self) -> str:
        """Reason why the mode is not nominal, or the reference held."""
        return "" if self._record.reason == USABLE else KINDS[int(self._record.reason)]

    @property
    def rejected(self) -> Counter[str]:
        """States not used, or whose reference was not, by reason."""
        counts = zip(KINDS, self._record.rejected, strict=True)
        return Counter({kind: int(count) for kind, count in counts if count})

    @property
    def answered(self) -> int:
        """Last tick answered; -1: none."""
        return int(self._record.answered)

    @property
    def last_stamp(self) -> int:
        """Last tick whose stamp was plausible; -1: none."""
        return int(self._last[0])

    @property
    def is_new_time(self) -> bool:
        """True if that tick started a new time."""
        return bool(self._is_new_time[0])

    def judge_stamp(self, tick: int) -> int:
        """Return `ANSWERED`, `NEW` or `REFUSED` for a state of ``tick``."""
        return judge_stamp(self.block, tick)

    def answer(self, state: RobotState, reference: Block) -> Command:
        """Return the command for a state, from the law or safe; see `Controller.update`.

        Raises:
            LawError: the code of the law failed.
        """
        controller, tick, command = self.controller, state.tick, self._command
        law = controller.law
        if takes_over(self.block, tick):
            controller.engage()
        inputs = tick, state.block, reference, controller.period
        if isinstance(law, CompiledLaw):
            if self._law is not law:
                self._law, self._code = law, law.code
            answer_state(self.block, controller.block, self._code, controller.allocate, *inputs)
        else:
            block, (h_bar, estimate, needs_model) = controller.block, law.needs
            status = admit_state(self.block, block, h_bar, estimate, needs_model, *inputs)
            if is_for_law(status):
                force = force_of(law, controller.signals, tick)
                command.torque[:] = controller.command_for(tick, force).torque
            conclude(self.block, tick, status)
        command.tick = tick
        return command

    def use(self, law: ControlLaw) -> None:
        """Let a law, whose gains may have changed, answer from the next state on."""
        self.controller.use(law)

    def telemetry(self) -> tuple[Array, Array, Array, Array]:
        """Telemetry of the last tick, see `Controller.telemetry`."""
        return self.controller.telemetry()

    @property
    def diagnosis(self) -> Diagnosis:
        """Diagnosis of the base's actuators."""
        return self.controller.allocation

    def deactivate(self, tick: int) -> Command:
        """Return the zero-torque command that ends a flight."""
        self._command.torque[:] = 0.0
        self._command.tick = tick
        assign(self._record, last_tick=-1.0)
        return self._command


Report = Callable[[RobotState, Block, Supervisor, Array, LawInForce | None], None]
"""Receiver of a state, its reference, what answered, the answer, and the law if it changed."""


class StateResponder:
    """Answers each state once with the messages of the controller. Independent of ROS."""

    def __init__(
        self,
        supervisor: Supervisor,
        laws: LawChoice,
        references: ReferenceBuffer,
        settings: ControllerNodeSettings,
        node: str = NODE,
        report: Report | None = None,
    ) -> None:
        """Answer with ``supervisor`` under the laws chosen, as the node's settings say.

        ``references`` receive the current tick; ``node`` is the node's full name; ``report`` gets
        what a tick's answer was computed from.
        """
        self.supervisor, self._laws, self._references = supervisor, laws, references
        names = supervisor.controller.names
        self._commands = CommandCodec(names.commanded, settings.timebase)
        self._telemetry = TelemetryCodec(names.axes)
        self._signals = SignalsCodec(names.axes, settings.timebase)
        self._law = LawCodec(settings.timebase, node)
        self._telemetry_decimation = settings.telemetry_decimation
        self._report = report
        self.answer = b""
        """The last command, as it was sent."""
        self.change: LawChange | None = None
        """The change of law or gains that came with it, if any."""

    def judge_stamp(self, tick: int) -> int:
        """Return `ANSWERED`, `NEW` or `REFUSED` for a received state of ``tick``.

        An answered state was answered last: the plant repeats its request. The stamp of a refused
        one is not plausible.
        """
        supervisor = self.supervisor
        last = supervisor.last_stamp
        status = supervisor.judge_stamp(tick)
        if status == NEW and tick != last:
            if supervisor.is_new_time:
                self._references.begin(tick)
            self._references.now = tick
        return status

    def messages(
        self, tick: int, state: RobotState, reference: Block
    ) -> Iterator[tuple[topics.Topic, bytes]]:
        """Answer a state that is `NEW`; the messages to send, each to be sent at once.

        The command goes out before the telemetry is written.
        """
        laws = self._laws
        self.change = laws.change_at(tick)
        if self.change:
            yield topics.LAW, self._law.encode(self.change.law)
            self.supervisor.use(laws.chosen)
        state.tick = tick
        command = self.supervisor.answer(state, reference)
        self.answer = self.encode(command)
        yield topics.COMMAND, self.answer
        if self._report:
            law = self.change.law if self.change else None
            self._report(state, reference, self.supervisor, command.torque, law)
        if tick % self._telemetry_decimation == 0:
            s, u, n_hat, e = self.supervisor.telemetry()
            yield topics.TELEMETRY, self._telemetry.encode(tick, (s, u, n_hat, e))
            yield topics.SIGNALS, self._signals.encode(tick, e, s, n_hat)

    def encode(self, command: Command) -> bytes:
        """Encode a command as a message."""
        return self._commands.encode(command)
