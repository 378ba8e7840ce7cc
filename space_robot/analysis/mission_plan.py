"""What a mission asks of joints and base, before it is flown."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from contextlib import suppress
from typing import Any, NamedTuple

import numpy as np
import yaml

from space_robot_control.allocation.settings import assumed_actuators
from space_robot_control.guidance.courses import BentLeg, Course, Piece, QuinticLeg
from space_robot_control.guidance.demand import MotionDemand, demand
from space_robot_control.guidance.limits import check_piece
from space_robot_control.guidance.mission import Mission, MissionSettings
from space_robot_control.guidance.segments import HoldSegment, read_segments
from space_robot_model.elementary.matrices import Array, norms
from space_robot_model.hardware.base_actuators import BaseActuatorSettings
from space_robot_model.robot import Robot
from space_robot_model.robot.kinematics import tool_state
from space_robot_msgs_py.config.installation import config_directory
from space_robot_msgs_py.config.yaml_text import parse_yaml
from space_robot_msgs_py.errors import InputError
from space_robot_sim.environment.orbit import OrbitSettings

from ..flight.mission_demand import MOTION, PieceDemand, SourceDemand, excess, mission_demand

POSTURES = 51
"""Postures of a segment at which singular values are computed."""


class PlannedSegment(NamedTuple):
    """A segment and what it asks for, without friction."""

    piece: Piece
    demand: MotionDemand
    """Of the actuators: in an orbit less what the torques from outside give."""
    sources: Mapping[str, SourceDemand]
    """See `space_robot.flight.mission_demand.PieceDemand`."""
    tool: Array
    """(K, 3) m, positions of the tool from the robot's centre of mass, inertial axes."""
    singular_value: float
    """Smallest singular value of the tool's Jacobian, attitude held, lengths in units of the
    distance between tool and base: 0 in a singular posture."""
    free_singular_value: float
    """The same with a free base: 0 in a dynamic singularity."""

    @property
    def whole_demand(self) -> SourceDemand:
        """What the base's actuators give, whatever the source."""
        stored = self.demand.stored_momentum
        torque = float(np.max(self.demand.base_torque))
        return SourceDemand(torque, float(stored.max()), float(stored[-1]))


def planned_segments(
    robot: Robot,
    mission: Mission,
    orbit: OrbitSettings | None = None,
    start_rate: Array | None = None,
) -> list[PlannedSegment]:
    """Return all pieces of a mission with their demands.

    Args:
        robot: as the flight software knows it.
        mission: the plan.
        orbit: with the torques from outside; None: there are none.
        start_rate: see `mission_demand`.
    """
    if not mission.duration:
        raise InputError("the mission has no motion to plan: no segments")
    demands = mission_demand(robot, mission.pieces, orbit or OrbitSettings(), start_rate)
    return [_with_postures(piece_demand, robot.nominal) for piece_demand in demands]


def _with_postures(piece_demand: PieceDemand, robot: Robot) -> PlannedSegment:
    asked = piece_demand.asked
    rows = np.unique(np.linspace(0, len(asked.time) - 1, POSTURES).astype(int))
    tools = [tool_state(robot, asked.base[k, :4], asked.joints[k, 0]) for k in rows]
    smallest = [
        min(_smallest(tool.held, tool.position + tool.centre_of_mass) for tool in tools),
        min(_smallest(tool.free, tool.position + tool.centre_of_mass) for tool in tools),
    ]
    return PlannedSegment(*piece_demand, np.array([tool.position for tool in tools]), *smallest)


def _smallest(jacobian: Array, lever: Array) -> float:
    scaled = jacobian.copy()
    scaled[:3] /= max(1e-6, math.sqrt(float(lever @ lever)))
    return float(np.linalg.svd(scaled, compute_uv=False)[-1])


def _judged_actuators(
    robot: Robot, segments: Sequence[PlannedSegment], chosen: Mapping[str, BaseActuatorSettings]
) -> list[dict[str, Any]]:
    sets = dict(chosen)
    for file in sorted((config_directory() / "actuators").glob("*.yaml")):
        with suppress(InputError):  # not for this robot
            hardware = assumed_actuators(file.stem, robot)
            if hardware not in sets.values():
                sets[file.stem] = hardware
    demands = [PieceDemand(*segment[:3]) for segment in segments]
    judged = {
        name: excess(hardware, demands)
        for name, hardware in sets.items()
        if hardware.base_actuation == "hardware"
    }
    return [
        {"actuators": name, "is_feasible": not most.complaint, **most._asdict()}
        for name, most in judged.items()
    ]


def plan_report(
    robot: Robot,
    segments: Sequence[PlannedSegment],
    chosen: Mapping[str, BaseActuatorSettings] | None = None,
) -> dict[str, Any]:
    """Return the plan as numbers and texts: segments, demands, limits, actuators.

    The robot is as the flight software knows it. ``chosen``: actuators to be judged before those
    shipped, by name; ``refused`` says what the mission asks too much of them.
    """
    chosen = chosen or {}
    judged = _judged_actuators(robot, segments, chosen)
    sources = segments[0].sources
    return {
        "duration_s": segments[-1].piece.end,
        **_over_all([segment.whole_demand for segment in segments]),
        "sources": {name: _over_all([s.sources[name] for s in segments]) for name in sources},
        "segments": [_row(robot, number, s) for number, s in enumerate(segments, 1)],
        "joints": joint_margins(robot, [segment.demand for segment in segments]),
        "actuators": judged,
        "refused": "; ".join(j["complaint"] for j in judged if j["actuators"] in chosen),
    }


def _over_all(demands: Sequence[SourceDemand]) -> dict[str, float]:
    torque, momentum, ends = zip(*demands, strict=True)
    return SourceDemand(max(torque), max(momentum), ends[-1])._asdict()


def _row(robot: Robot, number: int, segment: PlannedSegment) -> dict[str, Any]:
    piece, joints = segment.piece, segment.demand.joints
    rates = np.max(np.abs(joints[:, 1]), axis=0)
    return {
        "segment": number,
        "motion": piece.motion,
        "begin_s": piece.begin,
        "duration_s": piece.end - piece.begin,
        **segment.whole_demand._asdict(),
        "sources": {name: demand._asdict() for name, demand in segment.sources.items()},
        "joint_rates": dict(zip(robot.joint_names, rates.tolist(), strict=True)),
        "goal_deg": robot.to_degrees(piece.goal).tolist(),
        "attitude": piece.attitude.tolist(),
        "tool_travel_m": float(np.sum(norms(np.diff(segment.tool, axis=0)))),
        "singular_value": segment.singular_value,
        "free_singular_value": segment.free_singular_value,
    }


def joint_margins(robot: Robot, demands: Sequence[MotionDemand]) -> dict[str, Any]:
    """Return the joints that come nearest to their limits in a mission, by the kind of limit.

    Each is ``joint``, ``time_s`` and ``share``: 1 at the limit; positions count from the middle of
    the joint's range. A kind that no joint has a limit of is missing.
    """
    time = np.concatenate([part.time for part in demands])
    joints = np.concatenate([part.joints for part in demands])
    effort = np.concatenate([part.torque[:, 3:] for part in demands])
    lower, upper, fastest, strongest = (
        np.array([getattr(limits, name) for limits in robot.limits])
        for name in ("lower", "upper", "velocity", "effort")
    )
    has_range = np.isfinite(upper - lower)
    middle = 0.5 * (np.where(has_range, lower, 0.0) + np.where(has_range, upper, 0.0))
    shares = {
        "position": (joints[:, 0] - middle) / np.where(has_range, upper - middle, np.inf),
        "velocity": joints[:, 1] / fastest,
        "effort": effort / strongest,
    }
    margins = {}
    for kind, limits in zip(shares, (upper - lower, fastest, strongest), strict=True):
        if np.isfinite(limits).any():
            values = np.abs(shares[kind])
            k, joint = np.unravel_index(int(np.argmax(values)), values.shape)
            margins[kind] = {
                "joint": robot.joint_names[int(joint)],
                "time_s": float(time[k]),
                "share": float(values[k, joint]),
            }
    return margins


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
    return settings.model_copy(update={"segments": [_with_duration(*pair) for pair in pairs]})


def lightened_mission(
    robot: Robot, mission: Mission, settings: MissionSettings, by_torque: bool
) -> MissionSettings:
    """Return a mission that asks less of the base in the same time.

    Legs of the joints get the bends of `best_bends`, tools are led with ``least: momentum``.
    ``robot`` is as the flight software knows it; ``by_torque``: whether the largest torque is to
    fall, else the largest momentum.
    """
    segments = []
    for text, piece in zip(settings.written_segments, mission.pieces, strict=True):
        segments.append(json.dumps(_lightened(robot, piece, parse_yaml(text), by_torque)))
    return settings.model_copy(update={"segments": segments})


def _lightened(
    robot: Robot, piece: Piece, content: dict[str, Any], by_torque: bool
) -> dict[str, Any]:
    if content.get("base") == "free":
        return content
    if "tool" in content:
        return {**content, "tool": {**content["tool"], "least": "momentum"}}
    if not isinstance(piece.joints, QuinticLeg) or "joints_deg" not in content:
        return content
    leg = BentLeg(*piece.joints, np.zeros((0, robot.n)))
    bends, share = best_bends(robot, leg, piece.base, by_torque)
    bent = leg._replace(bends=np.array([robot.from_degrees(bend) for bend in bends]))
    try:
        check_piece(robot, piece._replace(joints=bent))
    except InputError:  # the bends lead beyond the limits of a joint
        return content
    return {**content, "bends_deg": bends} if share < WORTHWHILE else content


def _with_duration(text: str, span: float) -> str:
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
    robot: Robot, leg: BentLeg, base: Course, by_torque: bool
) -> tuple[list[list[float]], float]:
    """Return bends in degrees (m for prismatic joints), and what is left of the demand, as a share.

    The leg's own bends do not count; ``base``: course of the base during the leg; ``by_torque`` as
    in `lightened_mission`.
    """
    from scipy.optimize import minimize  # slow to import

    shape = (BENDS, len(leg.start))

    def asked(bends: Array, samples: int = 0) -> Array:
        course = leg._replace(bends=bends.reshape(shape))
        end = leg.begin + leg.span
        sampled = demand(robot.nominal, course, base, leg.begin, end, samples)
        return sampled.base_torque if by_torque else sampled.stored_momentum

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
