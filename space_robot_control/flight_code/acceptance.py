"""Recorded answers of the kernels, which the flight code in C has to give, too.

Some are to hostile states and references: what no sensor and no mission should ever send.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from space_robot_model.dynamics.attitude import compose
from space_robot_msgs_py.compiled.records import Block
from space_robot_msgs_py.samples import Command, Reference, RobotState

from ..controller.controller import Controller
from ..controller.supervisor import Supervisor
from ..controller.tick import ANSWERED, NEW
from .folder import Exported
from .instances import fill_measurement, fill_reference

Array = NDArray[np.float64]

JUDGE, STEP, CHOOSE = range(3)
"""Kinds of records: a stamp is judged and its state not answered; a state; a law is chosen."""
REFUSED = -1
MAGIC = 0x5352464C49474854
VALUES = (
    *(np.nan, -np.nan, np.inf, -np.inf, 0.0, -0.0, 5e-324, -5e-324, 2.2e-308, 1e-160, 1e-6),
    *(1.0, -1.0, 1e15, -1e15, 1e29, 1.1e30, -1e31, 1e154, 1e200, 1.7e308, -1.7e308),
)
JUMPS = (0, -1, -2, 2, 7, 20, 21, 500, 1999, 2001, -5000, 10**6, 10**12, 2**52, -(2**62), 2**62)
LEAST, MOST = -(2**63), 2**63 - 1
SHARE, REFERENCE_SHARE = 0.3, 0.1
"""Shares of the states, and of their references, that are hostile."""


class RecordingSupervisor(Supervisor):
    """Supervisor that records its requests and answers, in the format of ``acceptance.c``."""

    def __init__(
        self, controller: Controller, exported: Exported, hold_ticks: int, longest_jump: int
    ) -> None:
        """Supervise ``controller`` as any supervisor, for exported flight software."""
        super().__init__(controller, hold_ticks, longest_jump)
        self._dtype = np.dtype(
            [
                ("kind", np.int64),
                ("measurement", exported.measurement_type),
                ("reference", exported.reference_type),
                ("result", np.int64),
                ("mode", np.int64),
                ("telemetry", np.uint64),
                ("command", exported.command_type),
            ]
        )
        self.records: list[bytes] = []
        self._judged = -1
        """Tick that was judged to be new and is not answered yet; -1: none."""

    def _add(
        self,
        kind: int,
        result: int,
        state: RobotState | int,
        reference: Block | None = None,
        command: Command | None = None,
    ) -> None:
        record: NDArray[Any] = np.zeros(1, self._dtype)
        record["kind"], record["result"] = kind, result
        record["mode"] = self.mode
        if isinstance(state, RobotState):
            fill_measurement(record["measurement"], state)
        else:
            record["measurement"]["tick"] = state
        if reference is not None:
            fill_reference(record["reference"], reference)
        if command is not None:
            record["command"]["tick"] = command.tick
            record["command"]["command"] = command.torque
            record["telemetry"] = weighted_sum(self.telemetry())
        self.records.append(record.tobytes())

    def choose(self, place: int) -> None:
        """Record that the law of a place in the exported ones is chosen."""
        self._add(CHOOSE, place, 0)

    def judge_stamp(self, tick: int) -> int:
        """Return the status of a state's stamp."""
        self.finish()
        status = super().judge_stamp(tick)
        if status == NEW:
            self._judged = tick
            return status
        is_known = status == ANSWERED
        result = int(self._record.reason) if is_known else REFUSED
        self._add(
            STEP, result, tick, None, Command(tick, self._command.torque) if is_known else None
        )
        return status

    def answer(self, state: RobotState, reference: Block) -> Command:
        """Return the command for a state."""
        command = super().answer(state, reference)
        self._judged = -1
        self._add(STEP, int(self._record.reason), state, reference, command)
        return command

    def finish(self) -> None:
        """Record a state that was judged and not answered, if the last one was."""
        if self._judged >= 0:
            self._add(JUDGE, NEW, self._judged)
            self._judged = -1

    def write(self, path: Path) -> None:
        """Write the records to a file."""
        head = np.array([MAGIC, self._dtype.itemsize, len(self.records)], np.int64)
        path.write_bytes(b"".join([head.tobytes(), *self.records]))


def weighted_sum(telemetry: tuple[Array, ...]) -> np.uint64:
    """Return a sum over the bits of numbers, each with another weight; NaN counts as zero."""
    numbers = np.concatenate(telemetry)
    numbers[np.isnan(numbers)] = 0.0  # processors make different ones
    weights = np.arange(1, numbers.size + 1, dtype=np.uint64)
    total: np.uint64 = (numbers.view(np.uint64) * weights).sum(dtype=np.uint64)
    return total


def disturb_state(state: RobotState, size: float, random: np.random.Generator) -> None:
    """Add noise of a ``size`` to all numbers of a state; its quaternion stays unit."""
    state.numbers[:] += size * random.normal(size=state.numbers.size)
    state.quaternion[:] /= np.sqrt(state.quaternion @ state.quaternion)


def corrupt_state(
    state: RobotState,
    wheels: int,
    random: np.random.Generator,
    desired: Array,
    is_hostile: bool = True,
) -> None:
    """Change some numbers of a state; those of wheels that the base does not have become zero.

    ``desired`` (4,) is the quaternion that the reference of the state has, or should have.
    """
    numbers = state.numbers
    way = random.integers(6) if is_hostile else -1
    if way == 0:  # any numbers
        places = random.integers(numbers.size, size=random.integers(1, 4))
        numbers[places] = random.choice(VALUES, size=places.size)
    elif way == 1:  # an attitude near half a turn from the desired one, or beyond
        eta = random.choice([0.0, 1e-7, 0.01, 0.0199, 0.03, -0.04, 0.06])
        axis = random.normal(size=3)
        axis *= np.sqrt(1.0 - eta * eta) / np.sqrt(axis @ axis)
        compose(desired, np.array([eta, *axis]), state.quaternion)
    elif way == 2:  # a quaternion of another norm
        state.quaternion[:] *= random.choice([0.0, 0.9, 0.9996, 1.0004, 1.1, -1.0])
    elif way == 3:  # everything the same number
        numbers[:] = random.choice(VALUES)
    elif way == 4:  # half a turn from what was, exactly, or the same with the other sign
        w, x, y, z = state.quaternion.copy()
        state.quaternion[:] = random.choice([[-w, -x, -y, -z], [-x, w, -z, y]])
    elif way == 5:  # large but allowed
        numbers[:] *= 10.0 ** random.integers(0, 20)
        state.quaternion[:] = [1.0, 0.0, 0.0, 0.0]
    state.wheel_velocities[wheels:] = state.wheel_torques[wheels:] = 0.0


def corrupted_reference(reference: Block, random: np.random.Generator) -> Block:
    """Return a reference with some, or all, of its numbers changed."""
    corrupted = reference.copy()
    for part in Reference.parts(corrupted):
        numbers = part.reshape(-1)
        places = random.integers(numbers.size, size=random.choice([0, 1, 3, numbers.size]))
        numbers[places] = random.choice(VALUES, size=places.size)
    return corrupted


def hostile_ticks(count: int, random: np.random.Generator) -> Iterator[int]:
    """Return ticks of states, most of them one after the other."""
    tick = 10**6
    for _ in range(count):
        yield tick if random.random() > 0.02 else int(random.choice([LEAST, MOST, -1, 2**52 + 1]))
        step = int(random.choice(JUMPS)) if random.random() < 0.05 else 1
        tick = min(max(tick + step, LEAST), MOST)
        if not 0 <= tick <= 2**52 and random.random() < 0.5:
            tick = int(random.integers(10**6))
