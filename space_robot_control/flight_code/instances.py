"""The flight code in C, running: as a library in this process, or on a flight computer.

The library is built by the system's C compiler and kept in the cache of compiled kernels. A flight
computer is a program that answers by UDP, one datagram for each request and each answer:
examples/flight_computer has the other side.
"""

from __future__ import annotations

import ctypes
import hashlib
import os
import shutil
import socket
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
from space_robot_msgs_py.errors import FlightError, InputError
from space_robot_msgs_py.samples import RobotState

from ..controller.tick import STATUSES
from ..laws import ControlLaw
from .folder import FLAGS, Exported

Array = NDArray[np.float64]
CONDITION = ("reason", "mode", "answered", "last_stamp", "is_new_time", *["rejected"] * STATUSES)
"""Numbers of ``space_robot_condition``."""
COMPILERS = ("cc", "gcc", "clang")
TIMEOUT_S = 2.0
"""Longest wait for a flight computer's answer, s of the wall clock."""
LARGEST = 65_507
"""Bytes of a datagram at most."""
BEGIN, JUDGE, ANSWER, USE, DEACTIVATE = range(5)
"""Kinds of requests."""


class FlightCode(ABC):
    """The flight software in C, in this process or on a flight computer."""

    def __init__(self, exported: Exported) -> None:
        """Make the structs of its interface."""
        self._places = {law.name: place for place, law in enumerate(exported.software.laws)}
        self._measurement: NDArray[Any] = np.zeros(1, exported.measurement_type)
        self._reference: NDArray[Any] = np.zeros(1, exported.reference_type)
        self._command: NDArray[Any] = np.zeros(1, exported.command_type)
        self.command: Array = self._command["command"][0]
        """The command of the last answer, as `Command.torque`."""
        self.condition = np.zeros(len(CONDITION))
        """The numbers of `CONDITION`."""
        self.telemetry = np.zeros((4, exported.software.joints + 3))
        """s, u, N_hat and e of the last tick, (4, m)."""

    @abstractmethod
    def _ask(self, kind: int, tick: int) -> int:
        """Send a request, receive command, condition and telemetry, and return the status."""

    def judge_stamp(self, tick: int) -> int:
        """Return the status of a state's stamp."""
        return self._ask(JUDGE, tick)

    def answer(self, state: RobotState, reference: Block) -> int:
        """Answer a state that was judged to be new; return its status."""
        fill_measurement(self._measurement, state)
        fill_reference(self._reference, reference)
        return self._ask(ANSWER, state.tick)

    def deactivate(self, tick: int) -> None:
        """End the flight with zero torque."""
        self._ask(DEACTIVATE, tick)

    @abstractmethod
    def use(self, law: ControlLaw) -> None:
        """Let a law take over if another one is in force."""

    def write_condition(self, record: Any) -> None:
        """Write the condition into a record of `Supervision`."""
        numbers, first = self.condition, CONDITION.index("rejected")
        reason, mode, answered, last, is_new_time = numbers[:first]
        assign(record, reason=reason, mode=mode, answered=answered, rejected=numbers[first:])
        assign(record.stamps, last=last, is_new_time=is_new_time)


class FlightLibrary(FlightCode):
    """One instance of the flight software in C, in this process."""

    def __init__(self, exported: Exported) -> None:
        """Compile the software, or take it from the cache, and initialise its memory.

        Raises:
            InputError: there is no compiler, or it fails.
        """
        super().__init__(exported)
        self._library = ctypes.CDLL(str(build_library(exported.sources)))
        self._library.space_robot_state_size.restype = ctypes.c_uint64
        self._library.space_robot_gains.restype = ctypes.POINTER(ctypes.c_double)
        # whole doubles: the struct needs their alignment
        self._state = np.zeros(-(-self._library.space_robot_state_size() // 8))
        self._call("init")

    def _call(self, name: str, *arguments: Any) -> int:
        pointers = (
            ctypes.c_void_p(a.ctypes.data) if isinstance(a, np.ndarray) else a for a in arguments
        )
        function = getattr(self._library, f"space_robot_{name}")
        return int(function(ctypes.c_void_p(self._state.ctypes.data), *pointers) or 0)

    def _ask(self, kind: int, tick: int) -> int:
        if kind == ANSWER:
            status = self._call("answer", self._measurement, self._reference, self._command)
            self._call("get_telemetry", self.telemetry)
        elif kind == JUDGE:
            status = self._call("judge", ctypes.c_int64(tick))
        else:
            status = self._call("stand_down", ctypes.c_int64(tick), self._command)
        self._call("get_condition", self.condition)
        return status

    def use(self, law: ControlLaw) -> None:
        """Take the gains of a law, and let it take over if another one is in force."""
        place, count = self._places[law.name], ctypes.c_int()
        gains = self._library.space_robot_gains(
            ctypes.c_void_p(self._state.ctypes.data), place, ctypes.byref(count)
        )
        numbers = np.concatenate([*law.gain_values.values(), np.zeros(0)])  # it may have no gains
        assert count.value == len(numbers)
        for k, number in enumerate(numbers):
            gains[k] = number
        self._call("choose_law", place)


class FlightComputer(FlightCode):
    """The flight software in a program that answers by UDP."""

    def __init__(self, exported: Exported, host: str, port: int) -> None:
        """Connect, and have the program begin anew.

        Raises:
            InputError: nobody answers, or the program is for another robot.
        """
        super().__init__(exported)
        self._request: NDArray[Any] = np.zeros(
            1,
            [
                ("kind", np.int64),
                ("law", np.int64),
                ("measurement", self._measurement.dtype),
                ("reference", self._reference.dtype),
            ],
        )
        self._answer: NDArray[Any] = np.zeros(
            1,
            [
                ("kind", np.int64),
                ("tick", np.int64),
                ("result", np.int64),
                ("command", self._command.dtype),
                ("condition", np.float64, self.condition.shape),
                ("telemetry", np.float64, self.telemetry.shape),
            ],
        )
        # one record: what is written into its parts is sent
        self._measurement = self._request["measurement"]
        self._reference = self._request["reference"]
        self.command = self._answer["command"]["command"][0]
        self.condition = self._answer["condition"][0]
        self.telemetry = self._answer["telemetry"][0]
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.settimeout(TIMEOUT_S)
        try:
            self._socket.connect((host, port))
            self._ask(BEGIN, 0)
        except (OSError, FlightError) as error:
            raise InputError(
                f"controller_code udp:{host}:{port}: {error}; start the flight computer first"
            ) from None

    def _ask(self, kind: int, tick: int) -> int:
        self._request["kind"], self._measurement["tick"] = kind, tick
        try:
            self._socket.send(self._request.tobytes())
            data = self._socket.recv(LARGEST)
        except OSError as error:
            raise FlightError(f"the flight computer does not answer ({error})") from None
        if len(data) != (size := self._answer.nbytes):
            raise FlightError(
                f"the flight computer answered {len(data)} bytes instead of {size}: "
                "its code was exported for another robot or other actuators"
            )
        self._answer[:] = np.frombuffer(data, self._answer.dtype)
        if (self._answer["kind"][0], self._answer["tick"][0]) != (kind, tick):
            raise FlightError("the flight computer answered another request")
        return int(self._answer["result"][0])

    def use(self, law: ControlLaw) -> None:
        """Let a law take over if another one is in force; its gains are the program's own."""
        self._request["law"] = self._places[law.name]
        self._ask(USE, 0)


def fill_reference(wanted: NDArray[Any], reference: Block) -> None:
    """Write a reference into a ``space_robot_reference``."""
    for name in wanted.dtype.names or ():
        wanted[name] = reference[name]


def fill_measurement(measurement: NDArray[Any], state: RobotState) -> None:
    """Write a state into a ``space_robot_measurement``."""
    measurement["tick"] = state.tick
    inside = measurement["state"]  # sized for this robot, the state for the largest
    for name in inside.dtype.names or ():
        field = inside[name]
        field[0] = getattr(state, name)[: field.shape[1]]


def find_compiler() -> str:
    """Return the C compiler: ``CC``, or the first of `COMPILERS` that is there."""
    names = [os.environ["CC"]] if os.environ.get("CC") else COMPILERS
    if compiler := next(filter(shutil.which, names), None):
        return compiler
    raise InputError(
        f"no C compiler ({', '.join(names)}) was found: install gcc or clang, or set CC"
    )


def write_sources(folder: Path, sources: Mapping[PurePosixPath, str]) -> list[str]:
    """Write source files; return the paths of those to be compiled."""
    for path, text in sources.items():
        file = folder / path
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text, encoding="utf-8")
    return [str(folder / path) for path in sorted(sources) if path.suffix == ".c"]


def build_library(sources: Mapping[PurePosixPath, str], flags: Sequence[str] = FLAGS) -> Path:
    """Return a shared library of sources, from the cache if it is there.

    Raises:
        InputError: there is no compiler, or it fails.
    """
    compiler = find_compiler()
    command = [compiler, *flags, "-shared", "-fPIC"]
    version = subprocess.run([compiler, "--version"], capture_output=True, check=False).stdout
    # with another compiler or other flags the same text is another library
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
        os.replace(temporary, library)  # at once: another process may read it
    return library
