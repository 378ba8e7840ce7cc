"""The flight software of a scenario."""

from __future__ import annotations

from collections.abc import Sequence

import yaml

from space_robot_control.flight_code.folder import Exported
from space_robot_control.flight_code.software import FlightSoftware
from space_robot_control.laws import ControlLaw
from space_robot_msgs_py.config.validation import one_of

from ..flight.plan import Flight


def laws_of(flight: Flight, further: Sequence[str] = ()) -> list[ControlLaw]:
    """Return the laws of a flight: in force at the start, swapped to, and ``further`` ones.

    Raises:
        InputError: a further law is not in the gain set.
    """
    names = [one_of(name, flight.laws, "controller", " of --law") for name in further]
    laws = [flight.law, *(law for _, law in flight.swaps), *(flight.laws[n] for n in names)]
    return list({law.name: law for law in laws}.values())


def export(flight: Flight, further: Sequence[str] = ()) -> Exported:
    """Translate the flight software of a flight that has not begun.

    Raises:
        InputError: a law or kernel has no translation to C.
    """
    settings, scenario = flight.controller_settings, flight.scenario
    laws = laws_of(flight, further)
    robot = f"the robot {scenario.robots.controller.name!r}, as the controller knows it"
    sources = {law.name: f"gain set {settings.gains!r}, law {law.name}" for law in laws}
    limits = settings.hold_ticks, settings.longest_jump
    software = FlightSoftware(
        flight.controller,
        laws,
        flight.swaps,
        limits,
        {"robot": robot, "controller": "parameters of controller_node", **sources},
    )
    text = yaml.safe_dump(scenario.tree)
    return Exported(software, scenario.robots.controller.name, text)
