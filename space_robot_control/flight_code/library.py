"""The flight code in C, compiled: states in, commands out, through its interface.

In this process it is a library, built by the system's C compiler and kept in the cache of compiled
kernels.
"""

from __future__ import annotations

import ctypes
import hashlib
import os
import shutil
import subprocess
import tempfile
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from pathlib import Path, PurePosixPath
from typing import Any

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.compiled.cache import cache_directory
from space_robot_msgs_py.compiled.records import Block, assign
from space_robot_msgs_py.errors import InputError
from space_robot_msgs_py.samples import RobotState

from ..controller.tick import STATUSES
from ..laws import ControlLaw
from .folder import FLAGS, Exported

Array = NDArray[np.float64]
CONDITION = ("reason", "mode", "answered", "last_stamp", "is_new_time", *["rejected"] * STATUSES)
"""Numbers of ``space_robot_condition``."""
COMPILERS = ("cc", "gcc", "clang")


class FlightCode(ABC):
    """The flight software in C, in this process or on a flight computer."""

    def __init__(self, exported: Exported) -> None:
        """Make the structs of its interface."""
        self._places = {law.name: place for place, law in enumerate(exported.software.laws)}
        self._measurement: NDArray[Any] = np.zeros(1, exported.measurement_type)
        self._reference: NDArray[Any] = np.zeros(1, exported.reference_type)
        self._command: NDArray[Any] = np.zeros(1, exported.command_type)
        self._condition = np.zeros(len(CONDITION))
        self._telemetry = np.zeros((4, exported.software.joints + 3))

    @abstractmethod
    def judge_stamp(self, tick: int) -> int:
        """Return the status of a state's stamp."""

    @abstractmethod
    def answer(self, state: RobotState, reference: Block) -> int:
        """Answer a state that was judged to be new; return its status."""

    @abstractmethod
    def stand_down(self, tick: int) -> None:
        """Have the flight end with the command for that."""

    @abstractmethod
    def use(self, law: ControlLaw) -> None:
        """Let a law take over if another one is in force."""

    @property
    def command(self) -> Array:
        """The command of the last answer, as `Command.torque`."""
        command: Array = self._command["command"][0]
        return command

    @property
    def telemetry(self) -> tuple[Array, Array, Array, Array]:
        """s, u, N_hat and e of the last tick, (m,) each."""
        s, u, n_hat, error = self._telemetry
        return s, u, n_hat, error

    @property
    def condition(self) -> Array:
        """The numbers of `CONDITION`."""
        return self._condition

    def write_condition(self, record: Any) -> None:
        """Write the condition into a record of `Supervision`."""
        numbers, first = self.condition, CONDITION.index("rejected")
        reason, mode, answered, last, is_new_time = numbers[:first]
        assign(record, reason=reason, mode=mode, answered=answered, rejected=numbers[first:])
        assign(record.stamps, last=last, is_new_time=is_new_time)


class FlightLibrary(FlightCode):
    """One instance of the flight software in C, in this process."""

    def __init__(self, exported: Exported, compiler: str = "") -> None:
        """Compile the software, or take it from the cache, and initialise its memory.

        Raises:
            InputError: there is no compiler, or it fails.
        """
        super().__init__(exported)
        self._library = ctypes.CDLL(str(build_library(exported.sources, compiler=compiler)))
        self._library.space_robot_state_size.restype = ctypes.c_uint64
        self._library.space_robot_gains.restype = ctypes.POINTER(ctypes.c_double)
        self._state = np.zeros(-(-self._library.space_robot_state_size() // 8))
        self._call("init")

    def _call(self, name: str, *arguments: Any) -> int:
        pointers = (
            ctypes.c_void_p(a.ctypes.data) if isinstance(a, np.ndarray) else a for a in arguments
        )
        function = getattr(self._library, f"space_robot_{name}")
        return int(function(ctypes.c_void_p(self._state.ctypes.data), *pointers) or 0)

    def judge_stamp(self, tick: int) -> int:
        """Return the status of a state's stamp."""
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

    def stand_down(self, tick: int) -> None:
        """Write the command that ends a flight."""
        self._call("stand_down", ctypes.c_int64(tick), self._command)

    def use(self, law: ControlLaw) -> None:
        """Take the gains of a law, and let it take over if another one is in force."""
        place, count = self._places[law.name], ctypes.c_int()
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
        return super().telemetry

    @property
    def condition(self) -> Array:
        """The numbers of `CONDITION`."""
        self._call("get_condition", self._condition)
        return self._condition


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


def find_compiler() -> str:
    """Return the C compiler: ``CC``, or the first of `COMPILERS` that is there.

    Raises:
        InputError: there is none.
    """
    wanted = [os.environ["CC"]] if os.environ.get("CC") else list(COMPILERS)
    for name in wanted:
        if shutil.which(name):
            return name
    raise InputError(
        f"no C compiler ({', '.join(wanted)}) was found: install gcc or clang, or set CC"
    )


def write_sources(folder: Path, sources: Mapping[PurePosixPath, str]) -> list[str]:
    """Write source files; return the paths of those to be compiled."""
    for path, text in sources.items():
        file = folder / path
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text, encoding="utf-8")
    return [str(folder / path) for path in sorted(sources) if path.suffix == ".c"]


def build_library(
    sources: Mapping[PurePosixPath, str], flags: Sequence[str] = FLAGS, compiler: str = ""
) -> Path:
    """Return a shared library of sources, from the cache if it is there.

    Raises:
        InputError: there is no compiler, or it fails.
    """
    compiler = compiler or find_compiler()
    command = [compiler, *flags, "-shared", "-fPIC"]
    version = subprocess.run([compiler, "--version"], capture_output=True, check=False).stdout
    digest = hashlib.sha256(version + repr(command).encode())
    for path, text in sorted(sources.items()):
        digest.update(f"{path}\0{text}\0".encode())
    library = cache_directory() / f"flight_{digest.hexdigest()[:24]}.so"
    if library.exists():
        return library
    with tempfile.TemporaryDirectory(prefix="space_robot_") as name:
        folder = Path(name)
        files = write_sources(folder, sources)
        built = folder / "library.so"
        includes = [f"-I{folder / 'include'}", f"-I{folder}"]
        run = subprocess.run(
            [*command, *includes, "-o", str(built), *files, "-lm"],
            capture_output=True,
            text=True,
            check=False,
        )
        if run.returncode:
            reason = next((line for line in run.stderr.splitlines() if "error" in line), run.stderr)
            raise InputError(f"{compiler} cannot compile the flight code: {reason.strip()}")
        shutil.move(built, temporary := library.with_suffix(f".{os.getpid()}"))
        os.replace(temporary, library)
    return library
