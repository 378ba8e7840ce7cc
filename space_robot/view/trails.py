"""Tool paths in a scene, which grow during the flight."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from .frames import Frames

if TYPE_CHECKING:
    from viser import LineSegmentsHandle, SceneApi

Array = NDArray[np.float64]
Move = Callable[[int], None]
"""Updates a part of a scene to the k-th frame; called for k = 0, 1, ..."""

PIECES = 60
"""Pieces of a trail, which appear one after the other."""
DESIRED = (128, 128, 128)
"""Colour of the desired path."""


def trails(
    scene: SceneApi, root: str, frames: Frames, colour: tuple[int, int, int], width: float
) -> list[Move]:
    """Draw the paths of a robot's tools, and, thinner, the desired path of the first tool.

    Args:
        scene: of a server.
        root: name of the robot in the scene.
        frames: of its flight.
        colour: of the flown paths.
        width: of the flown paths, m.
    """
    edges = np.unique(np.linspace(0, len(frames.time) - 1, PIECES + 1).round().astype(int))
    trails: list[Move] = []
    for tool, places in frames.tools.items():
        pieces = {
            int(stop): _line(
                scene,
                f"{root}/trail_{tool.replace('/', '_')}/{start}",
                places[start : stop + 1],
                colour,
                width,
                False,
            )
            for start, stop in pairwise(edges)
        }
        trails.append(_appearing(pieces))
    if frames.desired is not None:
        _line(scene, f"{root}/desired", frames.desired, DESIRED, 0.3 * width, True)
    return trails


def _line(
    scene: SceneApi,
    path: str,
    places: Array,
    colour: tuple[int, int, int],
    width: float,
    visible: bool,
) -> LineSegmentsHandle:
    points = np.stack([places[:-1], places[1:]], axis=1)
    return scene.add_line_segments(path, points, colour, thickness=width, visible=visible)


def _appearing(pieces: dict[int, LineSegmentsHandle]) -> Move:
    def appear(k: int) -> None:
        if k in pieces:
            pieces[k].visible = True

    return appear
