"""The tables of a report, or of several: what the terminal and the page both show."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import groupby
from typing import Any

from ..console.tables import Column, Group, Table
from .described import IDEAL
from .metrics import unit_of
from .report_lines import OF_BASE, Line, lines, named, with_angles
from .settling import BAND
from .words import Report, analyzed, flown, law_of, notes, remarks, seen_through

DEFINITIONS = {
    "RMS, mean of axes": "mean over a column's axes of each axis' root mean square: what Table V "
    "of the paper holds",
    "RMS, eq. (64)": "a third of the root mean square of the vector: what the paper defines",
    "maximum": "largest absolute value on any axis of the column",
    "attitude drift": "angle by which the base has turned from where it was at the first tick, of "
    "a flight in which nothing turns it",
    "navigation error": "true attitude and joints less those that the law assumed, at the "
    "ticks of its telemetry: RMS, mean of axes",
    "variation per s": "how far the torque moves up and down in a second, mean over the axes",
    "power > 100 Hz": "share of the torque's power above 100 Hz, mean over the axes: chatter",
    "ripple": "root mean square, above 2 Hz, of the torque beside the one that inverse dynamics "
    "asks for along the reference, mean over the axes: limit cycles, noise and switching",
    "ripple's peak": "frequency at which the ripple's spectrum is highest, and the root mean "
    "square of what is within 0.5 Hz of it",
    "settled after": "time from the last waypoint after which the error stays to the end within "
    f"{BAND:g} rad or m on joints, and 4.1 arcsec of the attitude's error on each axis",
    "saturation": "ticks at which a torque was at the actuator's limit; of each wheel those at its "
    "largest torque and at its largest momentum",
    "latency": "from a state's sending to its command's, by the wall clock; in brackets in ticks",
    "commands": "ticks without an answer, and ticks after which the plant applied another torque "
    "than was commanded for them",
    "estimate error": "error N - N_hat of the time-delay estimate, from recorded motion and "
    "torque; on the base in units of the generalised force of eps_e, about twice the torque",
    OF_BASE[0]: "angle between the true and the desired direction of the base's axis that points "
    "(of the mission's first pointing segment, else z); band and window: base_pointing in JSON; "
    "jitter is the difference from the mean in a window",
    OF_BASE[1]: "the base's rotation about that axis from the desired attitude",
    OF_BASE[2]: "angle of the one rotation between the base's desired and true attitude",
    "pointing": "angle between the measured and the desired direction of the end effector's z "
    "axis in the inertial frame",
    "rotation": "angle of the one rotation between the end effector's desired and measured frame",
    "tool position": "distance from the desired position, the base at its measured position",
    "base's drift": "of the base's centre of mass from where it began; nothing holds it",
    "tool on its path": "distance and rotation of the end effector from the path that the mission "
    "leads along, on inertial axes; the path moves with the common centre of mass, where drag, "
    "thrusters or a captured target move that, which is its drift",
    "momentum": "largest angular momentum about the common centre of mass: of the robot with "
    "its wheels locked, of its base in that, of the wheels' spin, and what came from outside; and "
    "how far robot and wheels together drifted from what is conserved",
    "disturbance torque": "in orbit, of each source about the common centre of mass: RMS, largest, "
    "and the impulse, the largest angular momentum that it has given since the first tick",
    "deflection": "of joints with gears, motor angle less link angle",
    "pushed by thrusters": "of the centre of mass of the whole robot, from where it was at the "
    "first tick",
    "asked of the base": "largest torque commanded on each axis of the base, and the largest "
    "momentum that wheels have to hold for it",
    "own metric": "what a function of your own returned for the flight",
    "recording": "what is missing of the flight or was found wrong with the bag",
}
"""The meaning of each group of metrics, for someone who sees it for the first time."""

WIDE = 1e4
"""Torque from which on all torques of a table are written with exponents: of diverged flights."""


def rms_table(report: Report) -> Table:
    """Tabulate RMS, chatter and ripple of a flight; its remarks stand below.

    Where the truth was recorded, the navigation error stands in the place of (64).
    """
    report = with_angles(report)
    title = f"{flown(report)}: {analyzed(report)}"
    if report["truth_recorded"]:
        title += f"\n{seen_through(report)}"
    navigation = report["navigation_error"]
    columns = (
        Column(is_label=True),
        Column("unit"),
        Column("RMS, mean\nof axes"),
        Column("naviga-\ntion RMS" if navigation else "RMS, eq.\n(64)"),
        Column("variation\nper s", spec=".3g"),
        Column("power >\n100 Hz", spec=".2e"),
        Column("ripple", spec=".2e"),
    )
    beside = report["rms"]["eq64"]
    if navigation:
        beside = dict.fromkeys(beside, "") | navigation["rms"]
    rough = *report["chatter"].values(), (report["ripple"] or {}).get("rms", {})
    rows: list[list[Any]] = []
    of_axes: dict[str, float] = report["rms"]["mean_axis"]
    torques = {key for key in of_axes if unit_of(key).startswith("N")}
    is_wide = any(of_axes[key] >= WIDE for key in torques)
    for key, value in of_axes.items():
        has_exponent = is_wide or key not in torques
        rms = _rms(value, has_exponent), beside[key] and _rms(beside[key], has_exponent)
        rows.append([named(key), unit_of(key), *rms, *(measure.get(key, "") for measure in rough)])
    return Table(title, columns, [Group(rows)], remarks(report))


def _rms(value: float, has_exponent: bool) -> str:
    return f"{value:.3e}" if has_exponent else f"{value:.4f}"


def metrics_table(report: Report) -> Table:
    """Tabulate what `rms_table` leaves out; below stands why a metric is missing."""
    columns = Column(is_label=True), Column()
    return Table("further metrics", columns, _groups(lines([report], brief=True)), notes(report))


def comparison_table(reports: Mapping[str, Report]) -> Table:
    """Tabulate all metrics of several bags, a column each."""
    each = list(reports.values())
    flights: list[list[Any]] = [["controller", *map(law_of, each)]]
    described = ["case", "gains", "robot"]
    if any(report["truth_recorded"] or report["sensors"] != IDEAL for report in each):
        described += ["sensors", "navigation"]
        flights.append(["errors are of", *map(_errors_of, each)])
    for key in described:
        flights.append([key, *(report[key] and str(report[key]) for report in each)])
    flights.append(["time (s)", *(f"{r['from_s']:g} to {r['to_s']:g}" for r in each)])
    if any(report["ticks"] < report["flight_ticks"] for report in each):
        flights.append(["share analyzed", *(f"{r['ticks'] / r['flight_ticks']:.1%}" for r in each)])
    columns = Column(is_label=True), *(Column(name) for name in reports)
    return Table("", columns, [Group(flights, "flight"), *_groups(lines(each))])


def _groups(shown: Sequence[Line]) -> list[Group]:
    return [
        Group(
            [[f"{x.name} ({x.unit})" if x.unit else x.name, *x.texts] for x in lines],
            name,
            DEFINITIONS[name],
        )
        for name, lines in groupby(shown, key=lambda line: line.group)
    ]


def _errors_of(report: Report) -> str:
    if report["truth_recorded"]:
        return "the truth"
    return "the truth" if report["sensors"] == IDEAL else "what was measured"
