"""Results of ``space-robot gains check``, computed from a planned flight."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from space_robot_control.controller.gains import available_laws
from space_robot_model.dynamics.attitude import SINGULAR_ETA
from space_robot_msgs_py.config.validation import validate
from space_robot_msgs_py.errors import FlightError, InputError

from ..flight.plan import Flight, FlightPlan, resolve
from ..flight.simulate import simulate
from ..scenario.node_settings import FlightSettings
from ..tuning.gain_check import GainCheck, check_gains, pair_corner
from ..tuning.inertia import inertia_along

Array = NDArray[np.float64]

ALL = "all"
HELD = 6.0
"""s of flight to measure ripple in."""


@dataclass(frozen=True)
class Checked:
    """Results for the laws checked on the robot and mission of a flight."""

    flight: Flight
    checks: list[GainCheck]
    ripple: dict[str, Array | None]
    """By law, (m,) N m: the torque's standard deviation with the robot held still, by its sensors'
    noise; None if that diverged. Empty with ideal sensors."""

    @property
    def is_sound(self) -> bool:
        """True if every law passes its check."""
        return all(check.is_sound for check in self.checks)


def checked(options: dict[str, Any]) -> Checked:
    """Check the laws that the options of a command name.

    Raises:
        InputError: a name is unknown, or no law can control the base.
    """
    plan, every = validate(FlightPlan, options, "options"), options["controller"] == ALL
    if every:
        plan = plan.model_copy(update={"controller": _first_law(plan)})
    flight = Flight(resolve(plan))
    laws = flight.laws.values() if every else [flight.law]
    quaternion = flight.mission.chunk(0, 1).base[0, :4]
    if flight.controls_base and abs(quaternion[0]) <= SINGULAR_ETA:
        raise InputError("base_quaternion: turned by 180 degrees, where the laws are singular")
    inertia = inertia_along(
        flight.plant.robot, flight.mission_settings, controls_base=flight.controls_base
    )
    corner = pair_corner(flight.controller_settings)
    checks = [check_gains(law, inertia, quaternion, corner) for law in laws]
    ripple: dict[str, Array | None] = {}
    if flight.plant_settings.sensors != "ideal":
        names = flight.laws if every else [plan.controller]
        ripple = {
            check.law: held_ripple(flight, plan.model_copy(update={"controller": name}))
            for check, name in zip(checks, names, strict=True)
        }
    return Checked(flight, checks, ripple)


def held_ripple(flight: Flight, plan: FlightPlan) -> Array | None:
    """Return (m,) the RMS of the torque about its mean, N m, with the robot held still.

    It is flown for `HELD` s at the first waypoint of ``flight``, the last half of which counts.
    None: it diverges.
    """
    first = flight.mission_settings.waypoints_deg[: flight.robot.n]
    there = {"waypoint_times": [0.0], "waypoints_deg": first}
    held = plan.with_parameters("mission", there).model_copy(update={"duration": HELD})
    try:
        log = simulate(Flight(resolve(held)))
    except FlightError:
        return None
    assert log.commanded_torque is not None
    deviation: Array = log.commanded_torque[log.ticks // 2 :].std(axis=0)
    return deviation


def _first_law(plan: FlightPlan) -> str:
    settings = FlightSettings.resolve(plan.options(), plan.parameters).controller
    names = available_laws(settings)
    if not names:
        raise InputError(f"gains {settings.gains!r} have no file for any law of this project")
    return names[0]


def report_of(checks: Checked) -> dict[str, Any]:
    """Return the findings as data for JSON."""
    flight = checks.flight
    return {
        **{
            key: flight.description[key]
            for key in ("robot", "mission", "case", "actuators", "gains")
        },
        "axes": flight.robot.axis_names,
        "is_sound": checks.is_sound,
        **({"sensors": flight.plant_settings.sensors} if checks.ripple else {}),
        "laws": {check.law: dict(_of_law(check, checks)) for check in checks.checks},
    }


def _of_law(check: GainCheck, checks: Checked) -> Iterable[tuple[str, Any]]:
    yield "is_sound", check.is_sound
    if spectrum := check.spectrum:
        yield from (
            ("smallest_eigenvalue", spectrum.smallest),
            ("largest_eigenvalue", spectrum.largest),
            ("spectral_radius", spectrum.radius),
            ("spectral_norm", spectrum.norm),
            ("torque_scale_margin", spectrum.margin),
            ("largest_torque_scale", spectrum.largest_scale),
        )
    yield "noise_gain", check.noise_gain.tolist()
    if checks.ripple:
        ripple = checks.ripple[check.law]
        yield "held_ripple", None if ripple is None else ripple.tolist()
