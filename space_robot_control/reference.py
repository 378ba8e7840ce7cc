"""The desired motion as it arrives in chunks, kept until its tick has come."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.errors import MessageError
from space_robot_msgs_py.samples import ReferenceChunk

from .controller_kernels import LARGEST

Array = NDArray[np.float64]

EMPTY = np.iinfo(np.int64).min
"""Tick of a row that holds nothing; older than any."""


class ReferenceBuffer:
    """A ring of reference rows by tick; the joints' and the base's part may come apart.

    A row stays until the ring's length of newer ones has come, so late readers can go back.
    Rows with a number not finite, or beyond `LARGEST`, are refused with a `MessageError`.
    """

    def __init__(self, n: int, capacity: int = 16_384) -> None:
        self._joints = np.zeros((capacity, 3, n))
        self._base = np.zeros((capacity, 10))
        self._joint_tick = np.full(capacity, EMPTY, dtype=np.int64)
        self._base_tick = np.full(capacity, EMPTY, dtype=np.int64)

    def add(self, chunk: ReferenceChunk) -> None:
        """Take both parts of a chunk."""
        self.add_joints(chunk.start, chunk.joints)
        self.add_base(chunk.start, chunk.base)

    def add_joints(self, start: int, rows: Array) -> None:
        """Take (k, 3, n) rows from tick ``start`` on."""
        self._store(self._joints, self._joint_tick, start, rows)

    def add_base(self, start: int, rows: Array) -> None:
        """Take (k, 10) rows from tick ``start`` on."""
        self._store(self._base, self._base_tick, start, rows)

    def covers(self, tick: int) -> bool:
        """Whether both parts of a tick's row are here."""
        i = tick % len(self._joint_tick)
        return bool(self._joint_tick[i] == tick and self._base_tick[i] == tick)

    def at(self, tick: int) -> tuple[Array, Array]:
        """The (3, n) and (10,) rows of a tick that `covers`."""
        i = tick % len(self._joint_tick)
        return self._joints[i], self._base[i]

    def hold(self, tick: int) -> tuple[Array, Array] | None:
        """Rows for a ``tick`` that is not covered: the last point before it, at rest.

        None if nothing has come yet.
        """
        whole = np.where(self._joint_tick == self._base_tick, self._joint_tick, EMPTY)
        whole[whole > tick] = EMPTY
        i = int(np.argmax(whole))
        if whole[i] == EMPTY:
            return None
        joints, base = np.zeros_like(self._joints[i]), np.zeros_like(self._base[i])
        joints[0], base[:4] = self._joints[i, 0], self._base[i, :4]
        return joints, base

    @staticmethod
    def _store(target: Array, ticks: NDArray[np.int64], start: int, rows: Array) -> None:
        if not np.all(np.abs(rows) <= LARGEST):
            raise MessageError(
                f"reference from tick {start}: a number is not finite or beyond {LARGEST:g}",
                "not finite",
            )
        arriving = np.arange(start, start + len(rows))
        places = arriving % len(ticks)
        newer = arriving >= ticks[places]  # a repeated old chunk must not push out a newer one
        target[places[newer]] = rows[newer]
        ticks[places[newer]] = arriving[newer]
