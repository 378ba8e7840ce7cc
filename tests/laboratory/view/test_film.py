"""What stands in the page's scene is what stands in the bag, by Pinocchio's kinematics."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from moving_logs import moving_log
from numpy.typing import NDArray
from oracles import pinocchio_tree
from scene_pages import Scene, page_of, quiet
from strategies import random_bodies

from space_robot import Scenario
from space_robot.analysis import excerpt
from space_robot.view.film import FilmedFlight, film
from space_robot.view.flights import ViewOptions, shown_robot
from space_robot.view.frames import shown_times
from space_robot.view.marks import Mark, marks_of, shared_marks
from space_robot.view.quantities import quantities_of
from space_robot_model.robot import Robot
from space_robot_model.robot.frame_names import frame_names
from space_robot_model.robot.tool import tool_pose
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.bag.reader import read_flight

Array = NDArray[np.float64]
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
    model = pinocchio_tree(robot.bodies())
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


def test_the_poses_of_a_tree_with_all_kinds_of_joints() -> None:
    rng = np.random.default_rng(5)
    kinds = ["revolute", "prismatic", "passive revolute", "fixed", "passive prismatic", "revolute"]
    robot = Robot.of_tree("tree", random_bodies(rng, kinds))
    log = moving_log(robot, 40, period_ns=10_000_000)
    log.base_position[:] = rng.normal(size=(40, 3))
    log.passive_positions[:] = rng.uniform(-0.2, 0.2, log.passive_positions.shape)
    times = shown_times([log], 100.0)
    page = film([FilmedFlight("tree", log, robot, "", "#112233")], times, False, True, quiet)
    assert_shown(Scene(page), log, robot, times)


def test_side_by_side_nobody_is_in_anothers_place(flown: Flown) -> None:
    log = flown("paper")
    logs, robot = {"a": log, "b/c": log, "d": log}, shown_robot(log)
    apart = Scene(page_of(robot, ViewOptions(side_by_side=True), **logs)).poses(0.5)
    together = Scene(page_of(robot, **logs)).poses(0.5)
    roots = ("/a/base_link", "/b_c/base_link", "/d/base_link")
    reach = [
        [poses.position for path, poses in apart.items() if path.startswith(root)] for root in roots
    ]
    for left, right in itertools.pairwise(reach):
        assert max(x for x, _, _ in left) < min(x for x, _, _ in right)
    first = apart[roots[0]].position
    for root in roots:
        np.testing.assert_allclose(together[root].position, first, atol=1e-8)
        np.testing.assert_allclose(apart[root].position[1:], first[1:], atol=1e-8)


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


def test_the_trail_grows_and_rows_without_a_state_show_the_one_before(flown: Flown) -> None:
    log = flown("paper")
    robot = shown_robot(log)
    log.quaternion[900:1100] = np.nan
    scene = Scene(page_of(robot, one=log))
    held, before = scene.poses(0.5)["/one/base_link/link1"], expected(robot, log, 899)["link1"]
    np.testing.assert_allclose(held.position, before.translation, atol=TOLERANCE)
    pieces = [name for name in scene.names() if name.startswith("/one/trail_tool/")]
    counts = [sum(scene.visible(time)[name] for name in pieces) for time in (0.0, 0.5, 1.0)]
    assert (len(pieces), counts[0], counts[2]) == (30, 0, 30)
    assert 14 <= counts[1] <= 16


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
    assert marks_of(marked) == [CAPTURE, SCALE, STICK, SWAP, RELEASE]
    assert marks_of(excerpt(marked, 0.16, 0.24)) == [SCALE, STICK]
    assert marks_of(excerpt(marked, 0.1, 0.14)) == [CAPTURE]  # it begins with the excerpt
    faults = ["drive_scale@0.15-0.2:all=0.9", "no_such@1", "", 7]
    broken = replace(marked, laws=(), flight={"faults": faults, "events": ["capture@x", 3]})
    assert marks_of(broken) == [SCALE]
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
    (tool,) = [q for q in quantities_of(log, robot) if q.title == "tool error"]
    assert tool.values.max() == flight.metrics["tool"]["largest_m"]
    plain = flown("paper")
    assert not any("/goal_" in name for name in Scene(page_of(robot, a=plain)).names())
    assert "tool error" not in [q.title for q in quantities_of(plain, shown_robot(plain))]
