"""Targets in the scene: tumbling before they are grasped, falling past, and released again."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from robots import circular_orbit, meeting_target, target_of
from scene_pages import Scene, moving_log, page_of
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from space_robot.view import targets as drawing
from space_robot.view.flights import ViewOptions
from space_robot.view.targets import before_capture, held_poses
from space_robot_model.elementary.matrices import Array
from space_robot_model.robot import Robot
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_sim.environment.events import Capture, Release
from space_robot_sim.environment.impact import Grasp
from space_robot_sim.environment.neighbouring_orbit import free_fall, target_state
from space_robot_sim.environment.target import Target

TICK_S, TICKS = 0.1, 41


def capture(relative_to: str, velocity: list[float], rate: list[float]) -> Capture:
    content = {
        "name": "box",
        "mass": 3.0,
        "inertia": [1.0, 2.0, 2.5, 0.1, 0.0, -0.2],
        "place": {"position": [0.1, -0.2, 0.3], "quaternion": [0.6, 0.0, 0.8, 0.0]},
        "motion": {"relative_to": relative_to, "velocity": velocity, "angular_velocity": rate},
    }
    return Capture(0.0051, Target.from_dict({"target": content}))


def rotations(quaternions: Array) -> Array:
    axes: Array = Rotation.from_quat(quaternions, scalar_first=True).as_matrix()
    return axes


STILL = capture("tool", [0.0] * 3, [0.0] * 3)
"""Counts from tick 11: row 8 of a log from tick 3."""


def test_what_moves_in_the_tools_axes_and_in_inertial_ones(paper_robot: Robot) -> None:
    """What stands still in the hand turns as the hand; where no row is known nothing is."""
    turned = Rotation.from_rotvec([0.3, -0.5, 0.8]).as_matrix()
    robot = replace(paper_robot, tools=(replace(paper_robot.tool, rotation=turned),))
    log = moving_log(robot, 12, first_tick=3)
    velocity, rate = [0.1, 0.2, -0.3], [0.4, -0.5, 0.6]
    events = (STILL, capture("tool", velocity, rate), capture("inertial", velocity, rate))
    still, moved, inertial = (before_capture(event, log, robot) for event in events)
    assert still
    assert moved
    assert inertial
    positions, axes = held_poses(Grasp.of(robot, STILL.target), log, robot)
    shown, _ = still.poses(np.array([-log.timebase.period, 0.0]))
    np.testing.assert_allclose(shown, positions[7:9], atol=1e-9)
    hand = Rotation.from_matrix(axes[8] @ axes[7].T).as_rotvec() / log.timebase.period
    np.testing.assert_allclose(still.angular_velocity, hand)
    np.testing.assert_array_equal(inertial.velocity, velocity)
    np.testing.assert_array_equal(inertial.angular_velocity, rate)
    tool = still.rotation @ turned
    np.testing.assert_allclose(moved.velocity - still.velocity, tool @ velocity, atol=1e-9)
    added = moved.angular_velocity - still.angular_velocity
    np.testing.assert_allclose(added, tool @ rate, atol=1e-9)
    log.joint_positions[7] = np.nan
    unknown = [(8, 3), (12, 11), (12, 30)]
    for part in (log, *(moving_log(robot, ticks, first) for ticks, first in unknown)):
        assert before_capture(STILL, part, robot) is None


def still_log(robot: Robot) -> FlightLog:
    """A flight of 4 s in which the base turns evenly and moves, and the arm stands still."""
    log = moving_log(robot, TICKS, period_ns=round(TICK_S * 1e9))
    time = TICK_S * np.arange(TICKS)
    log.base_position[:] = time[:, np.newaxis] * [0.05, 0.0, -0.02]
    turned = Rotation.from_rotvec(time[:, np.newaxis] * np.array([0.0, 0.1, 0.2]))
    log.quaternion[:] = turned.as_quat(scalar_first=True)
    log.joint_positions[:] = 0.3
    return log


def scene_of(log: FlightLog, robot: Robot, patch: pytest.MonkeyPatch, *events: Any) -> Scene:
    patch.setattr(drawing, "flown_events", lambda log: list(events))
    return Scene(page_of(robot, ViewOptions(rate=10.0), one=log))


def test_a_target_tumbles_by_eulers_equations_until_it_is_in_the_hand(
    paper_robot: Robot, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The plant's truth at the capture, integrated back on the target's own axes."""
    velocity, spin = [0.1, -0.2, 0.05], np.array([0.5, -0.8, 0.6])
    motion = {"relative_to": "inertial", "velocity": velocity, "angular_velocity": spin.tolist()}
    content = {"name": "t", "mass": 50.0, "inertia": [3.0, 5.0, 7.0, 0.2, -0.1, 0.3]}
    target = Target.from_dict({"target": {**content, "motion": motion}})
    scene = scene_of(still_log(paper_robot), paper_robot, monkeypatch, Capture(3.0, target))
    held = next(name for name in scene.names() if name.endswith("/target_0"))
    end = scene.poses(3.0 + 1e-3)[held]
    grasp = Grasp.of(paper_robot, target)
    # axes of the drawn box: those of the inertia of a box
    second = 0.5 * np.trace(grasp.inertia) * np.eye(3) - grasp.inertia
    moments = np.linalg.eigvalsh(second)
    inertia = np.diag(moments.sum() - moments)

    def rates(_: float, x: Array) -> Array:
        q, w = x[:4], x[4:]
        spun = 0.5 * np.array([-q[1:] @ w, *(q[0] * w + np.cross(q[1:], w))])
        return np.concatenate([spun, np.linalg.solve(inertia, -np.cross(w, inertia @ w))])

    start = Rotation.from_matrix(end.rotation)
    x = np.concatenate([start.as_quat(scalar_first=True), start.inv().apply(spin)])
    back = solve_ivp(rates, (0.0, -3.0), x, dense_output=True, rtol=1e-10, atol=1e-12)
    for time in (0.0, 1.0, 2.5):
        shown = scene.poses(time + 1e-3)["/one/free_target_0/box"]
        np.testing.assert_allclose(shown.rotation, rotations(back.sol(time - 3.0)[:4]), atol=1e-6)
        way = (time - 3.0) * np.array(velocity)
        np.testing.assert_allclose(shown.position, end.position + way, atol=1e-6)


def test_after_its_release_it_flies_on_as_the_hand_moved(
    paper_robot: Robot, monkeypatch: pytest.MonkeyPatch
) -> None:
    target = Target.from_dict({"target": {"name": "b", "mass": 5.0, "inertia": [1, 1, 1, 0, 0, 0]}})
    events = (Capture(1.0, target), Release(2.0, 0.4))
    scene = scene_of(still_log(paper_robot), paper_robot, monkeypatch, *events)
    free = "/one/released_target_0"
    held, tool = (next(n for n in scene.names() if n.endswith(e)) for e in ("/target_0", "/tool"))
    for time, is_held in ((0.9, False), (1.0, True), (1.9, True), (2.0, False), (4.0, False)):
        shown = scene.visible(time + 1e-3)
        assert (shown[free], shown[held]) == (time >= 2.0, is_held)
    first, later = (scene.poses(time + 1e-3) for time in (2.0, 3.5))
    np.testing.assert_allclose(first[free].position, first[held].position, atol=1e-6)
    hand = scene.poses(2.1 + 1e-3)[held].position - first[held].position
    spring = 0.4 * 1.5 * first[tool].rotation[:, 2]
    way = later[free].position - first[free].position
    np.testing.assert_allclose(way, 15.0 * hand + spring, atol=1e-5)
    turned = Rotation.from_matrix(later[free].rotation @ first[free].rotation.T).as_rotvec()
    np.testing.assert_allclose(turned, [0.0, 0.15, 0.3], atol=1e-6)  # as the base turns


@pytest.mark.parametrize("is_reached", [True, False])
def test_a_target_on_an_orbit_falls_as_the_plant_has_it(
    paper_robot: Robot, monkeypatch: pytest.MonkeyPatch, is_reached: bool
) -> None:
    """One that is met comes to the hand; one that is missed flies past it."""
    orbit, log = circular_orbit(420e3), still_log(paper_robot)
    motion = {"velocity": [0.05, -0.1, 0.02], "angular_velocity": [0.3, -0.2, 0.4]}
    grasp = Grasp.of(paper_robot, target_of(**motion))
    place = held_poses(grasp, log.rows(30, 31), paper_robot)[0][0]
    target = meeting_target(orbit, 3.0, place, **motion)
    monkeypatch.setattr(drawing, "plant_settings", lambda log: orbit)
    moving = target.model_copy(update={"motion": target_state(target, orbit, 3.0).motion})
    met = replace(Capture(3.0, target), target=moving) if is_reached else None
    monkeypatch.setattr(drawing, "_as_met", lambda event, log: met)
    scene = scene_of(log, paper_robot, monkeypatch, Capture(3.0, target))

    def box(time: float) -> Any:
        return scene.poses(time + 1e-3)["/one/free_target_0/box"]

    def rate(start: Array, end: Array) -> Array:
        return Rotation.from_matrix(end @ start.T).as_rotvec() / TICK_S

    for time in (0.0, 1.0, 2.8):
        truth = target_state(target, orbit, time)
        np.testing.assert_allclose(box(time).position, truth.position, atol=1e-6)
        found = rate(box(time).rotation, box(time + TICK_S).rotation)
        np.testing.assert_allclose(found, truth.motion.angular_velocity, atol=0.02)
    held = [name for name in scene.names() if name.endswith("/target_0")]
    assert bool(held) is is_reached
    if met:
        found = rate(box(2.9).rotation, scene.poses(3.0 + 1e-3)[held[0]].rotation)
        np.testing.assert_allclose(found, met.target.motion.angular_velocity, atol=0.02)
    else:
        axes = rotations(free_fall(target, orbit, np.array([0.0, 4.0]))[1])
        turned = box(4.0).rotation @ box(0.0).rotation.T
        np.testing.assert_allclose(turned, axes[1] @ axes[0].T, atol=1e-6)
