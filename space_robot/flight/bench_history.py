"""What was commanded on a bench, from which the log of its flight is flown again."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray
from typing_extensions import Self

Array = NDArray[np.float64]

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
