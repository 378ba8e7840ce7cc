"""Sentences on what was flown, and on what a report's numbers do not say."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any

from space_robot_control.controller.law_choice import NoLaw
from space_robot_msgs_py.bag.law_history import in_words

from ..flight.start_step import sentence
from .actuation import LIMIT_KINDS, LONG_STANDING
from .errors import FREE
from .measure import column_definition

Report = dict[str, Any]
Metrics = Mapping[str, float]

FASTEST_CYCLE = 100.0
"""Hz; faster is chatter, which has a column of its own."""
PURE_CYCLE, LARGE_CYCLE = 0.5, 0.1
"""Least RMS of a limit cycle as a share of the torque's ripple, and of the whole torque."""
OFTEN_REVERSED = 1.0
"""Changes of a wheel's sense of rotation, 1/s, that are worth a warning."""
NEAR = 0.9
"""Share of a limit of effort from which on it is near."""
LASTING_CYCLE = 0.5
"""Least share of a flight's segments that have the ripple of a limit cycle; a burst has less."""


WARNING_GROUPS = (
    *("torques", "ripple", "wheel_saturation", "wheel_reversals", "standing"),
    *("beyond_limits", "effort_used"),
)
"""The groups of metrics that `warnings` needs."""


def flown(described: Mapping[str, Any]) -> str:
    """Say in a few words what was flown, by a report or the description in a bag."""
    law = law_text(described)
    has_gains = law != NoLaw.name
    keys = ("case", "gains") if has_gains else ("case",)
    known = [f"{key} {described[key]}" for key in keys if described.get(key)]
    if own := described.get("own_gains"):
        known.append(f"own {', '.join(own)}")
    return ", ".join([str(law or "unknown law") if has_gains else "torques from outside", *known])


def analyzed(report: Report) -> str:
    """Say how much was analyzed, and what share of the flight that is if it is not all of it."""
    ticks, flight_ticks = report["ticks"], report["flight_ticks"]
    seconds = f"{report['duration_s']:g} s"
    if ticks == flight_ticks:
        return f"{ticks} ticks, {seconds}"
    return f"{ticks / flight_ticks:.1%} of the flight, {ticks} of {flight_ticks} ticks, {seconds}"


def seen_through(report: Report) -> str:
    """Say through which sensors and navigation the law saw, and that errors are of the truth."""
    faults = ", faults" if report["faults"] else ""
    return (
        f"sensors {report['sensors']}{faults}, navigation {report['navigation']}; "
        "errors and torques are the true ones"
    )


def law_text(described: Mapping[str, Any]) -> str | None:
    """Name the law, or all the laws and when they changed; None: nobody says."""
    return in_words(described.get("laws", ())) or described.get("controller")


def remarks(report: Report) -> list[str]:
    """Say in sentences what was lost, damaged or left unanswered."""
    metrics = report["metrics"]
    lost = {topic: count for topic, count in report["lost"].items() if count}
    return [
        f"messages lost: {lost or 'none'}",
        *_beginning(report),
        *_missed_captures(metrics),
        *_drift(metrics),
        *_pointing(report["pointing"], metrics),
        *report["warnings"],
        *filter(None, (report["unfinished"], *report["damage"])),
        *_missing_ticks(report),
    ]


def warnings(metrics: Metrics) -> list[str]:
    """Say what should not be in a flight: limits met, limit cycles; each as ``what: where``."""
    return [
        *_saturated_wheels(metrics),
        *_reversing_wheels(metrics),
        *limit_cycles(metrics),
        *_standing_joints(metrics),
        *_beyond_limits(metrics),
        *_near_limits(metrics),
    ]


def _beginning(report: Report) -> Iterator[str]:
    if step := report.get("start_step"):
        yield sentence(step)
    if report["events"]:
        yield f"events: {', '.join(report['events'])}"
    if disturbance := report.get("disturbance"):
        yield f"disturbance of the user's own, unknown to the law: {disturbance}"


def _missed_captures(metrics: Metrics) -> Iterator[str]:
    for name, distance in metrics.items():
        if name.startswith("missed."):
            yield (
                f"{name.removeprefix('missed.')} did not happen: the target was {distance:.3g} m "
                "from where the tool holds it"
            )


def _drift(metrics: Metrics) -> Iterator[str]:
    if "attitude_drift.max" in metrics:
        most, end = (math.degrees(metrics[f"attitude_drift.{key}"]) for key in ("max", "end"))
        yield (
            f"{FREE}: its attitude is no error but drift, {most:.4g} deg at most and "
            f"{end:.4g} deg at the end, which pointing includes"
        )


def _pointing(base: dict[str, Any] | None, metrics: Metrics) -> Iterator[str]:
    if not base or not base["points"]:
        return
    jitter = metrics.get("half_cone.jitter_rms")
    within = "" if jitter is None else f", jitter {jitter:.3g} within {base['window_s']:g} s"
    yield (
        f"the base points: half cone from the reference {metrics['half_cone.rms']:.3g} arcsec RMS, "
        f"{metrics['half_cone.max']:.3g} at most{within}; about the axis "
        f"{metrics['about_axis.rms']:.3g} RMS, {metrics['about_axis.max']:.3g} at most"
    )


def _saturated_wheels(metrics: Metrics) -> Iterator[str]:
    if first := with_statistic(metrics, "first_limit"):
        name = min(first, key=lambda wheel: first[wheel])
        yield (
            "wheels at a limit of torque or momentum: "
            f"{metrics['wheels.saturation_ticks']:.0f} ticks "
            f"({metrics['wheels.saturation']:.2%}), {name} first at {first[name]:g} s"
        )


def _reversing_wheels(metrics: Metrics) -> Iterator[str]:
    rates = with_statistic(metrics, "reversals")
    if often := [f"{name} {rate:.2g}" for name, rate in rates.items() if rate >= OFTEN_REVERSED]:
        yield f"wheels that change their sense of rotation: {', '.join(often)} times a second"


def limit_cycles(metrics: Metrics, allowed: Metrics | None = None) -> Iterator[str]:
    """Say which torques oscillate at one frequency, by more than a share of what they do.

    ``allowed``: RMS of the torques, N m or N, that does not count.
    """
    cycles = [
        f"{name} at {metrics[f'{name}.ripple_peak_hz']:.3g} Hz with {peak:.2g} "
        f"{column_definition(name).unit} RMS"
        for name, peak in with_statistic(metrics, "ripple_peak").items()
        if metrics[f"{name}.ripple_peak_hz"] <= FASTEST_CYCLE
        and metrics.get(f"{name}.ripple_lasting", 0.0) >= LASTING_CYCLE
        and peak >= PURE_CYCLE * metrics[f"{name}.ripple"]
        and peak >= max(LARGE_CYCLE * metrics[f"{name}.rms"], (allowed or {}).get(name, 0.0))
    ]
    if cycles:
        yield f"limit cycle: {', '.join(cycles)}"


def _standing_joints(metrics: Metrics) -> Iterator[str]:
    standing = with_statistic(metrics, "standing")
    much = [f"{name} {share:.0%}" for name, share in standing.items() if share >= LONG_STANDING]
    if much:
        yield f"joints that stood still on a part of the way they were to move: {', '.join(much)}"


def _beyond_limits(metrics: Metrics) -> Iterator[str]:
    joints = []
    for name in with_statistic(metrics, "beyond_position"):
        ticks = {kind: metrics[f"{name}.beyond_{kind}"] for kind in LIMIT_KINDS}
        if texts := [f"{kind} at {count:.0f} ticks" for kind, count in ticks.items() if count]:
            joints.append(f"{name} ({', '.join(texts)})")
    if joints:
        yield f"joints beyond the limits of the robot's file: {', '.join(joints)}"


def _near_limits(metrics: Metrics) -> Iterator[str]:
    shares = with_statistic(metrics, "effort_used")
    if near := [f"{name} {share:.0%}" for name, share in shares.items() if NEAR <= share <= 1.0]:
        yield f"joints near their limit of effort: {', '.join(near)}"


def _missing_ticks(report: Report) -> Iterator[str]:
    if report["unanswered_ticks"]:
        yield f"ticks that no command was recorded for: {report['unanswered_ticks']}"
    if report["filled_ticks"]:
        yield f"ticks without a usable state, shown as the one before: {report['filled_ticks']}"


def with_statistic(metrics: Metrics, statistic: str) -> dict[str, float]:
    """Return the metrics of one statistic, by what they are of."""
    end = f".{statistic}"
    return {k.removesuffix(end): value for k, value in metrics.items() if k.endswith(end)}


def notes(report: Report) -> list[str]:
    """Say of single metrics from where they count, or why there is none."""
    missing = [f"no {key.replace('_', ' ')}: {why}" for key, why in report["unavailable"].items()]
    counted = []
    if (after := report["metrics"].get("settling.after")) is not None:
        counted = [f"settling is counted from the waypoint at {after:g} s"]
    if base := report["pointing"]:
        axis = ", ".join(f"{value:.3g}" for value in base["axis"])
        counted.append(
            f"the base points its axis ({axis}): band {base['band_deg']:g} deg, jitter within "
            f"{base['window_s']:g} s"
        )
    return [*counted, *missing]
