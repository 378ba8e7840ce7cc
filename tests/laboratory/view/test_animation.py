"""What stands in the page's scene is what stands in the bag: bodies, tools, marks, trails."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from oracles import pinocchio_tree
from scene_pages import Scene, moving_log, page_of
from strategies import random_tree

from space_robot import Scenario
from space_robot.analysis import excerpt
from space_robot.analysis.analysed_log import AnalysedLog
from space_robot.analysis.plotted import flown_quantities
from space_robot.view.animation import DESIRED, PIECES, ShownFlight, animate, trails
from space_robot.view.flights import Mark, ViewOptions, flight_marks, shared_marks, shown_robot
from space_robot.view.frames import MOST_FRAMES, Frames, shown_times
from space_robot_model.elementary.matrices import Array
from space_robot_model.robot import Robot
from space_robot_model.robot.placements import frame_names, tool_pose
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.bag.reader import read_flight
from space_robot_msgs_py.errors import InputError
from space_robot_msgs_py.samples import Timebase

Flown = Callable[..., FlightLog]
TOLERANCE = 1e-6
"""m, and of the axes' numbers."""
START = {"joints_deg": [0, 90, 200, 20, 30, 10]}
LINE = {"tool": {"xyz": [0.05, 0.0, -0.05], "rpy_deg": [0, 0, 5]}, "duration": 1.0}
CAPTURE = Mark(0.1, 0.1, "capture small_satellite", "event")
SCALE = Mark(0.15, 0.2, "drive_scale all=0.9", "fault")
STICK = Mark(0.18, math.inf, "stuck_joint 3=20", "fault")
SWAP = Mark(0.25, 0.25, "tde_stc -> ctc", "law")
RELEASE = Mark(0.28, 0.28, "release", "event")


def expected(robot: Robot, log: FlightLog, row: int) -> dict[str, pin.SE3]:
    """The frames of all bodies and tools at a row of the bag, by name."""
    model = pinocchio_tree(robot.tree)
    data, q = model.createData(), pin.neutral(model)
    w, x, y, z = log.quaternion[row]
    q[:7] = [*log.base_position[row], x, y, z, w]
    names = (*log.joint_names, *log.passive_names)
    angles = (*log.joint_positions[row], *log.passive_positions[row])
    for name, position in zip(names, angles, strict=True):
        q[model.joints[model.getJointId(name)].idx_q] = position
    pin.framesForwardKinematics(model, data, q)
    frames = {frame.name: data.oMf[i] for i, frame in enumerate(model.frames)}
    names = frame_names(robot).bodies
    found = {new: frames[name] for new, name in zip(names, robot.body_names, strict=True)}
    for tool in robot.tools:
        body = found[names[tool.body]]
        found[tool.name] = body * pin.SE3(tool.rotation, tool.position)
    return found


def assert_shown(scene: Scene, log: FlightLog, robot: Robot, times: Array) -> None:
    for k in (0, 1, len(times) // 2, len(times) - 1):
        row = round(times[k] / log.timebase.period) - log.first_tick
        poses = scene.poses(times[k] - times[0] + 1e-9)
        by_name = {path.rpartition("/")[2]: pose for path, pose in poses.items()}
        for name, pose in expected(robot, log, row).items():
            np.testing.assert_allclose(
                by_name[name].position, pose.translation, atol=TOLERANCE, err_msg=name
            )
            np.testing.assert_allclose(by_name[name].rotation, pose.rotation, atol=TOLERANCE)


@pytest.fixture(scope="module")
def flown(tmp_path_factory: pytest.TempPathFactory) -> Flown:
    """Bags of flights, read back."""
    folder = tmp_path_factory.mktemp("flights")

    def fly(name: str, **options: Any) -> FlightLog:
        if not (folder / name).exists():
            Scenario(**{"robot": name, "duration": 1.0, **options}).fly(folder / name)
        return read_flight(folder / name)

    return fly


def test_the_poses_on_the_page_are_the_bags(flown: Flown) -> None:
    log = flown("dual_arm")
    robot, times = shown_robot(log), shown_times([log], 30.0)
    scene = Scene(page_of(robot, one=log))
    assert (len(times), scene.duration) == (31, pytest.approx(times[-1] - times[0]))
    assert_shown(scene, log, robot, times)
    assert any(n.startswith(f"/one/trail_{robot.tool.name}/") for n in scene.names())


def test_the_first_camera_sees_all_bodies_in_all_frames(paper_robot: Robot) -> None:
    log = moving_log(paper_robot, 40, period_ns=100_000_000)
    log.base_position[:] = np.random.default_rng(5).uniform(-2.0, 2.0, (40, 3))
    scene, camera = Scene(page_of(paper_robot, one=log)), dict[str, Any]()
    for _, message in scene.messages:
        camera |= message if message["type"].startswith("SetCamera") else {}
    position, target = np.array(camera["position"]), np.array(camera["look_at"])
    ahead = (target - position) / np.linalg.norm(target - position)
    right = np.cross(ahead, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    slope = np.tan(0.5 * camera["fov"])
    for time in log.time:
        poses = scene.poses(float(time) + 1e-6)
        away = np.array([p.position for n, p in poses.items() if "base_link" in n]) - position
        assert (np.abs(away @ right) < 1.1 * slope * (away @ ahead)).all()
        assert (np.abs(away @ np.cross(right, ahead)) < slope * (away @ ahead)).all()


def test_the_poses_of_a_tree_with_all_kinds_of_joints() -> None:
    rng = np.random.default_rng(5)
    kinds = ["revolute", "prismatic", "passive revolute", "fixed", "passive prismatic", "revolute"]
    robot = Robot.from_tree(random_tree(rng, kinds))
    log = moving_log(robot, 40, period_ns=10_000_000)
    log.base_position[:] = rng.normal(size=(40, 3))
    log.passive_positions[:] = rng.uniform(-0.2, 0.2, log.passive_positions.shape)
    times = shown_times([log], 100.0)
    flight = ShownFlight("tree", log, robot, "#112233")
    page = animate([flight], times, False, True, lambda total: lambda: None)
    assert_shown(Scene(page), log, robot, times)


def test_side_by_side_nobody_is_in_anothers_place(flown: Flown) -> None:
    log = flown("paper")
    logs, robot = {"a": log, "b/c": log, "d": log}, shown_robot(log)
    apart = Scene(page_of(robot, ViewOptions(side_by_side=True), **logs)).poses(0.5)
    roots = ("/a/base_link", "/b_c/base_link", "/d/base_link")
    reach = [
        [poses.position for path, poses in apart.items() if path.startswith(root)] for root in roots
    ]
    for left, right in itertools.pairwise(reach):
        assert max(x for x, _, _ in left) < min(x for x, _, _ in right)
    together = Scene(page_of(robot, **logs)).poses(0.5)
    for root in roots:
        np.testing.assert_allclose(together[root].position, apart[roots[0]].position, atol=1e-8)


def test_a_target_waits_where_it_is_grasped_and_is_seen_while_it_is_held(flown: Flown) -> None:
    events = ["capture@0.2:small_satellite", "release@0.6"]
    log = flown("held", robot="paper", events=events)
    robot = shown_robot(log)
    scene = Scene(page_of(robot, ViewOptions(rate=100.0), one=log))
    free, held = "/one/free_target_0", next(n for n in scene.names() if n.endswith("/target_0"))
    times = shown_times([log], 100.0)
    for time in times:
        shown = scene.visible(time + 1e-4)
        is_free, is_held = time < 0.2 - 1e-9, 0.2 - 1e-9 <= time < 0.6 - 1e-9
        assert (shown[free], shown[held]) == (is_free, is_held), time
    assert held.count("/") == 3 + robot.tool.body  # on the body that carries the tool
    # the last frame before: it stands still in the hand, so it moves as the hand does
    poses = scene.poses(times[times < 0.2 - 1e-9][-1] + 1e-4)
    place, hand = poses[f"{free}/box"], poses[held]
    np.testing.assert_allclose(place.position, hand.position, atol=1e-5)
    np.testing.assert_allclose(place.rotation, hand.rotation, atol=1e-4)


def test_events_faults_and_laws_are_marked_by_time(flown: Flown) -> None:
    """What makes no sense is left out; of several flights it is said which had it."""
    marked = flown(
        "marked",
        robot="paper",
        duration=0.3,
        swaps=["0.25:ctc"],
        events=["capture@0.1:small_satellite", "release@0.28"],
        faults=["stuck_joint@0.18:3=20", "drive_scale@0.15-0.2:all=0.9", "noise_gyro@2:1e-6"],
    )
    assert flight_marks(marked) == [CAPTURE, SCALE, STICK, SWAP, RELEASE]
    assert flight_marks(excerpt(marked, 0.16, 0.24)) == [SCALE, STICK]
    assert flight_marks(excerpt(marked, 0.1, 0.14)) == [CAPTURE]  # it begins with the excerpt
    faults = ["drive_scale@0.15-0.2:all=0.9", "no_such@1", "", 7]
    broken = replace(marked, laws=(), flight={"faults": faults, "events": ["capture@x", 3]})
    assert flight_marks(broken) == [SCALE]
    other = replace(marked, flight={**marked.flight, "faults": []})
    shared = [mark.text for mark in shared_marks({"one": marked, "two": other})]
    faulty = [f"one: {SCALE.text}", f"one: {STICK.text}"]
    assert shared == [CAPTURE.text, *faulty, SWAP.text, RELEASE.text]


def test_the_tool_ends_at_its_goal_and_its_distance_from_the_path_is_plotted(flown: Flown) -> None:
    mission = {"start": START, "segments": [LINE, {"hold": 0.2}]}
    flight = Scenario(controller="ctc", mission=mission).fly()
    log, robot = flight.log, flight.flight.robot
    poses = Scene(page_of(robot, one=log)).poses(log.time[-1])
    goals = [pose for name, pose in sorted(poses.items()) if "/goal_" in name]
    for goal, row in ((goals[0], 0), (goals[-1], -1)):
        rotation, offset = tool_pose(robot, log.quaternion[[row]], log.joint_positions[[row]])
        place = poses["/one"].position + log.base_position[row] + offset[0]
        np.testing.assert_allclose(goal.position, place, atol=1e-5)
        np.testing.assert_allclose(goal.rotation, rotation[0], atol=1e-4)
    assert np.linalg.norm(goals[-1].position - goals[0].position) > 0.07
    (tool,) = [
        q for _, q in flown_quantities(AnalysedLog(log), ["tool"]) if q.title == "tool error"
    ]
    assert tool.values.max() == flight.metrics["tool.max"]
    plain = flown("paper")
    assert not any("/goal_" in name for name in Scene(page_of(robot, a=plain)).names())
    assert "tool error" not in [q.title for _, q in flown_quantities(AnalysedLog(plain), ["tool"])]


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


@pytest.mark.parametrize("count", [2, PIECES + 1, 4 * PIECES + 7])
def test_trails_are_the_whole_ways_and_no_more_than_has_been_flown(count: int) -> None:
    random = np.random.default_rng(count)
    ways = {name: random.normal(size=(count, 3)) for name in ("left/hand", "right", "desired")}
    desired = ways.pop("desired")
    frames: Any = SimpleNamespace(time=np.arange(count), tools=ways, desired=desired)
    lines: dict[str, Any] = {}

    def add(path: str, points: Array, colour: Any, **looks: Any) -> Any:
        return lines.setdefault(path, SimpleNamespace(points=points, colour=colour, **looks))

    scene: Any = SimpleNamespace(add_line_segments=add)
    moves = trails(scene, "/robot", frames, (1, 2, 3), 0.5)
    wish = lines.pop("/robot/desired")
    assert (wish.colour, wish.thickness, wish.visible) == (DESIRED, 0.15, True)
    np.testing.assert_array_equal(wish.points, np.stack([desired[:-1], desired[1:]], axis=1))
    for move, name in zip(moves, ways, strict=True):
        root = f"/robot/trail_{name.replace('/', '_')}/"
        pieces = [line for path, line in lines.items() if path.startswith(root)]
        points = np.concatenate([line.points for line in pieces])
        np.testing.assert_array_equal(points, np.stack([ways[name][:-1], ways[name][1:]], axis=1))
        sizes = [len(line.points) for line in pieces]
        assert len(sizes) == min(PIECES, count - 1)
        assert max(sizes) - min(sizes) <= 1
        assert all((x.colour, x.thickness) == ((1, 2, 3), 0.5) for x in pieces)
        for k in range(count):
            move(k)
            assert [line.visible for line in pieces] == (np.cumsum(sizes) <= k).tolist()
