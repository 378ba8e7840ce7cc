"""Tables of the results of ``space-robot gains check``."""

from __future__ import annotations

from rich.console import Console

from ..console.tables import Column, JudgedCell, Table
from ..console.terminal import say
from ..console.terminal_tables import print_table
from ..tuning.spectrum import DRAWS, LEAST_MARGIN
from .gains_checked import Checked


def print_checks(checks: Checked, console: Console) -> None:
    """Print margins and noise gains with an explanation."""
    what = checks.flight.description
    say(
        console,
        f"robot {what['robot']}, mission {what['mission']}, case {what['case']}, "
        f"gains {what['gains']}, actuators {what['actuators']}",
    )
    if any(check.spectrum for check in checks.checks):
        print_table(_margins(checks), console)
        print_table(_wrong_masses(checks), console)
    print_table(_loops(checks), console)
    if checks.frequencies:
        print_table(_frequencies(checks), console)
        print_table(_with_gears(checks), console)
    print_table(_noise_gains(checks), console)
    if checks.ripple:
        print_table(_ripple(checks), console)


def _margins(checks: Checked) -> Table:
    columns = [
        Column("", is_label=True),
        Column("smallest", spec=".4f"),
        Column("largest", spec=".4f"),
        Column("radius"),
        Column("margin"),
    ]
    rows = []
    for check in checks.checks:
        if spectrum := check.spectrum:
            small = "good" if spectrum.is_sound else "bad"
            word = "sound" if spectrum.margin >= LEAST_MARGIN else "small"
            rows.append(
                [
                    check.law,
                    spectrum.smallest,
                    spectrum.largest,
                    JudgedCell(f"{spectrum.radius:.4f} < 1", *_holds(spectrum.contracts)),
                    JudgedCell(
                        f"{spectrum.margin:.2%}", word if spectrum.contracts else "none", small
                    ),
                ]
            )
    inertia = "H_S" if checks.flight.controls_base else "H_f"
    table = Table.of(f"Eigenvalues of {inertia}^-1 h_bar along the mission", columns, rows)
    notes = [
        "The margin is the share by which the torque reported may exceed the one commanded "
        "until the time-delay estimate diverges."
    ]
    if nominal := [check.law for check in checks.checks if check.law in checks.with_model]:
        notes.append(f"h_bar of {', '.join(nominal)} is {inertia} of the nominal model.")
    return Table(table.title, table.columns, table.groups, notes)


def _wrong_masses(checks: Checked) -> Table:
    columns = [
        Column("", is_label=True),
        Column("smallest", spec=".4f"),
        Column("largest", spec=".4f"),
        Column("smallest\ndrawn", spec=".4f"),
        Column("largest\ndrawn", spec=".4f"),
    ]
    masses = {check.law: check.masses for check in checks.checks if check.masses}
    rows = [
        [law, own.smallest, own.largest, own.smallest_drawn, own.largest_drawn]
        for law, own in masses.items()
    ]
    share = next(iter(masses.values())).share
    title = f"The same with masses and inertias wrong by {share:.0%}"
    table = Table.of(title, columns, rows)
    note = f"Bounds for all such robots, and the extremes of {DRAWS} drawn at random."
    return Table(table.title, table.columns, table.groups, [note])


def _loops(checks: Checked) -> Table:
    columns = [Column("", is_label=True), Column("radius"), Column("margin")]
    rows = []
    for check in checks.checks:
        radius = JudgedCell(f"{check.loop.radius:.6f}", *_holds(check.loop.is_stable))
        margin: JudgedCell | None = None
        if (share := check.loop.margin) is not None:
            word, verdict = ("sound", "good") if check.loop.has_margin else ("small", "bad")
            word = word if check.loop.is_stable else "none"
            margin = JudgedCell(f"{share:.2%}", word, verdict)
        rows.append([check.law, radius, margin])
    table = Table.of("Stability of the closed loop along the mission", columns, rows)
    notes = ["A small motion of the rigid robot grows by the radius in a tick if it is above 1."]
    if any(check.loop.margin is not None for check in checks.checks):
        notes.append("The margin of observers is that of the loop; 100 % is the largest searched.")
    return Table(table.title, table.columns, table.groups, notes)


def _frequencies(checks: Checked) -> Table:
    columns = [
        Column("", is_label=True),
        Column("lowest", spec=".3f"),
        Column("highest", spec=".3f"),
    ]
    rows = [[name, *extremes] for name, extremes in checks.frequencies.items()]
    return Table.of("Frequency of each gear's spring along the mission, Hz", columns, rows)


def _with_gears(checks: Checked) -> Table:
    columns = [
        Column("", is_label=True),
        Column("radius"),
        Column("largest\nbandwidth"),
        Column("largest\nh_bar", spec=".3g"),
    ]
    rows = []
    for check in checks.checks:
        if flexible := check.flexible:
            corner = flexible.largest_corner_hz
            text: str | None = "any" if corner is None else f"{corner:.3g} Hz"
            text = text if check.law in checks.with_pair else None
            stable = JudgedCell(f"{flexible.radius:.6f}", *_holds(flexible.is_stable))
            rows.append([check.law, stable, text, flexible.largest_h_bar_scale])
    table = Table.of("Stability with the springs of the gears along the mission", columns, rows)
    note = (
        "An oscillation grows by the radius in a tick if it is above 1. The bandwidth is the "
        "largest controller.acceleration_filter_hz, and h_bar the largest factor on all of h_bar "
        "(of an observer: on its inertia), with which it does not; switching terms are not counted."
    )
    return Table(table.title, table.columns, table.groups, [note])


def _holds(value: bool) -> tuple[str, str]:
    return ("holds", "good") if value else ("fails", "bad")


def _noise_gains(checks: Checked) -> Table:
    columns = [
        Column("", is_label=True),
        *(Column(check.law, spec=".3g") for check in checks.checks),
    ]
    rows = [
        [name, *(float(check.noise_gain[axis]) for check in checks.checks)]
        for axis, name in enumerate(_axes(checks, "N s/m"))
    ]
    title = "Torque that noise on the rate of an axis becomes, N m per rad/s"
    return Table.of(title, columns, rows)


def _axes(checks: Checked, of_prismatic: str) -> list[str]:
    """Name the axes, those of prismatic joints with the unit of their own."""
    robot = checks.flight.robot
    slides = (False, False, False, *robot.is_prismatic[: robot.n])
    return [
        f"{name} ({of_prismatic})" if is_prismatic else name
        for name, is_prismatic in zip(robot.axis_names, slides, strict=True)
    ]


def _ripple(checks: Checked) -> Table:
    columns = [Column("", is_label=True), *(Column(law, spec=".3g") for law in checks.ripple)]
    rows = [
        [name, *(None if x is None else float(x[axis]) for x in checks.ripple.values())]
        for axis, name in enumerate(_axes(checks, "N"))
    ]
    sensors = checks.flight.plant_settings.sensors
    table = Table.of(f"Torque ripple with sensors {sensors}, held still, N m RMS", columns, rows)
    diverged = [law for law, ripple in checks.ripple.items() if ripple is None]
    notes = [f"Held still, {', '.join(diverged)} diverged."] if diverged else []
    return Table(table.title, table.columns, table.groups, notes)
