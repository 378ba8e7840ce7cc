"""Safe mode of the controller while its inputs are bad, and its recovery.

    nominal --bad state--> holding --hold_ticks of them--> safe --good state--> nominal
    nominal --attitude near 180 degrees--> safe

Holding repeats the last good torque, but closes the valves of thrusters: how long a pulse is to be
is not known there. Safe commands none. Coming back, the law takes over from the
applied force (`Controller.engage`).
"""

from __future__ import annotations

from collections import Counter
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from space_robot_model.elementary.matrices import norm
from space_robot_msgs_py.compiled.records import Block
from space_robot_msgs_py.errors import SingularAttitudeError, UnusableStateError
from space_robot_msgs_py.samples import Command, RobotState

from .controller import Controller
from .kernels import NORM_TOLERANCE
from .time_delay_estimation import LONGEST_GAP

Array = NDArray[np.float64]

SAFE_BELOW_ETA = 0.02
"""|eta| below which the mode is safe, since the torques grow without bound: 177.7 degrees."""
NOMINAL_FROM_ETA = 0.05
"""|eta| from which it is nominal again: 174.3 degrees."""


class Mode(Enum):
    """Mode of the controller's commands."""

    NOMINAL = "nominal"
    HOLDING = "holding"
    SAFE = "safe"


class Supervisor:
    """Supervisor that answers every state, with the controller's command if it is safe."""

    def __init__(self, controller: Controller, axes: int, hold_ticks: int) -> None:
        self.controller = controller
        self.mode = Mode.NOMINAL
        self.reason = ""
        """Reason why the mode is not nominal."""
        self.rejected: Counter[str] = Counter()
        """States not used, by reason."""
        self._hold_ticks = hold_ticks
        self._command = Command(-1, np.zeros(axes))
        self._last_tick = -1
        self._held_since = 0

    def answer(self, state: RobotState, reference: Block) -> Command:
        """Return the command for a state, from the law or safe; see `Controller.update`."""
        controller = self.controller
        if self.mode is Mode.SAFE or not 0 < state.tick - self._last_tick <= LONGEST_GAP:
            controller.engage()
        try:
            eta = abs(state.quaternion[0])
            least = NOMINAL_FROM_ETA if self.mode is Mode.SAFE else SAFE_BELOW_ETA
            if eta < least and _is_unit(state.quaternion):
                raise SingularAttitudeError(state.tick, float(state.quaternion[0]))
            self._command = controller.update(state, reference)
        except UnusableStateError as error:
            return self._safe_command(error)
        self._last_tick = state.tick
        self.mode, self.reason = Mode.NOMINAL, ""
        return self._command

    def deactivate(self, tick: int) -> Command:
        """Return the zero-torque command that ends a flight."""
        self._command = Command(tick, np.zeros_like(self._command.torque))
        self._last_tick = -1
        return self._command

    def _safe_command(self, error: UnusableStateError) -> Command:
        self.rejected[error.kind] += 1
        self.reason = error.kind
        if self.mode is Mode.NOMINAL:
            self.mode, self._held_since = Mode.HOLDING, error.tick
            self._command = Command(error.tick, self._command.torque.copy())
            self._command.torque[self.controller.valves] = 0.0
        self._command.tick = error.tick
        is_singular = isinstance(error, SingularAttitudeError)
        if is_singular or not 0 <= error.tick - self._held_since < self._hold_ticks:
            self.mode = Mode.SAFE
            self._command.torque[:] = 0.0
        return self._command


def _is_unit(quaternion: Array) -> bool:
    """Return True if the quaternion is close enough to unit norm."""
    length = norm(quaternion)
    return abs(length * length - 1.0) <= NORM_TOLERANCE
