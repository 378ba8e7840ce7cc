"""Decision whether a received state is answered, and the answer."""

from __future__ import annotations

from collections.abc import Iterator
from enum import Enum

from space_robot_msgs_py import topics
from space_robot_msgs_py.bag.law_history import LawChange
from space_robot_msgs_py.compiled.records import Block
from space_robot_msgs_py.samples import Command, RobotState
from space_robot_msgs_py.wire.codecs import CommandCodec
from space_robot_msgs_py.wire.telemetry import NODE, LawCodec, SignalsCodec, TelemetryCodec

from .controller import Controller
from .law_choice import LawChoice
from .reference_buffer import ReferenceBuffer
from .settings import ControllerNodeSettings
from .supervision import ANSWERED, NEW, REFUSED
from .supervisor import Supervisor


class StampStatus(Enum):
    """Status of a received state by its stamp."""

    ANSWERED = ANSWERED
    """The state was answered last; the plant repeats its request."""
    NEW = NEW
    """The state is to be answered."""
    REFUSED = REFUSED
    """The stamp of the state is not plausible."""


class StateResponder:
    """Answers each state once with the messages of the controller. Independent of ROS."""

    def __init__(
        self,
        controller: Controller,
        laws: LawChoice,
        references: ReferenceBuffer,
        settings: ControllerNodeSettings,
        node: str = NODE,
        supervisor: Supervisor | None = None,
    ) -> None:
        """Answer with ``controller`` under the laws chosen, as the node's settings say.

        ``references`` receive the current tick; ``node`` is the node's full name; ``supervisor``
        answers in place of one made here.
        """
        self._laws, self._references = laws, references
        names = controller.names
        self.supervisor = supervisor or Supervisor(
            controller, settings.hold_ticks, settings.longest_jump
        )
        self._commands = CommandCodec(names.commanded, settings.timebase)
        self._telemetry = TelemetryCodec(names.axes)
        self._signals = SignalsCodec(names.axes, settings.timebase)
        self._law = LawCodec(settings.timebase, node)
        self._telemetry_decimation = settings.telemetry_decimation
        self.answer = b""
        """Command for that tick, as it was sent."""
        self.change: LawChange | None = None
        """The change of law or gains that came with it, if any."""

    def judge(self, tick: int) -> StampStatus:
        """Return the status of a received state of ``tick``."""
        supervisor = self.supervisor
        last = supervisor.last_stamp
        standing = StampStatus(supervisor.judge(tick))
        if standing is StampStatus.NEW and tick != last:
            if supervisor.is_new_time:
                self._references.begin(tick)
            self._references.now = tick
        return standing

    def messages(
        self, tick: int, state: RobotState, reference: Block
    ) -> Iterator[tuple[topics.Topic, bytes]]:
        """Answer a state that is `StampStatus.NEW`; the messages to send, each to be sent at once.

        The command goes out before the telemetry is written.
        """
        laws = self._laws
        self.change = laws.change_at(tick)
        if self.change:
            yield topics.LAW, self._law.encode(self.change.law)
            self.supervisor.use(laws.chosen)
        state.tick = tick
        self.answer = self.encode(self.supervisor.answer(state, reference))
        yield topics.COMMAND, self.answer
        if tick % self._telemetry_decimation == 0:
            s, u, n_hat, e = self.supervisor.telemetry()
            yield topics.TELEMETRY, self._telemetry.encode(tick, (s, u, n_hat, e))
            yield topics.SIGNALS, self._signals.encode(tick, e, s, n_hat)

    def encode(self, command: Command) -> bytes:
        """Encode a command as a message."""
        return self._commands.encode(command)
