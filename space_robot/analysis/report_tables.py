"""The tables of a report, or of several: what the terminal and the page both show."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from itertools import groupby
from typing import Any, NamedTuple

from ..console.tables import NONE, Column, Group, Table
from .described import IDEAL
from .metrics import unit_of
from .pointing import ARCSEC
from .settling import BAND
from .words import Report, flown, law_of, notes, remarks, seen_through

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
    f"{BAND:g} (rad or m on joints; on the attitude's quaternion, where it is 4.1 arcsec)",
    "saturation": "ticks at which a torque was at the actuator's limit; of each wheel those at its "
    "largest torque and at its largest momentum",
    "latency": "from a state's sending to its command's, by the wall clock; in brackets in ticks",
    "commands": "ticks without an answer, and ticks after which the plant applied another torque "
    "than was commanded for them",
    "estimate error": "error N - N_hat of the time-delay estimate, from recorded motion and "
    "torque; on the base in units of the generalised force of eps, about twice the torque",
    "pointing": "angle between the measured and the desired direction of the end effector's z "
    "axis in the inertial frame",
    "rotation": "angle of the one rotation between the end effector's desired and measured frame",
    "tool position": "distance from the desired position, the base at its measured position",
    "base's drift": "of the base's centre of mass from where it began; nothing holds it",
    "tool on its path": "distance and rotation of the end effector from the path that the mission "
    "leads along, on inertial axes",
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

WIDE = 1e6
"""Torques from which on a number is written with an exponent: of diverged flights."""


class Line(NamedTuple):
    """One metric of each report."""

    group: str
    """A key of `DEFINITIONS`."""
    name: str
    unit: str
    texts: list[str]
    """One a report; `NONE` where it does not have the metric."""


def rms_table(report: Report) -> Table:
    """Tabulate RMS, chatter and ripple of a flight; its remarks stand below.

    Where the truth was recorded, the navigation error stands in the place of (64).
    """
    title = f"{flown(report)}: {report['ticks']} ticks, {report['duration_s']:g} s"
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
    for key, value in report["rms"]["mean_axis"].items():
        is_torque = unit_of(key).startswith("N")
        rms = _rms(value, is_torque), beside[key] and _rms(beside[key], is_torque)
        rows.append([key, unit_of(key), *rms, *(measure.get(key, "") for measure in rough)])
    return Table(title, columns, [Group(rows)], remarks(report))


def _rms(value: float, is_torque: bool) -> str:
    return f"{value:.4f}" if is_torque and value < WIDE else f"{value:.3e}"


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


def lines(reports: Sequence[Report], brief: bool = False) -> list[Line]:
    """List all metrics of the reports, a line each.

    Args:
        reports: of `analyze`.
        brief: without what `rms_table` shows.
    """
    each, one = partial(_each_key, reports), partial(_line, reports)
    rows: list[Line] = []
    if not brief:
        rows += each("RMS, mean of axes", ("rms", "mean_axis"), unit_of)
        rows += each("RMS, eq. (64)", ("rms", "eq64"), unit_of)
        rows += each("variation per s", ("chatter", "total_variation_per_s"), _per_second)
        rows += each("power > 100 Hz", ("chatter", "power_above_100_hz"))
        rows += each("ripple", ("ripple", "rms"), unit_of)
    rows += each("ripple's peak", ("ripple", "peak"), text_of=_peak_of)
    rows += each("attitude drift", ("attitude_drift",), "deg", label=_end_or_max)
    rows += each("navigation error", ("navigation_error", "rms"), unit_of)
    rows += each("maximum", ("maxima",), unit_of)
    rows += each("settled after", ("settling", "settled_s"), "s", text=_settled)
    rows.append(one("saturation", "ticks at a limit", "", _saturated))
    rows += each("saturation", ("wheel_saturation", "wheels"), "", text=_full)
    for name in ("p50", "p99", "max"):
        rows.append(one("latency", name, "ms", partial(_latency, name=name)))
    rows.append(one("commands", "unanswered", "", lambda r: str(r["unanswered_ticks"])))
    rows.append(one("commands", "not as commanded", "", _differing))
    for kind in ("rms", "max"):
        label = partial(_axes, kind=kind)
        rows += each("estimate error", ("estimate_error", kind), _group_unit, label=label)
    for group, key in (("pointing", "boresight_rad"), ("rotation", "rotation_rad")):
        rows += each(group, ("pointing", key), text=_angle, label=_upper)
    for group, key in (("tool position", "tool_position_m"), ("base's drift", "base_drift_m")):
        rows += each(group, ("pointing", key), "m", label=_upper)
    rows += each("tool on its path", ("tool",), lambda key: key.split("_")[-1], label=_kind)
    rows += each("momentum", ("momentum", "peak_n_m_s"), "N m s", label="{} at most".format)
    rows += each(
        "momentum",
        ("momentum", "drift"),
        lambda key: "N m s" if key == "n_m_s" else "",
        text=_drift,
        label=lambda key: "drift" if key == "n_m_s" else "drift, relative",
    )
    rows += each("pushed by thrusters", ("momentum", "pushed_m"), "m")
    for key, name, unit in (
        ("rms_n_m", "RMS", "N m"),
        ("max_n_m", "max", "N m"),
        ("impulse_n_m_s", "impulse", "N m s"),
    ):
        rows += each(
            "disturbance torque",
            ("disturbance_by_source",),
            unit,
            text=partial(_of_axis, key=key),
            label=partial(_named, name=name),
        )
    for kind in ("rms", "largest"):
        label = partial(_named, name=_upper(kind))
        rows += each("deflection", ("deflection", kind), "rad or m", label=label)
    if not brief:
        for key, name, unit in (
            ("peak_torque_n_m", "torque", "N m"),
            ("peak_momentum_n_m_s", "momentum", "N m s"),
        ):
            rows += each(
                "asked of the base",
                ("sizing", "axes"),
                unit,
                text=partial(_of_axis, key=key),
                label=partial(_named, name=name),
            )
    rows += each("own metric", ("own_metrics",))
    return [
        *rows,
        one("recording", "messages lost", "", lambda r: str(sum(r["lost"].values()))),
        one("recording", "states filled in", "", lambda r: str(r["filled_ticks"])),
        one("recording", "finished", "", lambda r: "no" if r["unfinished"] else "yes"),
        one("recording", "damage found", "", lambda r: str(len(r["damage"]))),
    ]


def _errors_of(report: Report) -> str:
    if report["truth_recorded"]:
        return "the truth"
    return "the truth" if report["sensors"] == IDEAL else "what was measured"


def _number(value: float) -> str:
    return f"{value:.4g}"


def _each_key(
    reports: Sequence[Report],
    group: str,
    path: tuple[str, ...],
    unit: str | Callable[[str], str] = "",
    text: Callable[[Any], str] = _number,
    label: Callable[[str], str] = str,
    text_of: Callable[[str], Callable[[Any], str]] | None = None,
) -> list[Line]:
    """Make a line for every key below ``path`` in any of the reports.

    ``text`` writes a value, or the one that ``text_of`` has for its key.
    """
    below = [_at(report, path) for report in reports]
    return [
        Line(
            group,
            label(key),
            unit if isinstance(unit, str) else unit(key),
            [write(values[key]) if key in values else NONE for values in below],
        )
        for key in dict.fromkeys(key for values in below for key in values)
        for write in [text_of(key) if text_of else text]
    ]


def _at(report: Report, path: tuple[str, ...]) -> dict[str, Any]:
    value: Any = report
    for key in path:
        value = (value or {}).get(key)
    return value or {}


def _line(
    reports: Sequence[Report], group: str, name: str, unit: str, text: Callable[[Report], str]
) -> Line:
    return Line(group, name, unit, [text(report) for report in reports])


def _angle(value: float) -> str:
    arcsec = value / ARCSEC
    readable = f"{arcsec:.3g} arcsec" if arcsec < 3600 else f"{arcsec / 3600:.3g} deg"
    return f"{value:.3g} rad\n{readable}"


def _peak_of(column: str) -> Callable[[dict[str, float] | None], str]:
    return partial(_peak, unit=unit_of(column))


def _peak(value: dict[str, float] | None, unit: str) -> str:
    return f"{value['frequency_hz']:.4g} Hz\n{value['rms']:.2e} {unit}" if value else NONE


def _per_second(column: str) -> str:
    return f"{unit_of(column)}/s"


def _group_unit(group: str) -> str:
    """Return the unit of the force of a group of axes."""
    return "N" if group == "prismatic" else "N m"


def _drift(value: float | None) -> str:
    return NONE if value is None else f"{value:.2e}"


def _of_axis(values: dict[str, float], key: str) -> str:
    return _number(values[key])


def _named(key: str, name: str) -> str:
    return f"{key} {name}"


def _settled(value: float | None) -> str:
    return "never" if value is None else _number(value)


def _saturated(report: Report) -> str:
    saturation = report["saturation"]
    if saturation is None:
        return NONE
    if saturation["base_torque_limit_n_m"] is None and saturation["joint_torque_limit_n_m"] is None:
        return "no limits"
    return f"{saturation['ticks']} ({saturation['share']:.2%})"


def _full(wheel: dict[str, Any]) -> str:
    """Write how long a wheel was at its limits, and since when."""
    if wheel["first_s"] is None:
        return "never"
    torque, momentum = wheel["torque_limit_ticks"], wheel["momentum_limit_ticks"]
    return f"torque {torque}, momentum {momentum}\nfirst at {wheel['first_s']:g} s"


def _latency(report: Report, name: str) -> str:
    latency = report["latency"]
    return f"{latency[f'{name}_ms']:.3g} ({latency[f'{name}_ticks']:.3g})" if latency else NONE


def _differing(report: Report) -> str:
    deadlines = report["missed_deadlines"]
    return str(deadlines["differing_ticks"]) if deadlines else NONE


def _axes(key: str, kind: str) -> str:
    return f"{key if key == 'base' else f'joints_{key}'} {_upper(kind)}"


def _kind(key: str) -> str:
    size = "RMS" if key.startswith("rms") else "max"
    return f"rotation, {size}" if key.endswith("deg") else size


def _end_or_max(key: str) -> str:
    return key.removesuffix("_deg")


def _upper(kind: str) -> str:
    return kind.upper() if kind == "rms" else kind
