"""The compiled flight code in this process: states in, commands out, through its interface."""

from __future__ import annotations

import ctypes
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.compiled.records import Block
from space_robot_msgs_py.samples import Reference, RobotState, State

from ..controller.tick import STATUSES
from ..laws import ControlLaw
from .compiler import build_library
from .folder import Exported

Array = NDArray[np.float64]
CONDITION = ("reason", "mode", "answered", "last_stamp", "is_new_time", *["rejected"] * STATUSES)
"""Numbers of ``space_robot_condition``."""


class FlightLibrary:
    """One instance of the flight software in C."""

    def __init__(self, exported: Exported, compiler: str = "") -> None:
        """Compile the software, or take it from the cache, and initialise its memory.

        Raises:
            InputError: there is no compiler, or it fails.
        """
        self._library = ctypes.CDLL(str(build_library(exported.sources, compiler=compiler)))
        self._library.space_robot_state_size.restype = ctypes.c_uint64
        self._library.space_robot_gains.restype = ctypes.POINTER(ctypes.c_double)
        self._state = np.zeros(-(-self._library.space_robot_state_size() // 8))
        translated = exported.translated
        self._measurement, self._command = measurement_of(exported), command_of(exported)
        self._reference = np.zeros(1, translated.dtype(Reference))
        self._laws = [law.name for law in exported.software.laws]
        self._axes = exported.software.joints + 3
        self._telemetry = np.zeros((4, self._axes))
        self._condition = np.zeros(len(CONDITION))
        self._call("init")

    def _call(self, name: str, *arguments: Any) -> int:
        pointers = (
            ctypes.c_void_p(a.ctypes.data) if isinstance(a, np.ndarray) else a for a in arguments
        )
        function = getattr(self._library, f"space_robot_{name}")
        return int(function(ctypes.c_void_p(self._state.ctypes.data), *pointers) or 0)

    def judge_stamp(self, tick: int) -> int:
        """Return the standing of a state by its stamp."""
        return self._call("judge", ctypes.c_int64(tick))

    def answer(self, state: RobotState, reference: Block) -> int:
        """Answer a state that was judged to be new; return its status."""
        return self._with(state, reference, "answer")

    def step(self, state: RobotState, reference: Block) -> int:
        """Judge and answer a state; return its status, or -1 if it is refused."""
        return self._with(state, reference, "step")

    def _with(self, state: RobotState, reference: Block, function: str) -> int:
        fill_measurement(self._measurement, state)
        fill_reference(self._reference, reference)
        return self._call(function, self._measurement, self._reference, self._command)

    @cached_property
    def command(self) -> Array:
        """The command of the last answer, as `Command.torque`."""
        command: Array = self._command["command"][0]
        return command

    def stand_down(self, tick: int) -> None:
        """Write the command that ends a flight."""
        self._call("stand_down", ctypes.c_int64(tick), self._command)

    def use(self, law: ControlLaw) -> None:
        """Take the gains of a law, and let it take over if another one is in force."""
        place, count = self._laws.index(law.name), ctypes.c_int()
        gains = self._library.space_robot_gains(
            ctypes.c_void_p(self._state.ctypes.data), place, ctypes.byref(count)
        )
        numbers = np.concatenate([*law.gain_values.values(), np.zeros(0)])
        assert count.value == len(numbers)
        for k, number in enumerate(numbers):
            gains[k] = number
        self._call("choose_law", place)

    @property
    def telemetry(self) -> tuple[Array, Array, Array, Array]:
        """s, u, N_hat and e of the last tick, (m,) each."""
        self._call("get_telemetry", self._telemetry)
        s, u, n_hat, error = self._telemetry
        return s, u, n_hat, error

    @property
    def condition(self) -> Array:
        """The numbers of `CONDITION`."""
        self._call("get_condition", self._condition)
        return self._condition


def measurement_of(exported: Exported) -> NDArray[Any]:
    """Return an empty ``space_robot_measurement``."""
    return np.zeros(1, [("tick", np.int64), ("state", exported.translated.dtype(State))])


def command_of(exported: Exported) -> NDArray[Any]:
    """Return an empty ``space_robot_command``."""
    count = len(exported.software.controller.names.commanded)
    return np.zeros(1, [("tick", np.int64), ("command", np.float64, (count,))])


def fill_reference(wanted: NDArray[Any], reference: Block) -> None:
    """Write a reference into a ``space_robot_reference``."""
    for name in wanted.dtype.names or ():
        wanted[name] = reference[name]


def fill_measurement(measurement: NDArray[Any], state: RobotState) -> None:
    """Write a state into a ``space_robot_measurement``."""
    measurement["tick"] = state.tick
    inside = measurement["state"]
    for name in inside.dtype.names or ():
        field = inside[name]
        field[0] = getattr(state, name)[: field.shape[1]]
