"""A remark, before a flight, on gains that leave the time-delay estimate too little margin."""

from __future__ import annotations

from collections.abc import Iterable

from space_robot_msgs_py.errors import InputError
from space_robot_sim.robot import Robot

from ..controller.navigation.low_pass import low_pass_weight
from ..laws import ControlLaw
from ..mission.mission import MissionSettings
from .inertia import inertia_along
from .spectrum import LEAST_MARGIN, spectrum

COARSE = 0.5
"""s between two configurations: nobody is to wait for a remark."""


def margin_remarks(
    flown: Iterable[ControlLaw],
    robot: Robot,
    mission: MissionSettings,
    acceleration_filter_hz: float = 0.0,
    controls_base: bool = True,
    on_thrusters: bool = False,
) -> list[str]:
    """Return a line for each of the laws that diverges, or nearly does, for its h_bar alone.

    Args:
        flown: the laws in force in the flight, in turn.
        robot: the plant's, with its payload.
        mission: its reference.
        acceleration_filter_hz: corner of the low-pass of the time-delay pair (0: none).
        controls_base: whether anything turns the base.
        on_thrusters: whether thrusters alone do: their pulses come back into the demand, all but
            the share ``H^-1 h_bar``.
    """
    laws = {law.name: law for law in flown if law.h_bar.size}
    if not laws:
        return []
    try:
        inertia = inertia_along(robot, mission, COARSE, controls_base)
    except InputError:  # it is the flight that has to complain
        return []
    remarks = []
    for name, law in laws.items():
        weight = low_pass_weight(acceleration_filter_hz, law.period) or 1.0
        found = spectrum(inertia, law.h_bar[-inertia.shape[-1] :], weight)
        if not found.contracts:
            why = f"h_bar is too large for the robot (radius {found.radius:.3g}): it will diverge"
        elif not found.is_sound:
            why = (
                f"h_bar leaves {found.margin:.2%} of margin in torque scale, "
                f"{LEAST_MARGIN:.0%} is wise"
            )
            if on_thrusters:
                why += ", and thrusters' pulses come back into the demand (--gains robust)"
        else:
            continue
        remarks.append(f"warning: {name}: {why}; see space-robot gains check")
    return remarks
