"""Step from the robot's start to the start of its mission, and its demand on the law."""

from __future__ import annotations

import copy
import math
from collections.abc import Callable, Mapping
from contextlib import suppress
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from space_robot_control.controller.controller import Controller
from space_robot_control.controller.law_choice import NoLaw
from space_robot_control.guidance.mission import Mission
from space_robot_control.laws import ControlLaw
from space_robot_model.elementary.matrices import norm
from space_robot_model.robot import Robot
from space_robot_model.robot.dynamics import free_inverse_dynamics, inverse_dynamics
from space_robot_msgs_py.errors import FlightError
from space_robot_sim.environment.friction import coefficients
from space_robot_sim.plant.plant import Plant, PlantSettings

Array = NDArray[np.float64]

ROUNDING = 1e-6
"""rad or m; what differs by less is the same place."""
MOST_TIMES = 3.0
"""Ratio to the mission's demand from which a warning is given."""
REHEARSAL_S = 0.1
"""Simulated time flown to measure the commands of the law, s."""
SAMPLES = 300
"""Points of the mission whose torque is computed."""


class StartStep(NamedTuple):
    """Step from the robot's configuration at tick 0 to the mission's."""

    attitude_deg: float
    """Angle between the base's attitude and the desired one; 0 of a base that floats freely."""
    joint: str
    """The joint that is farthest from its desired position; empty: none is anywhere else."""
    joint_error: float
    """Its error, rad (of a prismatic joint m)."""
    unit: str
    """Of ``joint_error``: "rad" or "m"."""
    law: str
    """Law in force at the start."""
    axis: str
    """The axis with the largest torque of those that are asked too much."""
    demand: float
    """Largest torque that the law commands there in the first `REHEARSAL_S`, N m (of a prismatic
    joint N)."""
    planned: float
    """Largest torque there of the mission alone, N m: inverse dynamics along its reference, and the
    joint's friction."""
    rate_deg_s: float = 0.0
    """Length of the base's angular velocity less the desired one; 0 of a base that floats freely.
    """


def sentence(step: Mapping[str, Any]) -> str:
    """Return a sentence that describes a `StartStep`, given as a mapping."""
    error, unit = (
        (math.degrees(step["joint_error"]), "deg")
        if step["unit"] == "rad"
        else (step["joint_error"], "m")
    )
    places = []
    if step["attitude_deg"]:
        places.append(f"the base's attitude is {step['attitude_deg']:.3g} deg")
    if step["rate_deg_s"]:
        places.append(f"the base's rate is {step['rate_deg_s']:.3g} deg/s")
    if step["joint"]:
        places.append(f"{step['joint']} is {error:.3g} {unit}")
    return (
        f"start: {' and '.join(places)} from where the mission begins: {step['law']} commands "
        f"{step['demand']:.3g} N m on {step['axis']}, where the mission asks for "
        f"{step['planned']:.3g} N m at most; begin both at one place (the mission's start, or "
        "initial_quaternion, initial_rate_deg_s, initial_joints_deg), let the first segment lead "
        "the base, or limit the torques"
    )


def start_step(
    robot: Robot,
    settings: PlantSettings,
    mission: Mission,
    law: ControlLaw,
    build_controller: Callable[[ControlLaw], Controller],
    period: float,
    ticks: int,
) -> StartStep | None:
    """Return the step that a flight begins with, if the law commands much more than the mission.

    Args:
        robot: that flies.
        settings: of the plant, with the robot's place at tick 0.
        mission: to be flown.
        law: in force at the start; it is left alone.
        build_controller: returns a controller for a law.
        period: s.
        ticks: of the flight.

    Returns:
        The step; None if there is none, if it asks for little, or if no law flies.
    """
    wanted = mission.chunk(0, 1).references()
    quaternion = np.array(settings.initial_quaternion) / norm(settings.initial_quaternion)
    cosine = min(1.0, abs(float(quaternion @ wanted["quaternion"][0])))
    angle = 2.0 * math.acos(cosine) if settings.controls_base else 0.0
    if angle <= ROUNDING:
        angle = 0.0
    rate = norm(np.radians(settings.initial_rate_deg_s) - wanted["omega_base"][0])
    if rate <= ROUNDING or not settings.controls_base:
        rate = 0.0
    errors = robot.from_degrees(settings.initial_joints_deg) - wanted["joint_positions"][0]
    farthest = int(np.argmax(np.abs(errors)))
    is_elsewhere = bool(abs(errors[farthest]) > ROUNDING)
    if law.name == NoLaw.name or not (angle or rate or is_elsewhere):
        return None
    plant, controller = Plant(robot, settings, period), build_controller(copy.deepcopy(law))
    demand = _rehearse(plant, controller, mission, min(ticks, max(1, round(REHEARSAL_S / period))))
    planned = _planned(robot, settings, mission, period)
    planned[:3] = planned[:3].max()  # the base may be turned about any axis
    excess = np.where(demand > MOST_TIMES * planned, demand, 0.0)
    axis = int(np.argmax(excess))
    if not excess[axis]:
        return None
    return StartStep(
        math.degrees(angle),
        robot.joint_names[farthest] if is_elsewhere else "",
        float(errors[farthest]) if is_elsewhere else 0.0,
        "m" if robot.is_prismatic[farthest] else "rad",
        law.name,
        robot.axis_names[axis],
        float(demand[axis]),
        float(planned[axis]),
        math.degrees(rate),
    )


def _rehearse(plant: Plant, controller: Controller, mission: Mission, ticks: int) -> Array:
    """Fly the first ``ticks`` and return the largest command of each axis (m,), N m."""
    references = mission.chunk(0, ticks).references()
    largest = np.zeros(len(plant.names.axes))
    with suppress(FlightError):  # it is the flight that has to tell
        for tick in range(ticks):
            command = controller.update(plant.state, references[tick : tick + 1])
            np.maximum(largest, np.abs(command.torque[: len(largest)]), out=largest)
            plant.step(command)
    return largest


def _planned(robot: Robot, settings: PlantSettings, mission: Mission, period: float) -> Array:
    """Return the largest torque of each axis along the mission's reference, with friction (m,)."""
    ticks = np.unique(np.linspace(0.0, mission.duration / period, SAMPLES).astype(int))
    references = np.concatenate([mission.chunk(int(tick), 1).references() for tick in ticks])
    torque = inverse_dynamics if settings.controls_base else free_inverse_dynamics
    largest: Array = np.abs(torque(robot.nominal, references)).max(axis=0)
    n, friction = robot.n, coefficients(robot, settings.friction)
    rates = np.abs(references["joint_velocities"]).max(axis=0)
    largest[3:] += friction[:n, 0] + friction[:n, 1] * rates
    return largest
