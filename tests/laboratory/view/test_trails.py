"""The ways of the tools: one line each, whole at the end, that grows with the frames."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from space_robot.view.trails import DESIRED, PIECES, trails


class Scene:
    """Keeps the lines that are drawn."""

    def __init__(self) -> None:
        self.lines: dict[str, Any] = {}

    def add_line_segments(
        self, path: str, points: Any, colour: Any, thickness: float, visible: bool
    ) -> Any:
        assert path not in self.lines
        line = SimpleNamespace(points=points, colour=colour, width=thickness, visible=visible)
        self.lines[path] = line
        return line


@pytest.mark.parametrize("count", [2, PIECES - 1, PIECES + 1, 200])
@pytest.mark.parametrize("has_desired", [False, True])
def test_every_piece_of_a_way_appears_when_it_has_been_flown(count: int, has_desired: bool) -> None:
    random = np.random.default_rng(count)
    ways = {name: random.normal(size=(count, 3)) for name in ("left/hand", "right")}
    desired = random.normal(size=(count, 3)) if has_desired else None
    frames: Any = SimpleNamespace(time=np.arange(count), tools=ways, desired=desired)
    scene: Any = Scene()
    moves = trails(scene, "/robot", frames, (1, 2, 3), 0.5)
    assert len(moves) == len(ways)
    wish = scene.lines.pop("/robot/desired", None)
    assert (wish is not None) == has_desired
    if wish:
        assert (wish.colour, wish.width, wish.visible) == (DESIRED, 0.15, True)
        np.testing.assert_array_equal(wish.points[:, 0], desired[:-1])
        np.testing.assert_array_equal(wish.points[:, 1], desired[1:])
    assert len(scene.lines) == 2 * min(PIECES, count - 1)
    for k in range(count):
        for move in moves:
            move(k)
        for name, places in ways.items():
            begin = f"/robot/trail_{name.replace('/', '_')}/"
            shown = [x for path, x in scene.lines.items() if path.startswith(begin) and x.visible]
            flown = np.concatenate([x.points for x in shown]) if shown else np.empty((0, 2, 3))
            assert k - len(flown) <= np.ceil((count - 1) / PIECES)
            np.testing.assert_array_equal(flown[:, 0], places[: len(flown)])
            np.testing.assert_array_equal(flown[:, 1], places[1 : len(flown) + 1])
            assert all((x.colour, x.width) == ((1, 2, 3), 0.5) for x in shown)
    assert all(line.visible for line in scene.lines.values())
