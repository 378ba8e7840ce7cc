"""Distance of the robot's start from the start of its mission."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from space_robot_control.guidance.mission import Mission
from space_robot_model.elementary.matrices import norm
from space_robot_model.robot import Robot
from space_robot_sim.plant.settings import PlantSettings

SMALL_DEG, SMALL_RATE_DEG_S, SMALL_M = 1.0, 0.1, 0.01
"""Differences that any law makes up for: of an attitude or a joint, of the base's rate, of a
prismatic joint."""


class StartStep(NamedTuple):
    """Step from the robot's configuration at tick 0 to the mission's; 0 where it is small."""

    attitude_deg: float = 0.0
    """Angle between the base's attitude and the desired one."""
    rate_deg_s: float = 0.0
    """Length of the base's angular velocity less the desired one."""
    joint: str = ""
    """The joint that is farthest from its desired position; empty: none is far."""
    joint_error: float = 0.0
    """Its error, rad (of a prismatic joint m)."""
    unit: str = "rad"
    """Of ``joint_error``: "rad" or "m"."""


def start_step(robot: Robot, settings: PlantSettings, mission: Mission) -> StartStep | None:
    """Return the step that a flight begins with; None: a small one, or none.

    A base that floats freely has no desired attitude. ``settings`` of the plant have the robot's
    place at tick 0.
    """
    (wanted,) = mission.chunk(0, 1).references()
    angle = rate = 0.0
    if settings.controls_base:
        quaternion = np.array(settings.initial_quaternion) / norm(settings.initial_quaternion)
        angle = math.degrees(2.0 * math.acos(min(1.0, abs(quaternion @ wanted["quaternion"]))))
        rate = float(norm(settings.initial_rate_deg_s - np.degrees(wanted["omega_base"])))
    errors = robot.from_degrees(settings.initial_joints_deg) - wanted["joint_positions"]
    small = np.where(robot.is_prismatic[: robot.n], SMALL_M, math.radians(SMALL_DEG))
    farthest = int(np.argmax(np.abs(errors) / small))
    step = StartStep(angle if angle > SMALL_DEG else 0.0, rate if rate > SMALL_RATE_DEG_S else 0.0)
    if abs(errors[farthest]) > small[farthest]:
        unit = "m" if robot.is_prismatic[farthest] else "rad"
        step = step._replace(
            joint=robot.joint_names[farthest], joint_error=float(errors[farthest]), unit=unit
        )
    return None if step == StartStep() else step


def sentence(step: Mapping[str, Any]) -> str:
    """Return a sentence that describes a `StartStep`, given as a mapping."""
    places = []
    if step["attitude_deg"]:
        places.append(f"the base's attitude is {step['attitude_deg']:.3g} deg")
    if step["rate_deg_s"]:
        places.append(f"the base's rate is {step['rate_deg_s']:.3g} deg/s")
    if step["joint"]:
        is_angle = step["unit"] == "rad"
        error = math.degrees(step["joint_error"]) if is_angle else step["joint_error"]
        places.append(f"{step['joint']} is {error:.3g} {'deg' if is_angle else 'm'}")
    return (
        f"start: {' and '.join(places)} from where the mission begins: begin both at one place "
        "(the mission's start, or initial_quaternion, initial_rate_deg_s, initial_joints_deg), "
        "let the first segment lead the base, or limit the torques"
    )
