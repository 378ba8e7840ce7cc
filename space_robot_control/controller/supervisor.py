"""Safe mode of the controller while its inputs are bad, and its recovery.

    nominal --bad state--> holding --hold_ticks of them--> safe --good state--> nominal
    nominal --attitude error near 180 degrees--> safe

A reference that is not finite or too large is held at the last good one, in nominal mode.
Holding repeats the last good torque, but closes the valves of thrusters: how long a pulse is to be
is not known there. Safe commands none. Coming back, the law takes over from the
applied force (`Controller.engage`). All of it happens in the kernels of `.supervision`.
"""

from __future__ import annotations

from collections import Counter
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.compiled.records import Block, assign
from space_robot_msgs_py.samples import Command, RobotState

from ..allocation.diagnosis import Diagnosis
from ..laws import ControlLaw
from ..laws.base import CompiledLaw, LawCode, force_of
from .controller import Controller, unusable
from .signal_kernels import SINGULAR, USABLE
from .supervision import (
    Supervision,
    admit_state,
    answer_state,
    conclude,
    is_for_law,
    judge,
    takes_over,
)

Array = NDArray[np.float64]


class Mode(Enum):
    """Mode of the controller's commands."""

    NOMINAL = "nominal"
    HOLDING = "holding"
    SAFE = "safe"


MODES = tuple(Mode)
KINDS = (
    *(unusable(status, 0, np.zeros(4)).kind for status in range(SINGULAR + 1)),
    "reference held",
    "no reference",
)
"""What is wrong with a state or its reference, in a word or two, by its status."""


class Supervisor:
    """Supervisor that answers every state, with the controller's command if it is safe."""

    def __init__(self, controller: Controller, hold_ticks: int, longest_jump: int = 2000) -> None:
        """Supervise a controller.

        Args:
            controller: which computes the commands.
            hold_ticks: invalid states for which the last torque is held.
            longest_jump: largest number of ticks from one state to the next.
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
        self._last: Array = stamps["last"]  # read at every tick: faster than from a record
        self._is_new_time: Array = stamps["is_new_time"]
        self._command = Command(-1, self._record.command[: len(controller.names.commanded)])
        self._law: CompiledLaw | None = None
        self._code: LawCode

    @property
    def mode(self) -> Mode:
        """Mode of the last answer."""
        return MODES[int(self._record.mode)]

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

    def judge(self, tick: int) -> int:
        """Return the standing of a state by its stamp, see `.supervision.judge`."""
        return judge(self.block, tick)

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
            answer_state(
                self.block, controller.block, self._code_of(law), controller.allocate, *inputs
            )
        else:
            block, estimate, has_model = controller.block, law.estimate, law.needs_model
            status = admit_state(self.block, block, law.h_bar, estimate, has_model, *inputs)
            if is_for_law(status):
                force = force_of(law, controller.signals, tick)
                command.torque[:] = controller.command_for(tick, force).torque
            conclude(self.block, tick, status)
        command.tick = tick
        return command

    def use(self, law: ControlLaw) -> None:
        """Let a law, whose gains may have changed, answer from the next state on."""
        if self.controller.law is not law:
            self.controller.law = law

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

    def _code_of(self, law: CompiledLaw) -> LawCode:
        if self._law is not law:
            self._law, self._code = law, law.code
        return self._code
