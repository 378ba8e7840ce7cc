"""What a mission asks of joints and base, before it is flown."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from space_robot_control.allocation.assumed_actuators import assumed_actuators
from space_robot_control.guidance.courses import Piece
from space_robot_control.guidance.demand import MotionDemand, demand
from space_robot_control.guidance.mission import Mission
from space_robot_control.guidance.tool_path import ToolFollower
from space_robot_model.elementary.least_squares import singular_values
from space_robot_model.elementary.matrices import norms
from space_robot_model.hardware.base_actuators import BaseActuatorSettings
from space_robot_model.hardware.capability import limits_of, shares_of
from space_robot_model.robot import Robot
from space_robot_msgs_py.config.directory import config_directory
from space_robot_msgs_py.errors import InputError

from .joint_margins import joint_margins

Array = NDArray[np.float64]

POSTURES = 51
"""Postures of a segment at which singular values are computed."""


class PlannedSegment(NamedTuple):
    """A segment and what it asks for, with zero momentum and without friction."""

    piece: Piece
    demand: MotionDemand
    tool: Array
    """(K, 3) m, positions of the tool from the robot's centre of mass, inertial axes."""
    singular_value: float
    """Smallest singular value of the tool's Jacobian, attitude held, lengths in units of the
    distance between tool and base: 0 in a singular posture."""
    free_singular_value: float
    """The same with a free base: 0 in a dynamic singularity."""

    @property
    def base_torque(self) -> float:
        """N m, largest component on the base's axes."""
        return float(np.max(self.demand.base_torque))

    @property
    def momentum(self) -> float:
        """N m s, largest angular momentum that the base's actuators take up."""
        return float(np.max(self.demand.stored_momentum))


class Feasibility(NamedTuple):
    """Whether actuators of the base give what a mission asks for."""

    actuators: str
    is_feasible: bool
    torque: float
    """Largest torque asked, as a share of what they give about that axis; NaN: not known."""
    momentum: float
    """Largest momentum asked, as a share of what they hold; 0: they need not hold any."""


def planned_segments(robot: Robot, mission: Mission) -> list[PlannedSegment]:
    """Return all pieces of a mission with their demands.

    Args:
        robot: as the flight software knows it.
        mission: the plan.

    Raises:
        InputError: it has a single waypoint.
    """
    if not mission.duration:
        raise InputError("the mission has no motion to plan: a single waypoint")
    nominal = robot.nominal
    follower = ToolFollower(nominal, None)
    return [_planned(nominal, piece, follower) for piece in mission.pieces]


def _planned(robot: Robot, piece: Piece, follower: ToolFollower) -> PlannedSegment:
    asked = demand(robot, piece.joints, piece.base, piece.begin, piece.end)
    rows = np.unique(np.linspace(0, len(asked.time) - 1, POSTURES).astype(int))
    poses = [follower.pose(asked.base[k, :4], asked.joints[k, 0]) for k in rows]
    smallest = [
        min(_smallest(pose.jacobian, pose.from_base) for pose in poses),
        min(_smallest(pose.free_jacobian, pose.from_base) for pose in poses),
    ]
    return PlannedSegment(piece, asked, np.array([pose.position for pose in poses]), *smallest)


def _smallest(jacobian: Array, lever: Array) -> float:
    scaled = jacobian.copy()
    scaled[:3] /= max(1e-6, math.sqrt(float(lever @ lever)))
    values = singular_values(scaled) if jacobian.shape[1] >= 6 else singular_values(scaled.T)
    return float(values[0])


def feasibility(robot: Robot, segments: list[PlannedSegment]) -> list[Feasibility]:
    """Return for each of the shipped actuators whether they give what a mission asks for."""
    torque = np.vstack([segment.demand.torque[:, :3] for segment in segments])
    momentum = np.vstack([segment.demand.base_momentum for segment in segments])
    judged = []
    for file in sorted((config_directory() / "actuators").glob("*.yaml")):
        try:
            hardware = assumed_actuators(file.stem, robot)
        except InputError:  # not for this robot
            continue
        if hardware.base_actuation == "hardware":
            judged.append(_judged(file.stem, hardware, torque, momentum))
    return judged


def _judged(
    name: str, hardware: BaseActuatorSettings, torque: Array, momentum: Array
) -> Feasibility:
    of_torque, of_momentum = (
        float(shares_of(limit, asked).max())
        for limit, asked in zip(limits_of(hardware), (torque, momentum), strict=True)
    )
    return Feasibility(name, max(of_torque, of_momentum) <= 1.0, of_torque, of_momentum)


def plan_report(robot: Robot, segments: list[PlannedSegment]) -> dict[str, Any]:
    """Return the plan as numbers and texts: segments, demands, limits, actuators."""
    return {
        "duration_s": segments[-1].piece.end,
        "base_torque": max(segment.base_torque for segment in segments),
        "momentum": max(segment.momentum for segment in segments),
        "segments": [_row(robot, number, s) for number, s in enumerate(segments, 1)],
        "joints": joint_margins(robot, [segment.demand for segment in segments]),
        "actuators": [judged._asdict() for judged in feasibility(robot, segments)],
    }


def _row(robot: Robot, number: int, segment: PlannedSegment) -> dict[str, Any]:
    piece, joints = segment.piece, segment.demand.joints
    rates = np.max(np.abs(joints[:, 1]), axis=0)
    return {
        "segment": number,
        "motion": piece.motion,
        "begin_s": piece.begin,
        "duration_s": piece.end - piece.begin,
        "base_torque": segment.base_torque,
        "momentum": segment.momentum,
        "joint_rates": dict(zip(robot.joint_names, rates.tolist(), strict=True)),
        "goal_deg": robot.to_degrees(piece.goal).tolist(),
        "attitude": piece.attitude.tolist(),
        "tool_travel_m": float(np.sum(norms(np.diff(segment.tool, axis=0)))),
        "singular_value": segment.singular_value,
        "free_singular_value": segment.free_singular_value,
    }
