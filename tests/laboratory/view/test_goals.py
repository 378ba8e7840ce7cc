"""Goals of the tool stand in the scene where the tool comes to rest."""

from __future__ import annotations

from typing import Any

import numpy as np
from scene_pages import Scene

from space_robot import FlownFlight, Scenario
from space_robot.view.film import FilmedFlight, film
from space_robot.view.quantities import quantities_of
from space_robot_model.robot.tool import tool_pose

START = {"joints_deg": [0, 90, 200, 20, 30, 10]}
LINE = {"tool": {"xyz": [0.05, 0.0, -0.05], "rpy_deg": [0, 0, 5]}, "duration": 1.0}


def shown(**options: Any) -> tuple[Scene, FlownFlight]:
    flown = Scenario(controller="ctc", **options).fly()
    flight = FilmedFlight("one", flown.log, flown.flight.robot, "ctc", "#E69F00")
    times = np.array([0.0, flown.log.time[-1]])
    return Scene(film([flight], times, False, True, lambda total: lambda: None)), flown


def test_the_tool_ends_at_its_goal() -> None:
    scene, flown = shown(mission={"start": START, "segments": [LINE, {"hold": 0.2}]})
    poses, log = scene.poses(flown.log.time[-1]), flown.log
    goals = [pose for name, pose in sorted(poses.items()) if "/goal_" in name]
    root = poses["/one"]
    for goal, row in ((goals[0], 0), (goals[-1], -1)):
        rotation, offset = tool_pose(
            flown.flight.robot, log.quaternion[[row]], log.joint_positions[[row]]
        )
        place = root.position + log.base_position[row] + offset[0]
        np.testing.assert_allclose(goal.position, place, atol=1e-5)
        np.testing.assert_allclose(goal.rotation, rotation[0], atol=1e-4)
    assert np.linalg.norm(goals[-1].position - goals[0].position) > 0.07


def test_a_mission_of_waypoints_has_none() -> None:
    scene, _ = shown(duration=0.1)
    assert not [name for name in scene.names() if "/goal_" in name]


def test_the_distance_from_the_path_is_plotted() -> None:
    flown = Scenario(controller="ctc", mission={"start": START, "segments": [LINE]}).fly()
    quantities = quantities_of(flown.log, flown.flight.robot)
    (tool,) = [quantity for quantity in quantities if quantity.title == "tool error"]
    assert tool.values.max() == flown.metrics["tool"]["largest_m"]
    plain = Scenario(controller="ctc", duration=0.1).fly()
    titles = [quantity.title for quantity in quantities_of(plain.log, plain.flight.robot)]
    assert "tool error" not in titles
