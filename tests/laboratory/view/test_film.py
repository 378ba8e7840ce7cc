"""What stands in the page's scene is what stands in the bag, by Pinocchio's kinematics."""

from __future__ import annotations

import itertools
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from numpy.typing import NDArray
from random_trees import random_bodies
from scene_pages import Scene, plot_data
from tree_oracle import pinocchio_tree

from space_robot.flight.plan import Flight, FlightPlan, resolve
from space_robot.flight.simulate import simulate
from space_robot.view.film import FilmedFlight, film
from space_robot.view.flights import ViewOptions, flights_page, shown_robot
from space_robot.view.frames import shown_times
from space_robot_model.robot import Robot
from space_robot_model.robot.frame_names import frame_names
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.bag.reader import read_flight
from space_robot_msgs_py.samples import Timebase

Array = NDArray[np.float64]
TOLERANCE = 1e-6
"""m, and of the axes' numbers."""


def quiet(total: int):  # type: ignore[no-untyped-def]
    return lambda: None


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
def flown(tmp_path_factory: pytest.TempPathFactory):  # type: ignore[no-untyped-def]
    folder = tmp_path_factory.mktemp("flights")

    def fly(name: str, **plan: object) -> FlightLog:
        if not (folder / name).exists():
            simulate(Flight(resolve(FlightPlan(duration=1.0, **plan))), folder / name)  # type: ignore[arg-type]
        return read_flight(folder / name)

    return fly


@pytest.mark.parametrize("robot_name", ["paper", "flexible_panels", "boom", "dual_arm"])
def test_the_poses_on_the_page_are_the_bags(flown, robot_name: str) -> None:  # type: ignore[no-untyped-def]
    log = flown(robot_name, robot=robot_name)
    robot = shown_robot(log)
    times = shown_times([log], 30.0)
    assert len(times) == 31
    page = flights_page({"one": log}, {"one": robot}, ViewOptions(), quiet)
    scene = Scene(page)
    assert scene.duration == pytest.approx(times[-1] - times[0])
    assert_shown(scene, log, robot, times)


def test_the_poses_of_a_tree_with_all_kinds_of_joints() -> None:
    rng = np.random.default_rng(5)
    kinds = ["revolute", "prismatic", "passive revolute", "fixed", "passive prismatic", "revolute"]
    robot = Robot.of_tree("tree", random_bodies(rng, kinds))
    log = FlightLog.allocate(
        40, robot.joint_names, Timebase(10_000_000), passive_names=robot.passive_names
    )
    log.base_position[:] = rng.normal(size=(40, 3))
    log.quaternion[:] = rng.normal(size=(40, 4))
    log.quaternion[:] /= np.linalg.norm(log.quaternion, axis=1, keepdims=True)
    log.joint_positions[:] = rng.uniform(-3.0, 3.0, log.joint_positions.shape)
    log.passive_positions[:] = rng.uniform(-0.2, 0.2, log.passive_positions.shape)
    times = shown_times([log], 100.0)
    page = film([FilmedFlight("tree", log, robot, "", "#112233")], times, False, True, quiet)
    assert_shown(Scene(page), log, robot, times)


def test_side_by_side_nobody_is_in_anothers_place(flown) -> None:  # type: ignore[no-untyped-def]
    log = flown("paper", robot="paper")
    robot = shown_robot(log)
    logs, robots = {"a": log, "b/c": log, "d": log}, dict.fromkeys(("a", "b/c", "d"), robot)
    apart = Scene(flights_page(logs, robots, ViewOptions(side_by_side=True), quiet)).poses(0.5)
    together = Scene(flights_page(logs, robots, ViewOptions(), quiet)).poses(0.5)
    roots = ("/a/base_link", "/b_c/base_link", "/d/base_link")
    reach = [
        [poses.position for path, poses in apart.items() if path.startswith(root)] for root in roots
    ]
    for left, right in itertools.pairwise(reach):
        assert max(x for x, _, _ in left) < min(x for x, _, _ in right)
    for root in roots:
        np.testing.assert_allclose(
            together[root].position, apart["/a/base_link"].position, atol=1e-8
        )
        np.testing.assert_allclose(
            apart[root].position[1:], apart["/a/base_link"].position[1:], atol=1e-8
        )


def test_different_robots_stand_side_by_side_of_themselves(flown) -> None:  # type: ignore[no-untyped-def]
    logs = {name: flown(name, robot=name) for name in ("paper", "boom")}
    robots = {name: shown_robot(log) for name, log in logs.items()}
    poses = Scene(flights_page(logs, robots, ViewOptions(), quiet)).poses(0.0)
    assert poses["/paper"].position[0] == 0.0
    assert poses["/boom"].position[0] > 1.0


def test_a_target_waits_where_it_is_grasped_and_is_seen_while_it_is_held(flown) -> None:  # type: ignore[no-untyped-def]
    log = flown("held", events=["capture@0.2:small_satellite", "release@0.6"])
    robot = shown_robot(log)
    scene = Scene(flights_page({"one": log}, {"one": robot}, ViewOptions(rate=100.0), quiet))
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


def test_the_trail_grows_and_is_the_tools_way(flown) -> None:  # type: ignore[no-untyped-def]
    log = flown("paper", robot="paper")
    scene = Scene(flights_page({"one": log}, {"one": shown_robot(log)}, ViewOptions(), quiet))
    pieces = [name for name in scene.names() if name.startswith("/one/trail_tool/")]
    assert len(pieces) == 30
    counts = [sum(scene.visible(time)[name] for name in pieces) for time in (0.0, 0.5, 1.0)]
    assert counts[0] == 0
    assert 14 <= counts[1] <= 16
    assert counts[2] == 30


def test_a_row_without_a_state_shows_the_one_before(flown, tmp_path: Path) -> None:  # type: ignore[no-untyped-def]
    log = flown("paper", robot="paper")
    robot = shown_robot(log)
    log.quaternion[900:1100] = np.nan
    scene = Scene(flights_page({"one": log}, {"one": robot}, ViewOptions(rate=100.0), quiet))
    held, before = scene.poses(0.5)["/one/base_link/link1"], expected(robot, log, 899)["link1"]
    np.testing.assert_allclose(held.position, before.translation, atol=TOLERANCE)
    np.testing.assert_allclose(held.rotation, before.rotation, atol=TOLERANCE)


def test_many_flights_all_have_curves(flown) -> None:  # type: ignore[no-untyped-def]
    log = flown("paper", robot="paper")
    logs = {f"flight_{k}": log for k in range(8)}
    page = flights_page(logs, dict.fromkeys(logs, shown_robot(log)), ViewOptions(rate=2.0), quiet)
    for plot in plot_data(page)["plots"]:
        assert [series["label"] for series in plot["series"]] == list(logs)
