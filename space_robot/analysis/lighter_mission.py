"""A mission that asks less of the base: bent legs, tools with the least momentum, longer segments.

With k times the duration a segment from rest to rest asks for 1/k of the momentum and 1/k^2 of the
torque: see `space_robot_control.guidance.demand`.

The momentum of the joints' motion depends on the path between two postures: bent, the joints also
move in the reaction null space, and take the rest of their way where the coupling is small.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

import numpy as np
import yaml
from numpy.typing import NDArray

from space_robot_control.guidance.courses import BentLeg, Course, Piece, QuinticLeg
from space_robot_control.guidance.demand import demand
from space_robot_control.guidance.limits import check_piece
from space_robot_control.guidance.mission import Mission, MissionSettings
from space_robot_control.guidance.segments import HoldSegment, read_segments
from space_robot_model.robot import Robot
from space_robot_msgs_py.config.yaml_text import parse_yaml
from space_robot_msgs_py.errors import InputError

from ..flight.mission_demand import MOTION

Array = NDArray[np.float64]

BENDS = 2
"""Number of sines."""
SAMPLES = 80
"""Of the path during the search."""
NORM = 8
"""Exponent of the norm over time that stands for the maximum, so that it has derivatives."""
COST = 1e-4
"""Of the square of the bends, rad or m, beside a demand of 1: they are not larger than of use."""
STEPS = 60
BEND_DIGITS = 3
"""Bends are rounded to this many digits, degrees."""
WORTHWHILE = 0.98
"""Share of the demand that is left, above which a leg stays straight."""
BETWEEN_SAMPLES = 1.0 + 1e-5
"""Factor on durations, since a longer segment is sampled at other places, nearer to its peak."""
DIGITS = 3
"""Durations are rounded up to this many digits behind the point, s."""


def stretched_mission(
    settings: MissionSettings,
    report: Mapping[str, Any],
    base_torque: float | None,
    momentum: float | None,
) -> MissionSettings:
    """Return the mission with every segment as long as the limits ask for, or as it is if longer.

    Torques from outside count for nothing: that of gravity does not fall with longer durations.

    Args:
        settings: of the mission.
        report: its `space_robot.analysis.mission_plan.plan_report`.
        base_torque: limit of every component of the base's torque, N m; None: none.
        momentum: limit of the angular momentum that the base takes up, N m s; None: none.
    """
    spans = []
    for segment in report["segments"]:
        factor, motion = 1.0, segment["sources"][MOTION]
        if base_torque is not None:
            factor = max(factor, float(np.sqrt(motion["base_torque"] / base_torque)))
        if momentum is not None:
            factor = max(factor, motion["momentum"] / momentum)
        span = segment["duration_s"] * (factor if factor == 1.0 else factor * BETWEEN_SAMPLES)
        spans.append(span if factor == 1.0 else float(np.ceil(span * 10**DIGITS) / 10**DIGITS))
    pairs = zip(settings.written_segments, spans, strict=True)
    return settings.model_copy(update={"segments": [_of_duration(*pair) for pair in pairs]})


def lightened_mission(
    robot: Robot, mission: Mission, settings: MissionSettings, of_torque: bool
) -> MissionSettings:
    """Return a mission that asks less of the base in the same time.

    Legs of the joints get the bends of `best_bends`, tools are led with ``least: momentum``.

    Args:
        robot: as the flight software knows it.
        mission: the plan.
        settings: of the mission.
        of_torque: whether the largest torque is to fall; else the largest momentum.
    """
    segments = []
    for text, piece in zip(settings.written_segments, mission.pieces, strict=True):
        segments.append(json.dumps(_lightened(robot, piece, parse_yaml(text), of_torque)))
    return settings.model_copy(update={"segments": segments})


def _lightened(
    robot: Robot, piece: Piece, content: dict[str, Any], of_torque: bool
) -> dict[str, Any]:
    if content.get("base") == "free":
        return content
    if "tool" in content:
        return {**content, "tool": {**content["tool"], "least": "momentum"}}
    if not isinstance(piece.joints, QuinticLeg) or "joints_deg" not in content:
        return content
    leg = BentLeg(*piece.joints, np.zeros((0, robot.n)))
    bends, share = best_bends(robot, leg, piece.base, of_torque)
    bent = leg._replace(bends=np.array([robot.from_degrees(bend) for bend in bends]))
    try:
        check_piece(robot, piece._replace(joints=bent))
    except InputError:  # the bends lead beyond the limits of a joint
        return content
    return {**content, "bends_deg": bends} if share < WORTHWHILE else content


def _of_duration(text: str, span: float) -> str:
    content = parse_yaml(text)
    (segment,) = read_segments([text])
    if not isinstance(segment, HoldSegment):
        content["duration"] = span
    return json.dumps(content)


def mission_text(settings: MissionSettings) -> str:
    """Return a mission as a document in YAML."""
    base: dict[str, Any] = {"quaternion": settings.base_quaternion}
    if any(settings.base_rate_deg_s):
        base["rate_deg_s"] = settings.base_rate_deg_s
    if settings.base_point.strip():
        base = parse_yaml(settings.base_point)
    start = {"joints_deg": settings.joints_deg, "base": base}
    segments = [parse_yaml(text) for text in settings.written_segments]
    document = {"mission": {"start": start, "segments": segments}}
    return yaml.safe_dump(document, sort_keys=False, default_flow_style=None, width=100)


def best_bends(
    robot: Robot, leg: BentLeg, base: Course, of_torque: bool
) -> tuple[list[list[float]], float]:
    """Return bends in degrees (m for prismatic joints), and what is left of the demand, as a share.

    Args:
        robot: as the flight software knows it.
        leg: a leg, whose own bends do not count.
        base: course of the base during the leg.
        of_torque: whether the largest torque on the base is to fall; else the largest momentum.
    """
    from scipy.optimize import minimize  # slow to import

    shape = (BENDS, len(leg.start))

    def asked(bends: Array, samples: int = 0) -> Array:
        course = leg._replace(bends=bends.reshape(shape))
        end = leg.begin + leg.span
        sampled = demand(robot.nominal, course, base, leg.begin, end, samples)
        return sampled.base_torque if of_torque else sampled.stored_momentum

    scale = float(asked(np.zeros(shape)).max())
    if scale == 0.0:
        return [], 1.0

    def cost(bends: Array) -> float:
        shares = asked(bends, SAMPLES) / scale
        return float(np.mean(shares**NORM) ** (1.0 / NORM) + COST * bends @ bends)

    solution = minimize(
        cost, np.zeros(BENDS * shape[1]), method="L-BFGS-B", options={"maxiter": STEPS}
    )
    degrees = [
        np.round(robot.to_degrees(bend), BEND_DIGITS).tolist() for bend in solution.x.reshape(shape)
    ]
    bends = np.array([robot.from_degrees(bend) for bend in degrees])
    return degrees, float(asked(bends).max()) / scale
