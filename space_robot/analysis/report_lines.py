"""The metrics of one or more reports as lines of text, grouped."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any, NamedTuple

from ..console.tables import NONE
from .metrics import unit_of
from .pointing import ARCSEC, BASE_ANGLES
from .words import Report

OF_BASE = ("base, half cone", "base, about the axis", "base, rotation")
"""Groups of the angles of the base's pointing."""


class Line(NamedTuple):
    """One metric of each report."""

    group: str
    """A key of `space_robot.analysis.report_tables.DEFINITIONS`."""
    name: str
    unit: str
    texts: list[str]
    """One a report; `NONE` where it does not have the metric."""


def lines(reports: Sequence[Report], brief: bool = False) -> list[Line]:
    """List all metrics of the reports, a line each.

    Args:
        reports: of `analyze`.
        brief: without what `rms_table` shows.
    """
    each, one = partial(_each_key, reports), partial(_line, reports)
    in_angles = partial(_each_key, [with_angles(report) for report in reports], label=named)
    rows: list[Line] = []
    if not brief:
        rows += in_angles("RMS, mean of axes", ("rms", "mean_axis"), unit_of)
        rows += in_angles("RMS, eq. (64)", ("rms", "eq64"), unit_of)
        rows += each("variation per s", ("chatter", "total_variation_per_s"), _per_second)
        rows += each("power > 100 Hz", ("chatter", "power_above_100_hz"))
        rows += each("ripple", ("ripple", "rms"), unit_of)
    rows += each("ripple's peak", ("ripple", "peak"), text_of=_peak_of)
    rows += each("attitude drift", ("attitude_drift",), "deg", label=_end_or_max)
    rows += in_angles("navigation error", ("navigation_error", "rms"), unit_of)
    rows += in_angles("maximum", ("maxima",), unit_of)
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
    for key, group in zip(BASE_ANGLES, OF_BASE, strict=True):
        rows += each(group, ("base_pointing", key), text_of=_of_base, label=_kind_of_base)
    for group, key in (("pointing", "boresight_rad"), ("rotation", "rotation_rad")):
        rows += each(group, ("pointing", key), text=_angle, label=_upper)
    for group, key in (("tool position", "tool_position_m"), ("base's drift", "base_drift_m")):
        rows += each(group, ("pointing", key), "m", label=_upper)
    rows += each(
        "tool on its path",
        ("tool",),
        lambda key: key.split("_")[-1],
        label=_kind,
        text_of=lambda key: _moved if key == "drift_m" else _number,
    )
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


def with_angles(report: Report) -> Report:
    """Return a report in whose columns of errors the attitude's are angles, see `in_angles`."""
    angles, navigation = report["attitude_error_deg"], report["navigation_error"]
    changed: Report = {}
    if angles:
        rms = {
            kind: in_angles(columns | {"attitude_deg": angles[kind]})
            for kind, columns in report["rms"].items()
        }
        maxima = in_angles(report["maxima"] | {"attitude_deg": angles["max"]})
        changed |= {"rms": rms, "maxima": maxima}
    if navigation and (angles := navigation.get("attitude_deg")):
        of_law = in_angles(navigation["rms"] | {"attitude_deg": angles["rms"]})
        changed |= {"navigation_error": navigation | {"rms": of_law}}
    return report | changed


def in_angles(columns: Mapping[str, float]) -> dict[str, float]:
    """Return columns with ``attitude_deg`` in the place of the vector part ``attitude``."""
    if "attitude_deg" not in columns:
        return dict(columns)
    names = ("attitude_deg" if name == "attitude" else name for name in columns)
    return {name: columns[name] for name in names}


def named(column: str) -> str:
    """Return the label of a column, which has its unit elsewhere."""
    return column.removesuffix("_deg")


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
    return f"{value:.3g} rad\n{_readable(value / ARCSEC)}"


def _readable(arcsec: float | None) -> str:
    if arcsec is None:
        return NONE
    return f"{arcsec:.3g} arcsec" if arcsec < 3600 else f"{arcsec / 3600:.3g} deg"


def _of_base(kind: str) -> Callable[[Any], str]:
    return "{:.2%}".format if kind == "within_band" else _readable


def _kind_of_base(kind: str) -> str:
    """Return the label of a key of the base's pointing: ``jitter, RMS`` for ``jitter_rms``."""
    words = kind.split("_")
    if kind == "within_band":
        return "time within the band"
    return ", ".join(_upper(word) for word in words)


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


def _moved(value: float) -> str:
    """Write a distance, m, that is zero but for rounding where nothing pushes the robot."""
    return _number(value) if value > 1e-9 else "0"


def _kind(key: str) -> str:
    if key == "drift_m":
        return "the path's drift"
    size = "RMS" if key.startswith("rms") else "max"
    return f"rotation, {size}" if key.endswith("deg") else size


def _end_or_max(key: str) -> str:
    return key.removesuffix("_deg")


def _upper(kind: str) -> str:
    return kind.upper() if kind == "rms" else kind
