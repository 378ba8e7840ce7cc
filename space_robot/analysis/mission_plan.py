"""What a mission asks of joints and base, before it is flown."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from contextlib import suppress
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from space_robot_control.allocation.settings import assumed_actuators
from space_robot_control.guidance.courses import Piece
from space_robot_control.guidance.demand import MotionDemand
from space_robot_control.guidance.mission import Mission
from space_robot_model.elementary.matrices import norms
from space_robot_model.hardware.base_actuators import BaseActuatorSettings
from space_robot_model.robot import Robot
from space_robot_model.robot.kinematics import tool_state
from space_robot_msgs_py.config.installation import config_directory
from space_robot_msgs_py.errors import InputError
from space_robot_sim.environment.orbit import OrbitSettings

from ..flight.mission_demand import PieceDemand, SourceDemand, excess, mission_demand

Array = NDArray[np.float64]

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
    def of_base(self) -> SourceDemand:
        """What the base's actuators give, whatever the source."""
        stored = self.demand.stored_momentum
        torque = float(np.max(self.demand.base_torque))
        return SourceDemand(torque, float(stored.max()), float(stored[-1]))


class Feasibility(NamedTuple):
    """Whether actuators of the base give what a mission asks for."""

    actuators: str
    is_feasible: bool
    torque: float
    """Largest torque asked, as a share of what they give in that direction."""
    momentum: float
    """Largest momentum asked, as a share of what they hold; 0: they need not hold any."""
    complaint: str
    """What is asked too much, where and when; empty: nothing is."""


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

    Raises:
        InputError: it has no segments.
    """
    if not mission.duration:
        raise InputError("the mission has no motion to plan: no segments")
    nominal = robot.nominal
    demands = mission_demand(robot, mission.pieces, orbit or OrbitSettings(), start_rate)
    return [_planned(asked, nominal) for asked in demands]


def _planned(of_piece: PieceDemand, robot: Robot) -> PlannedSegment:
    asked = of_piece.asked
    rows = np.unique(np.linspace(0, len(asked.time) - 1, POSTURES).astype(int))
    tools = [tool_state(robot, asked.base[k, :4], asked.joints[k, 0]) for k in rows]
    smallest = [
        min(_smallest(tool.held, tool.position + tool.centre_of_mass) for tool in tools),
        min(_smallest(tool.free, tool.position + tool.centre_of_mass) for tool in tools),
    ]
    return PlannedSegment(*of_piece, np.array([tool.position for tool in tools]), *smallest)


def _smallest(jacobian: Array, lever: Array) -> float:
    scaled = jacobian.copy()
    scaled[:3] /= max(1e-6, math.sqrt(float(lever @ lever)))
    return float(np.linalg.svd(scaled, compute_uv=False)[-1])


def feasibility(
    robot: Robot, segments: Sequence[PlannedSegment], chosen: Mapping[str, BaseActuatorSettings]
) -> list[Feasibility]:
    """Return whether actuators give what a mission asks for: the chosen ones, and those shipped."""
    sets = {name: hardware for name, hardware in chosen.items() if _is_limited(hardware)}
    for file in sorted((config_directory() / "actuators").glob("*.yaml")):
        with suppress(InputError):  # not for this robot
            hardware = assumed_actuators(file.stem, robot)
            if _is_limited(hardware) and hardware not in sets.values():
                sets[file.stem] = hardware
    demands = [PieceDemand(*segment[:3]) for segment in segments]
    judged = ((name, excess(hardware, demands)) for name, hardware in sets.items())
    return [Feasibility(name, not of.complaint, *of) for name, of in judged]


def _is_limited(hardware: BaseActuatorSettings) -> bool:
    return hardware.base_actuation == "hardware"


def plan_report(
    robot: Robot,
    segments: Sequence[PlannedSegment],
    chosen: Mapping[str, BaseActuatorSettings] | None = None,
) -> dict[str, Any]:
    """Return the plan as numbers and texts: segments, demands, limits, actuators.

    Args:
        robot: as the flight software knows it.
        segments: of its mission.
        chosen: actuators to be judged before those shipped, by name; ``refused`` says what the
            mission asks too much of them.
    """
    chosen = chosen or {}
    judged = feasibility(robot, segments, chosen)
    by_source = {
        name: _over_all([segment.sources[name] for segment in segments])
        for name in segments[0].sources
    }
    return {
        "duration_s": segments[-1].piece.end,
        **_over_all([segment.of_base for segment in segments])._asdict(),
        "sources": {name: of._asdict() for name, of in by_source.items()},
        "segments": [_row(robot, number, s) for number, s in enumerate(segments, 1)],
        "joints": joint_margins(robot, [segment.demand for segment in segments]),
        "actuators": [of._asdict() for of in judged],
        "refused": "; ".join(of.complaint for of in judged if of.actuators in chosen),
    }


def _over_all(demands: Sequence[SourceDemand]) -> SourceDemand:
    torque, momentum, ends = zip(*demands, strict=True)
    return SourceDemand(max(torque), max(momentum), ends[-1])


def _row(robot: Robot, number: int, segment: PlannedSegment) -> dict[str, Any]:
    piece, joints = segment.piece, segment.demand.joints
    rates = np.max(np.abs(joints[:, 1]), axis=0)
    return {
        "segment": number,
        "motion": piece.motion,
        "begin_s": piece.begin,
        "duration_s": piece.end - piece.begin,
        **segment.of_base._asdict(),
        "sources": {name: of._asdict() for name, of in segment.sources.items()},
        "joint_rates": dict(zip(robot.joint_names, rates.tolist(), strict=True)),
        "goal_deg": robot.to_degrees(piece.goal).tolist(),
        "attitude": piece.attitude.tolist(),
        "tool_travel_m": float(np.sum(norms(np.diff(segment.tool, axis=0)))),
        "singular_value": segment.singular_value,
        "free_singular_value": segment.free_singular_value,
    }


def joint_margins(robot: Robot, demands: Sequence[MotionDemand]) -> dict[str, Any]:
    """Return the joints that come nearest to their limits of position, velocity and effort.

    Args:
        robot: with limits of its joints.
        demands: of the segments of a mission.

    Returns:
        By kind of limit ``joint``, ``time_s`` and ``share``: 1 at the limit; positions count from
        the middle of the joint's range. A kind that no joint has a limit of is missing.
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
