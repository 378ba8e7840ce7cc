"""Warnings before a flight: gains with too little margin, missions beyond the joints' limits."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

import numpy as np

from space_robot_control.guidance.courses import Piece
from space_robot_control.guidance.limits import ROUNDING, turn_remarks
from space_robot_control.guidance.mission import MissionSettings
from space_robot_control.laws import CompiledLaw, ControlLaw
from space_robot_control.laws.base import CONSTANT_INERTIA, NO_ESTIMATE
from space_robot_control.navigation.rate_filters import low_pass_weight
from space_robot_model.elementary.matrices import Array
from space_robot_model.robot import Robot
from space_robot_msgs_py.errors import InputError

from .closed_loop import RigidLoop
from .gain_check import LEAST_MARGIN, estimate_spectrum
from .inertia import Posture, inertia_along, postures_along, semi_floating_inertia
from .linear_law import linear_law

FEW = 8
"""Configurations in which the loop of an observer is closed."""
A_LEG = 10
"""Minimum number of configurations per leg."""
COARSE = 0.5
"""Largest time between two configurations, s; coarse, to save time."""


def margin_remarks(
    flown: Iterable[ControlLaw],
    robot: Robot,
    mission: MissionSettings,
    acceleration_filter_hz: float = 0.0,
    controls_base: bool = True,
    on_thrusters: bool = False,
    on_thin_margin: bool = True,
    nominal: Robot | None = None,
) -> list[str]:
    """Return a warning for each law with an estimate or observer that is unstable or nearly so.

    Args:
        flown: the laws of the flight, in order of use; those in Python without an h_bar are not
            tried.
        robot: of the plant, with its payload.
        mission: settings of the reference.
        acceleration_filter_hz: corner of the low-pass of the time-delay pair (0: none).
        controls_base: whether the base has attitude actuators.
        on_thrusters: whether these are only thrusters: the estimate feeds their pulses back into
            the demand, except the share ``H^-1 h_bar``.
        on_thin_margin: whether to warn of stable laws with little margin, too.
        nominal: the robot as the controller knows it; None: ``robot``.
    """
    laws = {
        law.name: law
        for law in flown
        if law.estimate != NO_ESTIMATE or (isinstance(law, CompiledLaw) and not law.uses_model)
    }
    if not laws:
        return []
    try:
        inertia = inertia_along(robot, mission, COARSE, controls_base)
        postures = postures_along(nominal or robot, mission, COARSE, controls_base)
    except InputError:  # the flight itself reports it
        return []
    remarks = []
    for name, law in laws.items():
        weight = low_pass_weight(acceleration_filter_hz, law.period) or 1.0
        if why := _why_it_is_unsound(law, inertia, postures, weight, on_thin_margin):
            if on_thrusters and law.estimate != NO_ESTIMATE and "diverge" not in why:
                why += ", and thrusters' pulses come back into the demand (--gains robust)"
            remarks.append(f"warning: {name}: {why}; see space-robot gains check")
    return remarks


def _why_it_is_unsound(
    law: ControlLaw,
    inertia: Array,
    postures: Sequence[Posture],
    weight: float,
    on_thin_margin: bool,
) -> str:
    """Return what is wrong with a law's estimate or observer; empty if nothing is."""
    name = {NO_ESTIMATE: "observer", CONSTANT_INERTIA: "h_bar"}.get(law.estimate, "nominal inertia")
    if eigen := estimate_spectrum(law, inertia, postures, weight):
        contracts, margin = eigen.contracts, f"{eigen.margin:.2%}"
        growth, is_sound = f"radius {eigen.radius:.3g}", eigen.is_sound
    else:
        linear = linear_law(law, postures[0])
        if not linear.uses("applied_force"):
            return ""
        every = -(-len(inertia) // FEW)
        some = [postures[index % len(postures)] for index in range(0, len(inertia), every)]
        loop = RigidLoop(inertia[::every], some, [linear] * len(some), weight)
        contracts, is_sound = loop.is_stable(), loop.is_stable(1.0 + LEAST_MARGIN)
        margin, growth = f"less than {LEAST_MARGIN:.0%}", f"growth {loop.radius():.6f} a tick"
    if not contracts:
        if law.estimate == CONSTANT_INERTIA:
            return f"h_bar is too large for the robot ({growth}): it will diverge"
        return f"its {name} does not suit the robot ({growth}): it will diverge"
    if is_sound or not on_thin_margin:
        return ""
    return (
        f"{name} leaves {margin} of margin in torque scale, "
        f"at least {LEAST_MARGIN:.0%} is recommended"
    )


def limit_remarks(robot: Robot, pieces: Sequence[Piece]) -> list[str]:
    """Return a warning for each joint whose limit of effort the pieces of a mission exceed.

    The force is that of acceleration only, with constant attitude and locked passive joints:
    friction, velocity terms and control errors are not included.
    """
    remarks = [f"warning: {text}" for text in turn_remarks(robot, pieces)]
    if not np.isfinite([limits.effort for limits in robot.limits]).any():
        return remarks
    counts = (max(A_LEG, math.ceil((piece.end - piece.begin) / COARSE)) + 1 for piece in pieces)
    legs = zip(pieces, counts, strict=True)
    motions = [each.joints.at(np.linspace(each.begin, each.end, count)) for each, count in legs]
    joints = np.concatenate(motions)
    inertia = semi_floating_inertia(robot.nominal, joints[:, 0])[:, 3:, 3:]
    force = np.einsum("kij,kj->ki", inertia, joints[:, 2])
    return remarks + [f"warning: mission: {text}" for text in effort_remarks(robot, force)]


def effort_remarks(robot: Robot, force: Array) -> list[str]:
    """Return a remark on each joint whose ``force`` (K, n), N m or N, is above its limit."""
    largest = np.abs(force).max(axis=0, initial=0.0)
    return [
        f"{name} needs {most:.3g} {unit} and more, its limit is {limits.effort:.3g} {unit}"
        for name, most, limits, unit in zip(
            robot.joint_names,
            largest.tolist(),
            robot.limits,
            np.where(robot.is_prismatic[: robot.n], "N", "N m").tolist(),
            strict=True,
        )
        if most > limits.effort * (1.0 + ROUNDING)
    ]
