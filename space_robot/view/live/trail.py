"""The way of a tool, drawn while it is flown."""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from viser import LineSegmentsHandle, SceneApi

Array = NDArray[np.float64]

PIECE = 60
"""Segments that are sent anew with each point; pieces that are full are left alone."""
MOST_PIECES = 60
BREAK_S = 0.5
"""Places further apart in simulated time are not joined: nobody looked meanwhile."""


class Trail:
    """Line segments below a name in the scene."""

    def __init__(
        self, scene: SceneApi, name: str, colour: tuple[int, int, int], width: float
    ) -> None:
        """``width``: m."""
        self._scene, self._name, self._colour, self._width = scene, name, colour, width
        self._pieces: deque[LineSegmentsHandle] = deque()
        self._segments: list[tuple[Array, Array]] = []
        self._last: tuple[float, Array] | None = None
        self._count = 0

    def add(self, time: float, place: Array) -> None:
        """Lead the way on to a place, (3,) m, at a time, s."""
        last, self._last = self._last, (time, place)
        if last is None or not 0.0 < time - last[0] < BREAK_S:
            return
        if np.linalg.norm(place - last[1]) < 0.2 * self._width:  # drawn when it has gone farther
            self._last = time, last[1]
            return
        if not self._segments or len(self._segments) >= PIECE:
            self._begin()
        self._segments.append((last[1], place))
        self._pieces[-1].points = np.array(self._segments)

    def _begin(self) -> None:
        self._segments = []
        if len(self._pieces) == MOST_PIECES:
            self._pieces.popleft().remove()
        self._count += 1
        self._pieces.append(
            self._scene.add_line_segments(
                f"{self._name}/{self._count}",
                np.zeros((1, 2, 3)),
                self._colour,
                thickness=self._width,
            )
        )

    def clear(self) -> None:
        """Take all of it away."""
        while self._pieces:
            self._pieces.pop().remove()
        self._segments, self._last = [], None
