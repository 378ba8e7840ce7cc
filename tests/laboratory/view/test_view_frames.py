"""Which row of a flight is shown when, and the ways of the tools: by search, row by row."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from moving_logs import moving_log
from numpy.typing import NDArray

from space_robot.view.frames import MOST_FRAMES, Frames, shown_times
from space_robot.view.trails import DESIRED, PIECES, trails
from space_robot_model.robot import Robot
from space_robot_model.robot.tool import tool_pose
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.errors import InputError
from space_robot_msgs_py.samples import Timebase

Array = NDArray[np.float64]


@settings(max_examples=50)
@given(
    st.integers(0, 50),
    st.integers(2, 40),
    st.integers(1, 7),
    st.lists(st.integers(0, 39), max_size=25),
    st.data(),
)
def test_a_frame_shows_the_last_known_row_that_has_begun(
    paper_robot: Robot, first: int, ticks: int, milliseconds: int, gaps: list[int], data: Any
) -> None:
    log = moving_log(paper_robot, ticks, first, 100_000 * milliseconds)
    log.quaternion[[row for row in gaps if row < ticks]] = np.nan
    known = [row for row in range(ticks) if np.isfinite(log.quaternion[row]).all()]
    asked = data.draw(
        st.lists(st.integers(first, first + ticks + 5), min_size=1, unique=True).map(sorted)
    )
    # a time is a tick's, a third of a period later, or off by rounding
    off = data.draw(st.sampled_from([0.0, 1.0 / 3.0, -1e-9, 1e-9]))
    times = (np.array(asked) + off) * log.timebase.period
    if not known:
        with pytest.raises(InputError):
            Frames.of(log, paper_robot, times)
        return
    frames = Frames.of(log, paper_robot, times)
    rows = [max([row for row in known if first + row <= tick], default=known[0]) for tick in asked]
    assert frames.base_position[:, 0].tolist() == rows
    np.testing.assert_array_equal(frames.joint_positions, log.joint_positions[rows])
    _, place = tool_pose(paper_robot, log.quaternion[rows], log.joint_positions[rows])
    (shown,) = frames.tools.values()
    np.testing.assert_allclose(shown, log.base_position[rows] + place, atol=1e-12)
    _, place = tool_pose(paper_robot, log.reference_base[rows, :4], log.reference_joints[rows, 0])
    assert frames.desired is not None
    np.testing.assert_allclose(frames.desired, log.base_position[rows] + place, atol=1e-12)


@given(
    st.lists(st.tuples(st.integers(0, 30), st.integers(1, 9000)), min_size=1, max_size=4),
    st.floats(0.5, 3000.0),
)
def test_frames_are_at_ticks_from_the_first_flights_begin_to_the_last_ones_end(
    paper_robot: Robot, flights: list[tuple[int, int]], rate: float
) -> None:
    logs = []
    for first, ticks in flights:
        log = FlightLog.allocate(ticks, (), Timebase(500_000))
        log.first_tick = first
        logs.append(log)
    start, end = min(f for f, _ in flights), max(f + n - 1 for f, n in flights)
    times = shown_times(logs, rate)
    ticks = times / 5e-4
    np.testing.assert_allclose(ticks, np.round(ticks), atol=1e-6)
    assert round(ticks[0]) == start
    assert round(ticks[-1]) == max(end, start + 1)  # a scene that plays has two frames
    assert len(times) <= max(2, MOST_FRAMES // len(logs) + 2)
    asked = min((end - start) * 5e-4 * rate, end - start, MOST_FRAMES / len(logs))
    assert abs(len(times) - 1 - max(1.0, asked)) <= 1.0
    steps = np.diff(np.round(ticks))
    assert steps.min() >= 1
    assert steps.max() - steps.min() <= 1


class DrawnLines:
    """A scene that keeps the lines drawn in it."""

    def __init__(self) -> None:
        self.lines: dict[str, Any] = {}

    def add_line_segments(self, path: str, points: Array, colour: Any, **looks: Any) -> Any:
        assert path not in self.lines
        self.lines[path] = SimpleNamespace(points=points, colour=colour, **looks)
        return self.lines[path]


@pytest.mark.parametrize("count", [2, PIECES + 1, 4 * PIECES + 7])
def test_trails_are_the_whole_ways_and_no_more_than_has_been_flown(count: int) -> None:
    random = np.random.default_rng(count)
    ways = {name: random.normal(size=(count, 3)) for name in ("left/hand", "right", "desired")}
    desired = ways.pop("desired")
    frames: Any = SimpleNamespace(time=np.arange(count), tools=ways, desired=desired)
    scene: Any = DrawnLines()
    moves = trails(scene, "/robot", frames, (1, 2, 3), 0.5)
    wish = scene.lines.pop("/robot/desired")
    assert (wish.colour, wish.thickness, wish.visible) == (DESIRED, 0.15, True)
    np.testing.assert_array_equal(wish.points, np.stack([desired[:-1], desired[1:]], axis=1))
    for move, name in zip(moves, ways, strict=True):
        root = f"/robot/trail_{name.replace('/', '_')}/"
        pieces = [line for path, line in scene.lines.items() if path.startswith(root)]
        points = np.concatenate([line.points for line in pieces])
        np.testing.assert_array_equal(points, np.stack([ways[name][:-1], ways[name][1:]], axis=1))
        sizes = [len(line.points) for line in pieces]
        assert len(sizes) == min(PIECES, count - 1)
        assert max(sizes) - min(sizes) <= 1
        assert all((x.colour, x.thickness) == ((1, 2, 3), 0.5) for x in pieces)
        for k in range(count):
            move(k)
            assert [line.visible for line in pieces] == (np.cumsum(sizes) <= k).tolist()
