"""Results of ``space-robot gains check``, computed from a planned flight; JSON and tables."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

from rich.console import Console

from space_robot_control.controller.gains import available_laws
from space_robot_control.laws import ControlLaw
from space_robot_control.laws.base import NO_ESTIMATE, NOMINAL_INERTIA
from space_robot_model.elementary.matrices import Array
from space_robot_msgs_py.config.validation import validate
from space_robot_msgs_py.errors import FlightError, InputError

from ..console.tables import Column, JudgedCell, Table, named
from ..console.terminal import print_table, say
from ..flight.plan import Flight, Scenario, resolve
from ..flight.simulate import simulate
from ..scenario.node_settings import FlightSettings
from ..tuning.flexible import FlexibleMotions, check_flexible
from ..tuning.gain_check import LEAST_MARGIN, GainCheck, Spectrum, check_gains, pair_corner
from ..tuning.inertia import SAMPLING, inertia_along, postures_along, sampled_reference

ALL = "all"
HELD = 6.0
"""s of flight to measure ripple in."""
GEARS_EVERY = 1.0
"""Time between two configurations in which a robot with gears is checked, s."""


@dataclass(frozen=True)
class CheckedGains:
    """Results for the laws checked on the robot and mission of a flight."""

    flight: Flight
    checks: list[GainCheck]
    ripple: dict[str, Array | None]
    """By law, (m,) N m: the torque's standard deviation with the robot held still, by its sensors'
    noise; None if that diverged. Empty with ideal sensors."""
    frequencies: dict[str, tuple[float, float]]
    """By joint with a gear, Hz: lowest and highest frequency of its spring along the mission."""

    estimates: dict[str, int]
    """By law: the kind of its time-delay estimate."""
    mass_uncertainty: float
    """Share by which masses and inertias may be wrong."""

    @property
    def is_sound(self) -> bool:
        """True if nothing grows under any law, and each has margin."""
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
        words = {NOMINAL_INERTIA: "the nominal inertia leaves", NO_ESTIMATE: "the observer leaves"}
        kinds: dict[str, list[str]] = {"h_bar leaves": [], **{text: [] for text in words.values()}}
        for law in small:
            kinds[words.get(self.estimates[law], "h_bar leaves")].append(law)
        least = f"a margin below {LEAST_MARGIN:.0%} in torque scale"
        return [f"remark: {', '.join(laws)}: {why} {least}" for why, laws in kinds.items() if laws]


def check_laws(options: dict[str, Any], mass_uncertainty: float = 0.2) -> CheckedGains:
    """Check the laws that the options of a command name.

    Args:
        options: of a `Scenario`.
        mass_uncertainty: share by which masses and inertias may be wrong.

    Raises:
        InputError: a name is unknown, or no law can control the base.
    """
    plan, every = validate(Scenario, options, "options"), options["controller"] == ALL
    if every:
        plan = plan.model_copy(update={"controller": _first_law(plan)})
    flight = Flight(resolve(plan))
    laws = list(flight.laws.values()) if every else [flight.law]
    corner = pair_corner(flight.controller_settings)
    robot, mission, has_base = flight.plant.robot, flight.mission_settings, flight.controls_base
    inertia = inertia_along(robot, mission, controls_base=has_base)
    postures = postures_along(flight.robot, mission, SAMPLING, has_base)
    checks = [check_gains(law, inertia, postures, corner) for law in laws]
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
    return CheckedGains(flight, checks, ripple, frequencies, estimates, mass_uncertainty)


def with_gears(
    flight: Flight, checks: list[GainCheck], laws: Sequence[ControlLaw], corner: float
) -> tuple[list[GainCheck], dict[str, tuple[float, float]]]:
    """Add to the checks the laws' stability with the gears of the robot.

    Returns:
        The checks, and frequencies as in `CheckedGains`.
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


def held_ripple(flight: Flight, plan: Scenario) -> Array | None:
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


def _first_law(plan: Scenario) -> str:
    settings = FlightSettings.resolve(plan).controller
    names = available_laws(settings)
    if not names:
        raise InputError(f"gains {settings.gains!r} have no file for any law of this project")
    return names[0]


def gains_report(checks: CheckedGains) -> dict[str, Any]:
    """Return the results as data for JSON."""
    flight = checks.flight
    keys = ("robot", "mission", "case", "actuators", "gains")
    report = {
        **{key: flight.description[key] for key in keys},
        "axes": flight.robot.axis_names,
        "is_stable": checks.is_stable,
        "is_sound": checks.is_sound,
    }
    if checks.frequencies:
        report["gears"] = {
            name: {"lowest_hz": low, "highest_hz": high}
            for name, (low, high) in checks.frequencies.items()
        }
    if checks.ripple:
        report["sensors"] = flight.plant_settings.sensors
    return report | {
        "laws": {check.law: dict(_law_entries(check, checks)) for check in checks.checks}
    }


def _law_entries(check: GainCheck, checks: CheckedGains) -> Iterable[tuple[str, Any]]:
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
    if check.spectrum:
        bounds = _wrong_masses(check.spectrum, share := checks.mass_uncertainty)
        yield "wrong_masses", dict(zip(WRONG, (share, *bounds), strict=True))
    yield "loop_radius", check.loop.radius
    if flexible := check.flexible:
        yield "flexible", {"is_stable": flexible.is_stable, **asdict(flexible)}
    yield "noise_gain", check.noise_gain.tolist()
    if checks.ripple:
        ripple = checks.ripple[check.law]
        yield "held_ripple", None if ripple is None else ripple.tolist()


WRONG = ("share", "smallest", "largest")


def _wrong_masses(spectrum: Spectrum, share: float) -> tuple[float, float]:
    return spectrum.smallest / (1.0 + share), spectrum.largest / (1.0 - share)


def print_checks(checks: CheckedGains, console: Console) -> None:
    """Print margins and noise gains with an explanation."""
    names = checks.flight.description
    say(
        console,
        f"robot {names['robot']}, mission {names['mission']}, case {names['case']}, "
        f"gains {names['gains']}, actuators {names['actuators']}",
    )
    for table in _tables(checks):
        print_table(table, console)


def _tables(checks: CheckedGains) -> Iterator[Table]:
    if any(check.spectrum for check in checks.checks):
        yield _margins(checks)
        share = checks.mass_uncertainty
        own = [(check.law, check.spectrum) for check in checks.checks if check.spectrum]
        rows = [[law, *_wrong_masses(spectrum, share)] for law, spectrum in own]
        title = f"The same with masses and inertias wrong by {share:.0%}"
        columns = named(), *(Column(name, spec=".4f") for name in ("smallest", "largest"))
        note = "Bounds for all such robots."
        yield Table.of(title, columns, rows, note)
    yield _loops(checks)
    if checks.frequencies:
        columns = named(), Column("lowest", spec=".3f"), Column("highest", spec=".3f")
        rows = [[name, *extremes] for name, extremes in checks.frequencies.items()]
        title = "Frequency of each gear's spring along the mission, Hz"
        yield Table.of(title, columns, rows)
        yield _springs(checks)
    gains = {check.law: check.noise_gain for check in checks.checks}
    title = "Torque that noise on the rate of an axis becomes, N m per rad/s"
    yield _by_axis(title, checks, gains, "N s/m")
    if checks.ripple:
        title = f"Torque ripple with sensors {checks.flight.plant_settings.sensors}, held still, "
        diverged = [law for law, ripple in checks.ripple.items() if ripple is None]
        notes = [f"Held still, {', '.join(diverged)} diverged."] if diverged else []
        yield _by_axis(f"{title}N m RMS", checks, checks.ripple, "N", *notes)


def _margins(checks: CheckedGains) -> Table:
    smallest, largest = Column("smallest", spec=".4f"), Column("largest", spec=".4f")
    rows = []
    for check in checks.checks:
        if spectrum := check.spectrum:
            radius = _holds(f"{spectrum.radius:.4f} < 1", spectrum.contracts)
            margin = _margin(spectrum.margin, spectrum.contracts, spectrum.is_sound)
            rows.append([check.law, spectrum.smallest, spectrum.largest, radius, margin])
    inertia = "H_S" if checks.flight.controls_base else "H_f"
    notes = [
        "The margin is the share by which the torque reported may exceed the one commanded "
        "until the time-delay estimate diverges."
    ]
    if nominal := [law for law, kind in checks.estimates.items() if kind == NOMINAL_INERTIA]:
        notes.append(f"h_bar of {', '.join(nominal)} is {inertia} of the nominal model.")
    title = f"Eigenvalues of {inertia}^-1 h_bar along the mission"
    columns = named(), smallest, largest, Column("radius"), Column("margin")
    return Table.of(title, columns, rows, *notes)


def _loops(checks: CheckedGains) -> Table:
    rows = []
    for check in checks.checks:
        loop = check.loop
        margin = None
        if loop.margin is not None:
            margin = _margin(loop.margin, loop.is_stable, loop.is_stable and loop.has_margin)
        rows.append([check.law, _holds(f"{loop.radius:.6f}", loop.is_stable), margin])
    notes = ["A small motion of the rigid robot grows by the radius in a tick if it is above 1."]
    if any(check.loop.margin is not None for check in checks.checks):
        notes.append("The margin of observers is that of the loop; 100 % is the largest searched.")
    title = "Stability of the closed loop along the mission"
    return Table.of(title, [named(), Column("radius"), Column("margin")], rows, *notes)


def _springs(checks: CheckedGains) -> Table:
    rows = []
    for check in checks.checks:
        if flexible := check.flexible:
            corner = flexible.largest_corner_hz
            bandwidth: str | None = "any" if corner is None else f"{corner:.3g} Hz"
            if checks.estimates[check.law] == NO_ESTIMATE:
                bandwidth = None
            radius = _holds(f"{flexible.radius:.6f}", flexible.is_stable)
            rows.append([check.law, radius, bandwidth, flexible.largest_h_bar_scale])
    note = (
        "An oscillation grows by the radius in a tick if it is above 1. The bandwidth is the "
        "largest controller.acceleration_filter_hz, and h_bar the largest factor on all of h_bar "
        "(of an observer: on its inertia), with which it does not; switching terms are not counted."
    )
    title = "Stability with the springs of the gears along the mission"
    h_bar = Column("largest\nh_bar", spec=".3g")
    columns = named(), Column("radius"), Column("largest\nbandwidth"), h_bar
    return Table.of(title, columns, rows, note)


def _holds(text: str, value: bool) -> JudgedCell:
    return JudgedCell.of(value, "holds", "fails", text)


def _margin(share: float, is_stable: bool, is_sound: bool) -> JudgedCell:
    return JudgedCell.of(is_sound, "sound", "small" if is_stable else "none", f"{share:.2%}")


def _by_axis(
    title: str,
    checks: CheckedGains,
    columns: Mapping[str, Array | None],
    prismatic: str,
    *notes: str,
) -> Table:
    """Return a column for each law; axes of prismatic joints with the unit of their own."""
    robot = checks.flight.robot
    slides = (False, False, False, *robot.is_prismatic[: robot.n])
    rows = [
        [
            f"{name} ({prismatic})" if slides[axis] else name,
            *(None if values is None else float(values[axis]) for values in columns.values()),
        ]
        for axis, name in enumerate(robot.axis_names)
    ]
    return Table.of(title, [named(), *(Column(law, spec=".3g") for law in columns)], rows, *notes)
