"""Results of ``space-robot gains check``, computed from a planned flight."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from space_robot_control.controller.gains import available_laws
from space_robot_control.laws import ControlLaw
from space_robot_control.laws.base import NO_ESTIMATE, NOMINAL_INERTIA
from space_robot_msgs_py.config.validation import validate
from space_robot_msgs_py.errors import FlightError, InputError

from ..flight.plan import Flight, FlightPlan, resolve
from ..flight.simulate import simulate
from ..scenario.node_settings import FlightSettings
from ..tuning.flexible import FlexibleMotions, check_flexible
from ..tuning.gain_check import GainCheck, check_gains, estimated_with, pair_corner
from ..tuning.inertia import SAMPLING, inertia_along, postures_along, sampled_reference
from ..tuning.spectrum import COARSE, LEAST_MARGIN, check_masses, drawn_inertias

Array = NDArray[np.float64]

ALL = "all"
HELD = 6.0
"""s of flight to measure ripple in."""
GEARS_EVERY = 1.0
"""Time between two configurations in which a robot with gears is checked, s."""


@dataclass(frozen=True)
class Checked:
    """Results for the laws checked on the robot and mission of a flight."""

    flight: Flight
    checks: list[GainCheck]
    ripple: dict[str, Array | None]
    """By law, (m,) N m: the torque's standard deviation with the robot held still, by its sensors'
    noise; None if that diverged. Empty with ideal sensors."""
    frequencies: dict[str, tuple[float, float]]
    """By joint with a gear, Hz: lowest and highest frequency of its spring along the mission."""

    with_pair: frozenset[str]
    """Laws with a time-delay estimate."""
    with_model: frozenset[str]
    """Those of them whose estimate has the nominal inertia."""

    @property
    def is_sound(self) -> bool:
        """True if every law passes its check: nothing grows, and there is margin."""
        return all(check.is_sound for check in self.checks)

    @property
    def is_stable(self) -> bool:
        """True if nothing grows under any law."""
        return all(check.is_stable for check in self.checks)

    @property
    def faults(self) -> list[str]:
        """What grows under which laws, one clause for each kind."""
        diverging = [c.law for c in self.checks if c.spectrum and not c.spectrum.contracts]
        kinds = {
            "the estimate diverges": diverging,
            "small motions grow": [check.law for check in self.checks if not check.loop.is_stable],
            "small oscillations of the gears' springs grow": [
                check.law
                for check in self.checks
                if check.flexible and not check.flexible.is_stable
            ],
        }
        return [f"{', '.join(laws)}: {fault}" for fault, laws in kinds.items() if laws]

    @property
    def remarks(self) -> list[str]:
        """Which stable laws have little margin, one line for each kind of estimate."""
        small = [check.law for check in self.checks if check.is_stable and not check.has_margin]
        constant = self.with_pair - self.with_model
        kinds = {
            "h_bar leaves": [law for law in small if law in constant],
            "the nominal inertia leaves": [law for law in small if law in self.with_model],
            "the observer leaves": [law for law in small if law not in self.with_pair],
        }
        least = f"a margin below {LEAST_MARGIN:.0%} in torque scale"
        return [f"remark: {', '.join(laws)}: {why} {least}" for why, laws in kinds.items() if laws]


def checked(options: dict[str, Any], mass_uncertainty: float = 0.2) -> Checked:
    """Check the laws that the options of a command name.

    Args:
        options: of a `FlightPlan`.
        mass_uncertainty: share by which masses and inertias may be wrong.

    Raises:
        InputError: a name is unknown, or no law can control the base.
    """
    plan, every = validate(FlightPlan, options, "options"), options["controller"] == ALL
    if every:
        plan = plan.model_copy(update={"controller": _first_law(plan)})
    flight = Flight(resolve(plan))
    laws = list(flight.laws.values()) if every else [flight.law]
    corner = pair_corner(flight.controller_settings)
    checks = _on_rigid_robot(flight, laws, corner, mass_uncertainty)
    frequencies: dict[str, tuple[float, float]] = {}
    if any(flight.plant.robot.gears):
        checks, frequencies = with_gears(flight, checks, laws, corner)
    ripple: dict[str, Array | None] = {}
    if flight.plant_settings.sensors != "ideal":
        names = flight.laws if every else [plan.controller]
        ripple = {
            check.law: held_ripple(flight, plan.model_copy(update={"controller": name}))
            for check, name in zip(checks, names, strict=True)
        }
    estimates = {law.name: law.estimate for law in laws}
    return Checked(
        flight,
        checks,
        ripple,
        frequencies,
        frozenset(name for name, kind in estimates.items() if kind != NO_ESTIMATE),
        frozenset(name for name, kind in estimates.items() if kind == NOMINAL_INERTIA),
    )


def _on_rigid_robot(
    flight: Flight, laws: Sequence[ControlLaw], corner: float, mass_uncertainty: float
) -> list[GainCheck]:
    """Check laws without the gears of the robot."""
    robot, mission, has_base = flight.plant.robot, flight.mission_settings, flight.controls_base
    inertia = inertia_along(robot, mission, controls_base=has_base)
    postures = postures_along(flight.robot, mission, SAMPLING, has_base)
    coarse = postures_along(flight.robot, mission, COARSE, has_base)
    drawn = drawn_inertias(robot, mission, mass_uncertainty, COARSE, has_base)
    checks = []
    for law in laws:
        check = check_gains(law, inertia, postures, corner)
        assumed = estimated_with(law, coarse, drawn.shape[1])
        if check.spectrum and assumed is not None:
            masses = check_masses(check.spectrum, assumed, drawn, mass_uncertainty)
            check = replace(check, masses=masses)
        checks.append(check)
    return checks


def with_gears(
    flight: Flight, checks: list[GainCheck], laws: Sequence[ControlLaw], corner: float
) -> tuple[list[GainCheck], dict[str, tuple[float, float]]]:
    """Add to the checks the laws' stability with the gears of the robot.

    Returns:
        The checks, and frequencies as in `Checked`.
    """
    robot = flight.plant.robot
    positions = sampled_reference(robot, flight.mission_settings, GEARS_EVERY).joints[:, 0]
    motions = FlexibleMotions(robot, positions, flight.plant.period, flight.controls_base)
    lowest, highest = motions.frequencies.min(axis=0), motions.frequencies.max(axis=0)
    extremes = zip(lowest.tolist(), highest.tolist(), strict=True)
    with_springs = [
        replace(check, flexible=check_flexible(law, motions, corner))
        for check, law in zip(checks, laws, strict=True)
    ]
    return with_springs, dict(zip(robot.geared_names, extremes, strict=True))


def held_ripple(flight: Flight, plan: FlightPlan) -> Array | None:
    """Return (m,) the RMS of the torque about its mean, N m, with the robot held still.

    It is flown for `HELD` s at the start of ``flight``, the last half of which counts.
    None: it diverges.
    """
    there = {"joints_deg": flight.mission_settings.joints_deg, "segments": [""]}
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
        "is_stable": checks.is_stable,
        "is_sound": checks.is_sound,
        **(
            {
                "gears": {
                    name: {"lowest_hz": low, "highest_hz": high}
                    for name, (low, high) in checks.frequencies.items()
                }
            }
            if checks.frequencies
            else {}
        ),
        **({"sensors": flight.plant_settings.sensors} if checks.ripple else {}),
        "laws": {check.law: dict(_of_law(check, checks)) for check in checks.checks},
    }


def _of_law(check: GainCheck, checks: Checked) -> Iterable[tuple[str, Any]]:
    yield "is_stable", check.is_stable
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
    elif check.margin is not None:
        yield "torque_scale_margin", check.margin
        yield "largest_torque_scale", check.loop.largest_scale
    if masses := check.masses:
        yield "wrong_masses", asdict(masses)
    yield "loop_radius", check.loop.radius
    if flexible := check.flexible:
        yield "flexible", {"is_stable": flexible.is_stable, **asdict(flexible)}
    yield "noise_gain", check.noise_gain.tolist()
    if checks.ripple:
        ripple = checks.ripple[check.law]
        yield "held_ripple", None if ripple is None else ripple.tolist()
