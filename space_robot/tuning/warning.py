"""Warnings before a flight: gains with too little margin, missions beyond the joints' limits."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from space_robot_control.guidance.limits import too_fast, too_strong
from space_robot_control.guidance.mission import Mission, MissionSettings
from space_robot_control.laws import ControlLaw
from space_robot_control.navigation.low_pass import low_pass_weight
from space_robot_model.robot import Robot
from space_robot_msgs_py.errors import InputError

from .inertia import inertia_along, sampled_reference, semi_floating_inertia
from .method import Tuned
from .spectrum import LEAST_MARGIN, spectrum

A_LEG = 10
"""Minimum number of configurations per leg."""
MUCH_SLOWER = 0.1
"""A law is weak below this share of the bandwidth of the laws with a model."""
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
) -> list[str]:
    """Return a warning for each law with an h_bar that is unstable or nearly so.

    Args:
        flown: the laws of the flight, in order of use.
        robot: of the plant, with its payload.
        mission: settings of the reference.
        acceleration_filter_hz: corner of the low-pass of the time-delay pair (0: none).
        controls_base: whether the base has attitude actuators.
        on_thrusters: whether these are only thrusters: the estimate feeds their pulses back into
            the demand, except the share ``H^-1 h_bar``.
        on_thin_margin: whether to warn of stable laws with little margin, too.
    """
    laws = {law.name: law for law in flown if law.h_bar.size}
    if not laws:
        return []
    try:
        inertia = inertia_along(robot, mission, COARSE, controls_base)
    except InputError:  # the flight itself reports it
        return []
    remarks = []
    for name, law in laws.items():
        weight = low_pass_weight(acceleration_filter_hz, law.period) or 1.0
        eigen = spectrum(inertia, law.h_bar[-inertia.shape[-1] :], weight)
        if not eigen.contracts:
            why = f"h_bar is too large for the robot (radius {eigen.radius:.3g}): it will diverge"
        elif not eigen.is_sound and on_thin_margin:
            why = (
                f"h_bar leaves {eigen.margin:.2%} of margin in torque scale, "
                f"at least {LEAST_MARGIN:.0%} is recommended"
            )
            if on_thrusters:
                why += ", and thrusters' pulses come back into the demand (--gains robust)"
        else:
            continue
        remarks.append(f"warning: {name}: {why}; see space-robot gains check")
    return remarks


def estimate_remark(tuned: Tuned) -> str:
    """Return a remark if a set's laws with time-delay estimation are weak; else empty.

    They are weak below a tenth of the bandwidth of the laws with a model.
    """
    if tuned.bandwidth >= MUCH_SLOWER * tuned.model_bandwidth:
        return ""
    return (
        f"The laws with time-delay estimation are weak: {tuned.bandwidth:.2g} rad/s, those with a "
        f"model {tuned.model_bandwidth:.2g}. Eigenvalues of H_S^-1 h_bar are {tuned.smallest:.2g} "
        f"to {tuned.largest:.3g} (no diagonal h_bar suits light and heavy directions at once), so "
        f"the estimate needs a low-pass and lags by {tuned.delay * 1e3:.3g} ms. What helps: fly "
        "ctc or ctc_smc; panels on hinges without motors as passive joints; a smaller margin or "
        "mass uncertainty (gains tune --margin, --mass-uncertainty), where drives and masses are "
        "known that well; a shorter period."
    )


def limit_remarks(robot: Robot, mission: MissionSettings) -> list[str]:
    """Return a warning for each joint whose limits the mission exceeds.

    The force is that of acceleration only, with constant attitude and locked passive joints:
    friction, velocity terms and control errors are not included.
    """
    try:
        planned = Mission(robot, mission, COARSE)
    except InputError:  # the flight itself reports it
        return []
    remarks = [
        f"warning: mission: {b.joint} would move at {b.asked:.3g} {b.unit}, its limit is "
        f"{b.limit:.3g} {b.unit}"
        for b in too_fast(robot, planned.times, planned.waypoints)
    ]
    has_limits = np.isfinite([limits.effort for limits in robot.limits]).any()
    if not has_limits or len(planned.times) < 2:
        return remarks
    legs = np.diff(planned.times)
    joints = sampled_reference(robot, mission, min(COARSE, *(legs / A_LEG))).joints
    inertia = semi_floating_inertia(robot.nominal, joints[:, 0])[:, 3:, 3:]
    force = np.einsum("kij,kj->ki", inertia, joints[:, 2])
    return remarks + [
        f"warning: mission: {b.joint} needs {b.asked:.3g} {b.unit} and more, its limit is "
        f"{b.limit:.3g} {b.unit}"
        for b in too_strong(robot, force)
    ]
