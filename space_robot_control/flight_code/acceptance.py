"""Recorded answers of the kernels, which the flight code in C has to give, too."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.compiled.records import Block
from space_robot_msgs_py.samples import Command, Reference, RobotState

from ..controller.controller import Controller
from ..controller.supervisor import MODES, Supervisor
from ..controller.tick import ANSWERED, NEW
from .folder import Exported
from .library import command_of, fill_measurement, fill_reference, measurement_of

Array = NDArray[np.float64]

JUDGE, STEP, CHOOSE = range(3)
"""Kinds of records: a stamp is judged and its state not answered; a state; a law is chosen."""
REFUSED = -1
MAGIC = 0x5352464C49474854


class AnswerRecording:
    """Requests to the flight software and its answers, in the format of ``acceptance.c``."""

    def __init__(self, exported: Exported) -> None:
        """Begin without any."""
        reference = np.dtype(exported.translated.dtype(Reference))
        self.dtype = np.dtype(
            [
                ("kind", np.int64),
                ("measurement", measurement_of(exported).dtype),
                ("reference", reference),
                ("result", np.int64),
                ("mode", np.int64),
                ("telemetry", np.uint64),
                ("command", command_of(exported).dtype),
            ]
        )
        self._parts: list[bytes] = []

    def __len__(self) -> int:
        """Number of records."""
        return len(self._parts)

    def add(
        self,
        kind: int,
        result: int,
        supervisor: Supervisor,
        state: RobotState | int,
        reference: Block | None = None,
        command: Command | None = None,
    ) -> None:
        """Add a request, for a state or only its tick, and its answer."""
        record: NDArray[Any] = np.zeros(1, self.dtype)
        record["kind"], record["result"] = kind, result
        record["mode"] = MODES.index(supervisor.mode)
        if isinstance(state, RobotState):
            fill_measurement(record["measurement"], state)
        else:
            record["measurement"]["tick"] = state
        if reference is not None:
            fill_reference(record["reference"], reference)
        if command is not None:
            record["command"]["tick"] = command.tick
            record["command"]["command"] = command.torque
            record["telemetry"] = sum_of(supervisor.telemetry())
        self._parts.append(record.tobytes())

    def write(self, path: Path) -> None:
        """Write the records to a file."""
        head = np.array([MAGIC, self.dtype.itemsize, len(self._parts)], np.int64)
        path.write_bytes(b"".join([head.tobytes(), *self._parts]))


def sum_of(telemetry: tuple[Array, ...]) -> np.uint64:
    """Return a sum over the bits of numbers, each with another weight; NaN counts as zero."""
    numbers = np.concatenate(telemetry)
    numbers[np.isnan(numbers)] = 0.0
    weights = np.arange(1, numbers.size + 1, dtype=np.uint64)
    total: np.uint64 = (numbers.view(np.uint64) * weights).sum(dtype=np.uint64)
    return total


class RecordingSupervisor(Supervisor):
    """Supervisor that records all requests and answers."""

    def __init__(
        self, controller: Controller, recording: AnswerRecording, hold_ticks: int, longest_jump: int
    ) -> None:
        """Supervise ``controller`` as any supervisor, into ``recording``."""
        super().__init__(controller, hold_ticks, longest_jump)
        self._recording = recording
        self._judged = -1
        """Tick that was judged to be new and is not answered yet; -1: none."""

    def judge_stamp(self, tick: int) -> int:
        """Return the standing of a state by its stamp."""
        self.finish()
        standing = super().judge_stamp(tick)
        if standing == NEW:
            self._judged = tick
            return standing
        is_known = standing == ANSWERED
        result = int(self._record.reason) if is_known else REFUSED
        command = Command(tick, self._command.torque) if is_known else None
        self._recording.add(STEP, result, self, tick, None, command)
        return standing

    def answer(self, state: RobotState, reference: Block) -> Command:
        """Return the command for a state."""
        command = super().answer(state, reference)
        self._judged = -1
        result = int(self._record.reason)
        self._recording.add(STEP, result, self, state, reference, command)
        return command

    def finish(self) -> None:
        """Record a state that was judged and not answered, if the last one was."""
        if self._judged >= 0:
            self._recording.add(JUDGE, NEW, self, self._judged)
            self._judged = -1
