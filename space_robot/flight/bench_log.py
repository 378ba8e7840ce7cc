"""What was flown on a bench: its commands, and the log that they are flown again into."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import replace
from itertools import islice
from typing import Any

import numpy as np
from typing_extensions import Self

from space_robot_control.controller.law_choice import LawChoice, NoLaw
from space_robot_control.laws import ControlLaw
from space_robot_model.elementary.matrices import Array
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.errors import DivergedError, FlightError
from space_robot_msgs_py.samples import Command

from .flown_log import ended_early, flight_log, note_assumed_errors
from .plan import Flight
from .simulate import measured_ticks

CHUNK_TICKS = 256
"""Ticks of a chunk; full chunks are shared by copies."""


class BenchHistory:
    """Commands of the ticks flown, and the law's telemetry where it was asked.

    A plant is a function of its seed and its commands. A tick therefore needs the bytes of a
    command alone, and a copy costs as much as the last chunk.
    """

    __slots__ = ("_chunks", "_rows", "seed")

    def __init__(self, seed: int) -> None:
        """Begin at tick 0, with the seed of the plant's random numbers."""
        self.seed = seed
        self._chunks: list[tuple[bytes, ...]] = []
        self._rows: list[bytes] = []

    def add(self, command: Array, telemetry: tuple[Array, ...] = ()) -> None:
        """Add a tick: its command (m+A,), and s, u, N_hat, e (m,) if the law was asked."""
        row = command.tobytes()
        if telemetry:
            row += b"".join([values.tobytes() for values in telemetry])
        self._rows.append(row)
        if len(self._rows) == CHUNK_TICKS:
            self._chunks.append(tuple(self._rows))
            self._rows = []

    def __len__(self) -> int:
        return CHUNK_TICKS * len(self._chunks) + len(self._rows)

    def rows(self) -> Iterator[Array]:
        """Yield the numbers of each tick, read-only: (m+A,), or (m+A+4m,) with telemetry."""
        for chunk in (*self._chunks, self._rows):
            for row in chunk:
                yield np.frombuffer(row)

    def copy(self) -> Self:
        """Return a copy, which shares the full chunks."""
        other = type(self)(self.seed)
        other._chunks, other._rows = self._chunks.copy(), self._rows.copy()
        return other

    def __deepcopy__(self, memo: object) -> Self:
        return self.copy()


STRETCH_TICKS = 10_000
"""Ticks whose states are in memory beside the log."""


class BenchLog:
    """A flight and its log as `space_robot.flight.simulate.simulate` makes it."""

    def __init__(self, flight: Flight, history: BenchHistory, error: FlightError | None) -> None:
        """Fly the commands of a history again; ``error``: that ended the flight, if one did."""
        self.flight = flown_flight(flight, history)
        """The flight that was flown, with its plant at the end: of the seed that was flown, and
        without a law if the law was never asked."""
        self.log = self._fly(history, error)
        """All ticks flown."""

    def _fly(self, history: BenchHistory, error: FlightError | None) -> FlightLog:
        flight, plant, ticks = self.flight, self.flight.plant, len(history)
        is_unanswered = error is not None and not isinstance(error, DivergedError)
        log = flight_log(flight, ticks + is_unanswered)
        assert log.commanded_torque is not None
        assert log.telemetry is not None
        log.telemetry[:] = np.nan  # where the law was not asked
        width, axes = len(plant.names.commanded), log.axes
        rows, no_law = history.rows(), NoLaw({}, flight.period, axes)
        choice = LawChoice(no_law)
        last: ControlLaw | None = None
        command = Command(0, np.zeros(width))
        for start in range(0, log.ticks, STRETCH_TICKS):
            count = min(STRETCH_TICKS, log.ticks - start)
            states = np.empty(count, plant.state.block.dtype)
            truths, torques = states.copy(), np.full((count, width), np.nan)
            for k, row in enumerate(islice(rows, count)):
                states[k], truths[k], torques[k] = plant.state.block, plant.truth.block, row[:width]
                law: ControlLaw = no_law
                if len(row) > width:
                    log.telemetry[start + k] = row[width:].reshape(4, axes)
                    law = law_at(flight.law, flight.swaps, start + k)
                if law is not last:
                    choice.choose(law)
                    if change := choice.change_at(start + k):
                        log.laws += (change.law,)
                last = law
                command.torque[:] = row[:width]
                with suppress(DivergedError):  # in the last step of a flight that ended by it
                    plant.step(command)
            if start + count > ticks:
                states[-1], truths[-1] = plant.state.block, plant.truth.block
            log.put(start, states if log.measured is None else truths)
            log.put_measured(start, states)
            log.put_commands(start, torques)
        note_assumed_errors(flight, log, 0, log.ticks)
        if error is not None:
            return ended_early(log, measured_ticks(plant, error), plant.tick)
        return log


def law_at(law: ControlLaw, swaps: Sequence[tuple[int, ControlLaw]], tick: int) -> ControlLaw:
    """Return the law in force at a tick, after the planned ``swaps`` from ``law``."""
    for swapped_at, other in swaps:
        if swapped_at <= tick:
            law = other
    return law


def flown_flight(flight: Flight, history: BenchHistory) -> Flight:
    """Return the flight that describes what was flown on a bench, with a plant at tick 0.

    It has the seed of the history, and no law if none was ever asked.
    """
    scenario, width = flight.scenario, len(flight.plant.names.commanded)
    options: dict[str, Any] = {}
    changes: dict[str, Any] = {}
    if history.seed != scenario.plant.fault_seed:
        options["seed"] = history.seed
        changes["plant"] = scenario.plant.model_copy(update={"fault_seed": history.seed})
    is_by_hand = len(history) and all(len(row) == width for row in history.rows())
    if is_by_hand and scenario.law.name != NoLaw.name:
        options |= {"controller": None, "swaps": []}
        controller = scenario.controller.model_copy(update={"controller": "", "swaps": [""]})
        laws = {NoLaw.name: NoLaw({}, flight.period, flight.robot.n + 3)}
        changes |= {"controller": controller, "gains": {}, "laws": laws, "swaps": []}
    changes["options"] = scenario.options.model_copy(update=options)
    return Flight(replace(scenario, **changes))
