"""Targets in the scene: tumbling before they are grasped, falling past, and released again."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from meeting_targets import circular_orbit, meeting_target, target_of
from moving_logs import moving_log
from numpy.typing import NDArray
from scene_pages import Scene
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from space_robot.view import targets as drawing
from space_robot.view.flights import ViewOptions, flights_page
from space_robot.view.free_body import held_poses
from space_robot_model.robot import Robot
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_sim.environment.events import Capture, Release
from space_robot_sim.environment.grasp import Grasp
from space_robot_sim.environment.neighbouring_orbit import fall, meet
from space_robot_sim.environment.target import Target

pytest.importorskip("viser")

Array = NDArray[np.float64]
TICK_S, TICKS = 0.1, 41


def quiet(total: int):  # type: ignore[no-untyped-def]
    return lambda: None


def still_log(robot: Robot) -> FlightLog:
    """A flight of 4 s in which the base turns evenly and moves, and the arm stands still."""
    log = moving_log(robot, TICKS, period_ns=round(TICK_S * 1e9))
    time = TICK_S * np.arange(TICKS)
    log.base_position[:] = time[:, np.newaxis] * [0.05, 0.0, -0.02]
    turned = Rotation.from_rotvec(time[:, np.newaxis] * np.array([0.0, 0.1, 0.2]))
    log.quaternion[:] = turned.as_quat(scalar_first=True)
    log.joint_positions[:] = 0.3
    return log


def page_of(log: FlightLog, robot: Robot, monkeypatch: pytest.MonkeyPatch, *events: Any) -> Scene:
    monkeypatch.setattr(drawing, "events_of", lambda log: list(events))
    options = ViewOptions(rate=10.0)
    return Scene(flights_page({"one": log}, {"one": robot}, options, quiet))


def test_a_target_tumbles_by_eulers_equations_until_it_is_in_the_hand(
    paper_robot: Robot, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The plant's truth at the capture, integrated back on the target's own axes."""
    motion = {"relative_to": "inertial", "velocity": [0.1, -0.2, 0.05]}
    spin = np.array([0.5, -0.8, 0.6])
    target = Target.from_dict(
        {
            "target": {
                "name": "tumbler",
                "mass": 50.0,
                "inertia": [3.0, 5.0, 7.0, 0.2, -0.1, 0.3],
                "motion": {**motion, "angular_velocity": spin.tolist()},
            }
        }
    )
    scene = page_of(still_log(paper_robot), paper_robot, monkeypatch, Capture(3.0, target))
    held = next(name for name in scene.names() if name.endswith("/target_0"))
    end = scene.poses(3.0 + 1e-3)[held]
    grasp = Grasp.of(paper_robot, target)
    # axes of the drawn box: those of the inertia of a box
    second = 0.5 * np.trace(grasp.inertia) * np.eye(3) - grasp.inertia
    moments = np.linalg.eigvalsh(second)
    inertia = np.diag(np.trace(np.diag(moments)) - moments)

    def rates(_: float, x: Array) -> Array:
        q, w = x[:4], x[4:]
        spun = 0.5 * np.array([-q[1:] @ w, *(q[0] * w + np.cross(q[1:], w))])
        return np.concatenate([spun, np.linalg.solve(inertia, -np.cross(w, inertia @ w))])

    start = Rotation.from_matrix(end.rotation)
    x = np.concatenate([start.as_quat(scalar_first=True), start.inv().apply(spin)])
    back = solve_ivp(rates, (0.0, -3.0), x, dense_output=True, rtol=1e-10, atol=1e-12)
    for time in (0.0, 1.0, 2.5):
        shown = scene.poses(time + 1e-3)["/one/free_target_0/box"]
        due = Rotation.from_quat(back.sol(time - 3.0)[:4], scalar_first=True).as_matrix()
        np.testing.assert_allclose(shown.rotation, due, atol=1e-6)
        way = (time - 3.0) * np.array(motion["velocity"])
        np.testing.assert_allclose(shown.position, end.position + way, atol=1e-6)


def test_after_its_release_it_flies_on_as_the_hand_moved(
    paper_robot: Robot, monkeypatch: pytest.MonkeyPatch
) -> None:
    target = Target.from_dict({"target": {"name": "b", "mass": 5.0, "inertia": [1, 1, 1, 0, 0, 0]}})
    log = still_log(paper_robot)
    events = (Capture(1.0, target), Release(2.0, 0.4))
    scene = page_of(log, paper_robot, monkeypatch, *events)
    free = "/one/released_target_0"
    held = next(name for name in scene.names() if name.endswith("/target_0"))
    for time in TICK_S * np.arange(TICKS):
        shown = scene.visible(time + 1e-3)
        assert shown[free] == (time >= 2.0 - 1e-9)
        assert shown[held] == (1.0 - 1e-9 <= time < 2.0 - 1e-9)
    first, later = (scene.poses(time + 1e-3) for time in (2.0, 3.5))
    np.testing.assert_allclose(first[free].position, first[held].position, atol=1e-6)
    hand = scene.poses(2.1 + 1e-3)[held].position - first[held].position
    spring = 0.4 * 1.5 * first["/one/base_link/" + tool_path(scene)].rotation[:, 2]
    way = later[free].position - first[free].position
    np.testing.assert_allclose(way, 15.0 * hand + spring, atol=1e-5)
    turned = Rotation.from_matrix(later[free].rotation @ first[free].rotation.T).as_rotvec()
    np.testing.assert_allclose(turned, [0.0, 0.15, 0.3], atol=1e-6)  # as the base turns


def tool_path(scene: Scene) -> str:
    path = next(name for name in scene.names() if name.endswith("/tool"))
    return path.removeprefix("/one/base_link/")


def test_a_target_on_an_orbit_falls_as_the_plant_has_it(
    paper_robot: Robot, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One that is met comes to the hand; one that is missed flies past it."""
    orbit, log = circular_orbit(420e3), still_log(paper_robot)
    motion = {"velocity": [0.05, -0.1, 0.02], "angular_velocity": [0.3, -0.2, 0.4]}
    grasp = Grasp.of(paper_robot, target_of(**motion))
    place = held_poses(grasp, log.rows(30, 31), paper_robot)[0][0]
    target = meeting_target(orbit, 3.0, place, **motion)
    monkeypatch.setattr(drawing, "orbit_of", lambda log: orbit)
    met = replace(
        Capture(3.0, target),
        target=target.model_copy(update={"motion": meet(target, orbit, 3.0).motion}),
    )
    for reached in (True, False):
        monkeypatch.setattr(drawing, "_as_met", lambda event, log, r=reached: met if r else None)
        scene = page_of(log, paper_robot, monkeypatch, Capture(3.0, target))
        times = np.array([0.0, 1.0, 2.9])
        for time in times:
            shown = scene.poses(time + 1e-3)["/one/free_target_0/box"]
            truth = meet(target, orbit, float(time))
            np.testing.assert_allclose(shown.position, truth.position, atol=1e-6)
            near = [scene.poses(t + 1e-3)["/one/free_target_0/box"] for t in (time, time + 0.1)]
            if time < 2.9:
                turned = near[1].rotation @ near[0].rotation.T
                rate = Rotation.from_matrix(turned).as_rotvec() / 0.1
                np.testing.assert_allclose(rate, truth.motion.angular_velocity, atol=0.02)
        held = [name for name in scene.names() if name.endswith("/target_0")]
        assert bool(held) is reached
        if reached:
            last, hand = (
                scene.poses(t + 1e-3)[name]
                for t, name in ((2.9, "/one/free_target_0/box"), (3.0, held[0]))
            )
            turned = Rotation.from_matrix(hand.rotation @ last.rotation.T).as_rotvec() / 0.1
            np.testing.assert_allclose(turned, met.target.motion.angular_velocity, atol=0.02)
    _, attitudes = fall(target, orbit, np.array([0.0, 4.0]))
    last = scene.poses(4.0 + 1e-3)["/one/free_target_0"].rotation
    first = scene.poses(1e-3)["/one/free_target_0"].rotation
    axes = Rotation.from_quat(attitudes, scalar_first=True).as_matrix()
    np.testing.assert_allclose(last @ first.T, axes[1] @ axes[0].T, atol=1e-6)
