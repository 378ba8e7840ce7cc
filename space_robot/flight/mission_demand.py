"""What a mission asks of the base's actuators along its reference, its orbit's torques included.

Orbit and torques are those of the plant's own kernels. The actuators give what the motion needs and
the torques from outside do not: ``tau = L' - tau_e``, with L the robot's angular momentum.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from space_robot_control.guidance.courses import FEWEST_KNOTS, MOST_KNOTS, Piece, sample_times
from space_robot_control.guidance.demand import MotionDemand, demand
from space_robot_control.guidance.segments import Segment, ToolSegment, read_segments
from space_robot_model.elementary.matrices import Array, norms
from space_robot_model.hardware.base_actuators import BaseActuatorSettings
from space_robot_model.orbit.ephemeris import AssumedOrbit, Ephemeris
from space_robot_model.robot import Robot
from space_robot_model.robot.momentum import Motion, robot_momentum
from space_robot_model.robot.placements import base_axes, to_base
from space_robot_msgs_py.compiled.records import assign
from space_robot_msgs_py.errors import InputError
from space_robot_msgs_py.samples import SOURCES, RobotState
from space_robot_msgs_py.topics import BASE_AXES
from space_robot_sim.component import Installation
from space_robot_sim.environment.environment import Environment, EnvironmentSettings
from space_robot_sim.environment.orbit import OrbitSettings
from space_robot_sim.plant.tick import REPORT_TICKS, PlantMemory, update_true_state

from ..scenario.resolved import ResolvedScenario
from .capability import actuator_load, carried_momentum

MOST_SAMPLES = 200_000
"""Samples of all segments together, beside the fewest that each has."""
OUTSIDE_S = 5.0
"""Spacing of the samples of torques from outside in a long segment, s."""
MOTION = "motion"
"""The source of the demand that is no torque from outside."""


class SourceDemand(NamedTuple):
    """What actuators give because of a source."""

    base_torque: float
    """Largest component on the base's axes, N m."""
    momentum: float
    """Largest angular momentum since the start of the mission, N m s."""
    momentum_end: float
    """That at the end, N m s."""


class PieceDemand(NamedTuple):
    """A piece of a mission and what it asks for, without friction."""

    piece: Piece
    asked: MotionDemand
    """Torque and momentum of the base are what actuators have to give: the momentum since the start
    of the mission."""
    sources: Mapping[str, SourceDemand]
    """By `MOTION`, and in an orbit by `SOURCES`."""


def mission_demand(
    robot: Robot, pieces: Sequence[Piece], orbit: OrbitSettings, start_rate: Array | None = None
) -> Iterator[PieceDemand]:
    """Yield what the pieces of a mission ask for, one after the other, from t = 0.

    The robot begins with its momentum there, and its wheels with none from it.

    ``robot``: as the flight software knows it; ``start_rate``: (3,) rad/s of the base at the start,
    base axes (None: the reference's); where it differs the momentum is asked for, no torque.
    """
    nominal = robot.nominal
    surroundings = Surroundings(nominal, orbit) if orbit.has_orbit else None
    counts = [len(sample_times(piece.begin, piece.end)) for piece in pieces]
    share = min(1.0, MOST_SAMPLES / sum(counts))
    start: Array | None = None
    impulse = np.zeros((len(SOURCES), 3))
    for piece, count in zip(pieces, counts, strict=True):
        samples = max(FEWEST_KNOTS, int(share * count))
        asked = demand(nominal, piece.joints, piece.base, piece.begin, piece.end, samples)
        if start is None:
            start = asked.momentum[0] + _off_momentum(nominal, asked, start_rate)
        torque, momentum = asked.torque[:, :3], asked.momentum - start
        sources = {MOTION: _source_demand(torque, momentum)}
        asked = asked._replace(momentum=momentum)
        if surroundings:
            axes = base_axes(asked.base[:, :4].T)
            outside, impulses = _outside(surroundings, asked, impulse)
            impulse = impulses[:, -1]
            asked = asked._replace(torque=asked.torque.copy())
            for name, by_source, source_impulse in zip(SOURCES, outside, impulses, strict=True):
                countered = -to_base(axes, by_source.T).T
                sources[name] = _source_demand(countered, -source_impulse)
                asked.torque[:, :3] += countered
                asked.momentum[:] -= source_impulse
        yield PieceDemand(piece, asked, sources)


def _off_momentum(robot: Robot, asked: MotionDemand, rate: Array | None) -> Array:
    if rate is None:
        return np.zeros(3)
    motion = Motion(asked.base[:1, :4], asked.base[:1, 4:7], *asked.joints[:1, :2].swapaxes(0, 1))
    own = motion._replace(omega_base=rate[np.newaxis])
    both = [robot_momentum(robot, one).angular[0] for one in (own, motion)]
    difference: Array = both[0] - both[1]
    return difference


def _source_demand(torque: Array, momentum: Array) -> SourceDemand:
    sizes = norms(momentum)
    return SourceDemand(float(np.abs(torque).max()), float(sizes.max()), float(sizes[-1]))


def _outside(surroundings: Surroundings, asked: MotionDemand, before: Array) -> tuple[Array, Array]:
    """Return torques (S, K, 3), N m, and impulses (S, K, 3), N m s, on inertial axes, by `SOURCES`.

    ``before`` are the impulses (S, 3) until the begin.
    """
    time = asked.time
    wanted = math.ceil(min((time[-1] - time[0]) / OUTSIDE_S, MOST_KNOTS))
    rows = np.linspace(0, len(time) - 1, max(FEWEST_KNOTS, min(wanted, len(time)))).astype(int)
    torques = surroundings.torques(time[rows], asked.base[rows, :4], asked.joints[rows, 0])
    steps = np.diff(time[rows])[:, np.newaxis] * 0.5 * (torques[:, 1:] + torques[:, :-1])
    sums = np.cumsum(np.concatenate([before[:, np.newaxis], steps], axis=1), axis=1)
    return _between(time, time[rows], torques), _between(time, time[rows], sums)


def _between(time: Array, at: Array, values: Array) -> Array:
    """Return values (S, R, 3) at times ``at`` (R,) at times (K,) between them, (S, K, 3)."""
    columns = [[np.interp(time, at, column) for column in rows.T] for rows in values]
    return np.moveaxis(np.array(columns), 1, 2)


class Surroundings:
    """The torques on a robot in its orbit along a motion, as the plant computes them."""

    def __init__(self, robot: Robot, orbit: OrbitSettings) -> None:
        """Put the robot, whose joints are all actuated, into an orbit."""
        self._robot, self._block = robot, PlantMemory.block(robot.n)
        world = EnvironmentSettings(**{k: getattr(orbit, k) for k in OrbitSettings.model_fields})
        environment = Environment.build(world, Installation(robot.n, robot=robot))
        assign(self._block[0], model=robot.model, environment=environment)
        self._truth = RobotState(0, self._block["truth"])
        self._ephemeris = Ephemeris(
            AssumedOrbit(orbital_elements=orbit.orbital_elements, j2=orbit.gravity.j2)
        )

    def torques(self, time: Array, quaternions: Array, joints: Array) -> Array:
        """Return torques (S, K, 3) about the centre of mass by `SOURCES`, N m, inertial axes.

        ``time`` (K,) s; ``quaternions`` (K, 4) of the base, unit; ``joints`` (K, n) rad or m.
        """
        n, x = self._robot.joint_count, self._block[0]["x"]
        place = self._ephemeris.motion(time)
        out = np.empty((len(time), len(SOURCES), 3))
        for k, now in enumerate(time):
            x[3:7], x[7 : 7 + n] = quaternions[k], joints[k, list(self._robot.order)]
            x[13 + 2 * n : 16 + 2 * n] = place.position[k]
            x[16 + 2 * n : 19 + 2 * n] = place.velocity[k]
            update_true_state(self._block, REPORT_TICKS, float(now) / REPORT_TICKS)
            out[k] = self._truth.external_torques.reshape(-1, 3)
        return np.moveaxis(out, 0, 1)


class Excess(NamedTuple):
    """Where a mission asks most of actuators."""

    torque: float
    """Largest torque asked, as a share of what they give in that direction."""
    momentum: float
    """Largest momentum asked, as a share of what they hold; 0: they need not hold any."""
    complaint: str
    """What is asked too much, where and when; empty: nothing is."""


def excess(hardware: BaseActuatorSettings, demands: Iterable[PieceDemand]) -> Excess:
    """Return what a mission asks of wheels or thrusters, without unloading by torquers."""
    largest, complaint, start = np.zeros(2), "", None
    for number, (piece, asked, _) in enumerate(demands, 1):
        axes, momentum = base_axes(asked.base[:, :4].T), asked.base_momentum
        start = axes[:, :, :1] if start is None else start
        taken_up = momentum - carried_momentum(hardware.wheels, start, axes)
        load = actuator_load(hardware, asked.torque[:, :3], taken_up, asked.base[:, 4:7])
        for i, (values, shares, unit, does) in enumerate(
            (
                (load.torque, load.torque_share, "N m", "give"),
                (momentum, load.momentum_share, "N m s", "hold"),
            )
        ):
            k = int(np.argmax(shares))
            share = float(shares[k])
            largest[i] = max(largest[i], share)
            if share > 1.0 and not complaint:
                axis = int(np.argmax(np.abs(values[k])))
                complaint = (
                    f"the mission's part {number} ({piece.motion}) asks for "
                    f"{abs(values[k, axis]):.4g} {unit} about {BASE_AXES[axis]} at "
                    f"t = {asked.time[k]:.2f} s, {100.0 * share:.4g} % of what the actuators {does}"
                )
    return Excess(float(largest[0]), float(largest[1]), complaint)


def check_mission_demand(scenario: ResolvedScenario) -> None:
    """Check that the actuators that the flight software assumes can give what segments ask for.

    The demand is that of the nominal robot without friction, in the plant's orbit. Missions with
    ``limits: {check_actuators: false}`` are not checked.

    Raises:
        InputError: a torque or momentum is too large; names segment, axis, time and amounts.
    """
    mission = scenario.mission
    is_checked = mission.limits.check_actuators and mission.written_segments
    if is_checked and (complaint := demand_complaint(scenario)):
        raise InputError(
            f"{complaint}: use `space-robot plan` to stretch it, or limits: "
            "{check_actuators: false}"
        )


def demand_remark(scenario: ResolvedScenario) -> str:
    """Return what a mission that is not refused asks too much of the actuators, or ""."""
    if scenario.mission.limits.check_actuators and scenario.mission.written_segments:
        return ""
    complaint = demand_complaint(scenario, scenario.ticks * scenario.plant.period)
    return complaint and f"{complaint}: use `space-robot plan` to stretch it"


def demand_complaint(scenario: ResolvedScenario, end: float = math.inf) -> str:
    """Return what a mission asks too much of the assumed actuators until ``end``, s, or ""."""
    hardware, robot = scenario.assumed_actuators, scenario.robots.controller
    if hardware.base_actuation != "hardware":
        return ""
    flown = (piece for piece in scenario.reference.pieces if piece.begin < end)
    pieces = [piece._replace(end=min(piece.end, end)) for piece in flown]
    rate = np.radians(scenario.plant.initial_rate_deg_s)
    return excess(hardware, mission_demand(robot, pieces, scenario.plant, rate)).complaint


def held_base_remark(scenario: ResolvedScenario) -> str:
    """Return what a mission wants of a base that floats freely in its flight, or ""."""
    if scenario.plant.controls_base:
        return ""
    pieces = scenario.reference.pieces
    segments: Sequence[Segment | None] = read_segments(scenario.mission.segments) or [None]
    for number, (piece, segment) in enumerate(zip(pieces, segments, strict=True), 1):
        if segment and segment.is_base_free:
            continue
        times = np.linspace(piece.begin, piece.end, FEWEST_KNOTS)
        leads_tool = isinstance(segment, ToolSegment) and segment.tool.frame != "base"
        if leads_tool or piece.base.at(times)[:, 4:7].any():
            turns = any(scenario.plant.initial_rate_deg_s)
            advice = "" if turns else ": base: free plans for that"
            return (
                f"the mission's part {number} ({piece.motion}) is planned with a base "
                f"whose attitude is controlled, without actuators it floats freely{advice}"
            )
    return ""
