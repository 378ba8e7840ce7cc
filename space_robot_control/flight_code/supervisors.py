"""Supervisors that let the flight code in C answer, in place of the kernels or beside them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.compiled.records import Block
from space_robot_msgs_py.errors import FlightError, InputError
from space_robot_msgs_py.samples import Command, RobotState

from ..allocation.allocation import Diagnosis
from ..controller.controller import Controller
from ..controller.settings import ControllerNodeSettings
from ..controller.supervisor import Supervisor
from ..laws import ControlLaw

if TYPE_CHECKING:
    from .instances import FlightCode

Array = NDArray[np.float64]
TELEMETRY = ("s", "u", "N_hat", "e")


class ShadowError(FlightError):
    """Python and C have answered a state differently."""


class _SupervisorWithCode(Supervisor):
    def __init__(
        self, controller: Controller, settings: ControllerNodeSettings, code: FlightCode
    ) -> None:
        super().__init__(controller, settings.hold_ticks, settings.longest_jump)
        self._flight_code = code

    def use(self, law: ControlLaw) -> None:
        """Let a law, whose gains may have changed, answer from the next state on."""
        super().use(law)
        self._flight_code.use(law)

    def deactivate(self, tick: int) -> Command:
        """Return the zero-torque command that ends a flight."""
        self._flight_code.deactivate(tick)
        return super().deactivate(tick)


class CodeSupervisor(_SupervisorWithCode):
    """Supervisor whose states are answered by the flight code in C.

    Its controller only tells which law is in force.
    """

    def judge_stamp(self, tick: int) -> int:
        """Return the status of a state's stamp."""
        status = self._flight_code.judge_stamp(tick)
        self._flight_code.write_condition(self._record)
        return status

    def answer(self, state: RobotState, reference: Block) -> Command:
        """Return the command for a state."""
        self._flight_code.answer(state, reference)
        self._flight_code.write_condition(self._record)
        self._command.torque[:] = self._flight_code.command
        self._command.tick = state.tick
        return self._command

    def telemetry(self) -> tuple[Array, Array, Array, Array]:
        """Telemetry of the last tick."""
        s, u, n_hat, error = self._flight_code.telemetry
        return s, u, n_hat, error

    @property
    def diagnosis(self) -> Diagnosis:
        """Empty: the actuators' health is in the memory of the flight code."""
        return Diagnosis()


class ShadowSupervisor(_SupervisorWithCode):
    """Supervisor that compares every answer of the kernels with that of the flight code in C."""

    def judge_stamp(self, tick: int) -> int:
        """Return the status of a state's stamp, or raise a `ShadowError`."""
        status, other = super().judge_stamp(tick), self._flight_code.judge_stamp(tick)
        if status != other:
            raise ShadowError(f"at tick {tick} Python judges the stamp as {status}, C as {other}")
        return status

    def answer(self, state: RobotState, reference: Block) -> Command:
        """Return the command for a state, or raise a `ShadowError`."""
        command, code = super().answer(state, reference), self._flight_code
        names = self.controller.names
        code.answer(state, reference)
        self._compare(state.tick, "command of", names.commanded, command.torque, code.command)
        for name, python, c in zip(TELEMETRY, self.telemetry(), code.telemetry, strict=True):
            self._compare(state.tick, f"{name} of", names.axes, python, c)
        return command

    @staticmethod
    def _compare(tick: int, number: str, names: Sequence[str], python: Array, c: Array) -> None:
        different = np.flatnonzero(bits(python) != bits(c))
        if different.size:
            k = int(different[0])
            values = f"{float(python[k])!r} in Python and {float(c[k])!r} in C"
            raise ShadowError(f"at tick {tick} the {number} {names[k]} is {values}")


def bits(numbers: Array) -> NDArray[np.int64]:
    """Return the bits of numbers; all NaN are one, since processors make different ones."""
    copied: Array = np.array(numbers, dtype=np.float64)
    copied[np.isnan(copied)] = np.nan
    return copied.view(np.int64)


def make_supervisor(
    controller: Controller, laws: Iterable[ControlLaw], settings: ControllerNodeSettings
) -> Supervisor:
    """Return the supervisor that the settings ask for.

    ``laws`` are all laws that the controller may be given, that at the start first.
    """
    limits = settings.hold_ticks, settings.longest_jump
    if settings.answers_in_python:
        return Supervisor(controller, *limits)
    if settings.controller_code != "python" and settings.shadow != "none":
        raise InputError(
            f"shadow {settings.shadow} compares C with Python: it needs controller_code python, "
            f"got {settings.controller_code}"
        )
    # most flights need no translator
    from .folder import Exported
    from .instances import FlightComputer, FlightLibrary
    from .software import FlightSoftware

    exported = Exported(FlightSoftware(controller, [*laws], [], limits, {}), settings.robot)
    if settings.controller_code.startswith("udp:"):
        _, host, port = settings.controller_code.split(":")
        return CodeSupervisor(controller, settings, FlightComputer(exported, host, int(port)))
    kind = CodeSupervisor if settings.controller_code == "c" else ShadowSupervisor
    return kind(controller, settings, FlightLibrary(exported))
