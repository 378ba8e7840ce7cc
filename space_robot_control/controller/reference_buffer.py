"""Buffer of the desired motion, received in chunks."""

from __future__ import annotations

from collections import deque

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.compiled.records import Block
from space_robot_msgs_py.errors import MessageError
from space_robot_msgs_py.samples import Reference, ReferenceChunk

from .signals import LARGEST

Array = NDArray[np.float64]

EMPTY = np.iinfo(np.int64).min
"""Tick of a row that holds nothing; older than any."""
PAST_SHARE = 4
"""Share of rows kept for past ticks, as 1 in this number."""
MOST_PUT_ASIDE = 256


class ReferenceBuffer:
    """Ring buffer of reference rows by tick; joint and base parts may arrive separately.

    Once `now` is set, it holds rows around that tick: a part of the ring's length before it, the
    rest after it. Other rows are kept aside in case `begin` sets another time.
    Before that, newer rows push out older ones.
    Rows with a number not finite, or beyond `LARGEST`, are refused with a `MessageError`.
    """

    def __init__(self, n: int, capacity: int = 32_768) -> None:
        """``capacity``: rows; a mission's lead and one chunk of it (20,000) must find place."""
        self.now = EMPTY
        """Current tick; `EMPTY` while it is unknown."""
        self._references: Block = np.zeros(capacity, Reference.dtype(n))
        self._joints, self._base = map(_Ring, Reference.parts(self._references))
        self._aside: deque[tuple[_Ring, int, Array]] = deque(maxlen=MOST_PUT_ASIDE)

    def begin(self, tick: int) -> None:
        """Begin a new time at ``tick``, and take rows kept aside."""
        self.now = tick
        aside = list(self._aside)
        self._aside.clear()
        for ring, start, rows in aside:
            self._store(ring, start, rows)

    def add(self, chunk: ReferenceChunk) -> None:
        """Add both parts of a chunk."""
        self.add_joints(chunk.start, chunk.joints)
        self.add_base(chunk.start, chunk.base)

    def add_joints(self, start: int, rows: Array) -> None:
        """Add (k, 3, n) rows from tick ``start`` on."""
        self._store(self._joints, start, rows)

    def add_base(self, start: int, rows: Array) -> None:
        """Add (k, 10) rows from tick ``start`` on."""
        self._store(self._base, start, rows)

    def covers(self, tick: int) -> bool:
        """Return True if both parts of a tick's row have arrived."""
        i = tick % len(self._joints.ticks)
        return bool(self._joints.ticks[i] == tick and self._base.ticks[i] == tick)

    def at(self, tick: int) -> Block:
        """Return the `Reference` of a covered tick."""
        i = tick % len(self._references)
        return self._references[i : i + 1]

    def hold(self, tick: int) -> Block | None:
        """Return a `Reference` at rest in the last point before a ``tick`` that is not covered.

        None if nothing has arrived yet.
        """
        ticks = self._joints.ticks
        whole = np.where(ticks == self._base.ticks, ticks, EMPTY)
        whole[whole > tick] = EMPTY
        i = int(np.argmax(whole))
        if whole[i] == EMPTY:
            return None
        held = np.zeros_like(self._references[:1])
        for name in ("joint_positions", "quaternion"):
            held[name] = self._references[name][i]
        return held

    def _store(self, ring: _Ring, start: int, rows: Array) -> None:
        if not np.all(np.abs(rows) <= LARGEST):
            raise MessageError(
                f"reference from tick {start}: a number is not finite or beyond {LARGEST:g}",
                "not finite",
            )
        arriving = np.arange(start, start + len(rows))
        there = ring.ticks[arriving % len(ring.ticks)]
        if self.now == EMPTY:  # a repeated old chunk must not push out a newer one
            wanted = arriving >= there
        else:
            first = self.now - len(ring.ticks) // PAST_SHARE
            wanted = (first <= arriving) & (arriving < first + len(ring.ticks))
            if not wanted.all():
                self._aside.append((ring, start, rows))
        places = arriving[wanted] % len(ring.ticks)
        ring.rows[places], ring.ticks[places] = rows[wanted], arriving[wanted]


class _Ring:
    """Ring buffer of one part of the reference, with the tick of each row."""

    def __init__(self, rows: Array) -> None:
        self.rows = rows
        self.ticks = np.full(len(rows), EMPTY, dtype=np.int64)
