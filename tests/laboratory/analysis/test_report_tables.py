"""Every line of a comparison table shows the figure that its label says, of each flight."""

from __future__ import annotations

import copy
import itertools
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from random_logs import random_log

from space_robot.analysis import analyze
from space_robot.analysis.metrics import unit_of
from space_robot.analysis.report_lines import Line, lines
from space_robot.analysis.report_tables import DEFINITIONS, rms_table
from space_robot.console.tables import NONE
from space_robot.flight.plan import Flight, FlightPlan, resolve
from space_robot.flight.simulate import simulate

GROUPS = {"base": "base", "1_3": "joints_1_3", "4_6": "joints_4_6"}
PATHS: dict[str, tuple[str, ...]] = {
    "RMS, mean of axes": ("rms", "mean_axis"),
    "RMS, eq. (64)": ("rms", "eq64"),
    "maximum": ("maxima",),
    "variation per s": ("chatter", "total_variation_per_s"),
    "power > 100 Hz": ("chatter", "power_above_100_hz"),
    "ripple": ("ripple", "rms"),
    "settled after": ("settling", "settled_s"),
    "navigation error": ("navigation_error", "rms"),
}
"""Groups with a line for every key below."""
ANGLES: dict[str, Callable[[dict[str, Any]], float]] = {
    "RMS, mean of axes": lambda r: r["attitude_error_deg"]["mean_axis"],
    "RMS, eq. (64)": lambda r: r["attitude_error_deg"]["eq64"],
    "maximum": lambda r: r["attitude_error_deg"]["max"],
    "navigation error": lambda r: r["navigation_error"]["attitude_deg"]["rms"],
}
"""The attitude's angle in degrees, in the place of the quaternion's vector part."""
OF_BASE = {
    "base, half cone": "half_cone_arcsec",
    "base, about the axis": "about_arcsec",
    "base, rotation": "rotation_arcsec",
}
POINTING = {
    "pointing": "boresight_rad",
    "rotation": "rotation_rad",
    "tool position": "tool_position_m",
    "base's drift": "base_drift_m",
}


def numbered(value: Any, counter: itertools.count[int]) -> Any:
    """The same report with another number in every place."""
    if isinstance(value, dict):
        return {key: numbered(v, counter) for key, v in value.items()}
    if isinstance(value, float):
        return 1.0 + next(counter) / 1000.0
    return 100 + next(counter) if type(value) is int else value


@pytest.fixture(scope="module")
def reports() -> list[dict[str, Any]]:
    log = simulate(Flight(resolve(FlightPlan(duration=1.0, faults=["noise_gyro@0:1e-9"]))))
    log.latency_s = np.linspace(1e-4, 3e-4, log.ticks)
    log.flight["parameters"]["plant"] |= {"base_torque_limit": 1.0, "joint_torque_limit": 1.0}
    report = analyze(log)
    assert report["unavailable"] == {}
    counter = itertools.count()
    return [numbered(copy.deepcopy(report), counter) for _ in range(3)]


def by_label(found: list[Line]) -> dict[tuple[str, str], Line]:
    labels = {(line.group, line.name): line for line in found}
    assert len(labels) == len(found)
    return labels


def test_every_line_is_its_figure(reports: list[dict[str, Any]]) -> None:
    expected: dict[tuple[str, str], list[str]] = {}
    for k, r in enumerate(reports):
        texts: dict[tuple[str, str], str] = {}
        for group, path in PATHS.items():
            values: Any = r
            for key in path:
                values = values[key]
            if group in ANGLES:
                values = values | {"attitude": ANGLES[group](r)}
            texts |= {(group, key): f"{value:.4g}" for key, value in values.items()}
        for key, peak in r["ripple"]["peak"].items():
            text = f"{peak['frequency_hz']:.4g} Hz\n{peak['rms']:.2e} N m"
            texts["ripple's peak", key] = text
        share = r["saturation"]["share"]
        texts["saturation", "ticks at a limit"] = f"{r['saturation']['ticks']} ({share:.2%})"
        for name in ("p50", "p99", "max"):
            ms, ticks = (r["latency"][f"{name}_{unit}"] for unit in ("ms", "ticks"))
            texts["latency", name] = f"{ms:.3g} ({ticks:.3g})"
        texts["commands", "unanswered"] = str(r["unanswered_ticks"])
        texts["commands", "not as commanded"] = str(r["missed_deadlines"]["differing_ticks"])
        for kind, label in (("rms", "RMS"), ("max", "max")):
            for group, name in GROUPS.items():
                value = r["estimate_error"][kind][group]
                texts["estimate error", f"{name} {label}"] = f"{value:.4g}"
        for group, key in OF_BASE.items():
            for kind, value in r["base_pointing"][key].items():
                within = kind == "within_band"
                label = "time within the band" if within else kind.replace("_", ", ")
                text = f"{value:.2%}" if within else f"{value:.3g} arcsec"
                texts[group, label.replace("rms", "RMS")] = text
        for group, key in POINTING.items():
            for kind, label in (("rms", "RMS"), ("max", "max"), ("end", "end")):
                value = r["pointing"][key][kind]
                angle = f"{value:.3g} rad\n{value * 180 / np.pi:.3g} deg"
                texts[group, label] = angle if key.endswith("rad") else f"{value:.4g}"
        for kind, label in (("rms", "RMS"), ("largest", "max")):
            texts["tool on its path", label] = f"{r['tool'][f'{kind}_m']:.4g}"
            texts["tool on its path", f"rotation, {label}"] = f"{r['tool'][f'{kind}_deg']:.4g}"
        texts["tool on its path", "the path's drift"] = f"{r['tool']['drift_m']:.4g}"
        for axis, asked in r["sizing"]["axes"].items():
            texts["asked of the base", f"{axis} torque"] = f"{asked['peak_torque_n_m']:.4g}"
            texts["asked of the base", f"{axis} momentum"] = f"{asked['peak_momentum_n_m_s']:.4g}"
        texts["recording", "messages lost"] = str(sum(r["lost"].values()))
        texts["recording", "states filled in"] = str(r["filled_ticks"])
        texts["recording", "finished"] = "yes"
        texts["recording", "damage found"] = "0"
        for label, text in texts.items():
            expected.setdefault(label, [""] * len(reports))[k] = text
    found = by_label(lines(reports))
    assert {label: line.texts for label, line in found.items()} == expected
    assert {group for group, _ in found} == DEFINITIONS.keys() - {
        "attitude drift",
        "momentum",
        "pushed by thrusters",
        "disturbance torque",
        "deflection",
        "own metric",
    }


def test_brief_leaves_out_what_another_table_shows(reports: list[dict[str, Any]]) -> None:
    left_out = [*PATHS][:2] + [*PATHS][3:6] + ["asked of the base"]
    assert lines(reports, brief=True) == [
        line for line in lines(reports) if line.group not in left_out
    ]


def test_small_angles_are_in_seconds_of_arc(reports: list[dict[str, Any]]) -> None:
    report = copy.deepcopy(reports[0])
    report["pointing"]["boresight_rad"] = {"rms": np.radians(1 / 3600), "max": 1e-2, "end": 1.0}
    found = by_label(lines([report]))
    assert found["pointing", "RMS"].texts == ["4.85e-06 rad\n1 arcsec"]
    assert found["pointing", "max"].texts == ["0.01 rad\n2.06e+03 arcsec"]
    assert found["pointing", "end"].texts == ["1 rad\n57.3 deg"]


def test_a_figure_that_a_flight_does_not_have_is_a_dash(reports: list[dict[str, Any]]) -> None:
    log = random_log(6, 300, 0)
    log.flight = {}
    other = analyze(log)
    found = by_label(lines([other, reports[0]]))
    for label in (
        ("saturation", "ticks at a limit"),
        ("latency", "p99"),
        ("estimate error", "base max"),
        ("pointing", "RMS"),
        ("ripple", "base_torque"),
    ):
        assert found[label].texts[0] == NONE
        assert found[label].texts[1] != NONE
    assert found["maximum", "base_torque"].texts[0] != NONE


def test_an_error_that_stays_outside_never_settles(reports: list[dict[str, Any]]) -> None:
    report = copy.deepcopy(reports[0])
    report["settling"]["settled_s"]["attitude"] = None
    report["saturation"] |= {"base_torque_limit_n_m": None, "joint_torque_limit_n_m": None}
    report["unfinished"], report["damage"] = "cut", ["a", "b"]
    found = by_label(lines([report]))
    assert found["settled after", "attitude"].texts == ["never"]
    assert found["saturation", "ticks at a limit"].texts == ["no limits"]
    assert found["recording", "finished"].texts == ["no"]
    assert found["recording", "damage found"].texts == ["2"]


def test_gains_of_ones_own_stand_in_the_title() -> None:
    own = {"controller": {"ctc.k_p": [90.0], "ctc.k_d": [19.0]}}
    report = analyze(
        simulate(Flight(resolve(FlightPlan(controller="ctc", duration=0.01, parameters=own))))
    )
    assert report["own_gains"] == ["ctc.k_p", "ctc.k_d"]
    assert rms_table(report).title.startswith("ctc, case 1, gains default, own ctc.k_p, ctc.k_d:")
    plain = analyze(simulate(Flight(resolve(FlightPlan(controller="ctc", duration=0.01)))))
    assert "own" not in rms_table(plain).title


@pytest.mark.parametrize(
    ("column", "unit"),
    [
        ("attitude", "-"),
        ("attitude_deg", "deg"),
        ("joints_4_7", "rad"),
        ("base_torque", "N m"),
        ("torque_1_1", "N m"),
    ],
)
def test_units_of_columns(column: str, unit: str) -> None:
    assert unit_of(column) == unit


def test_the_attitude_is_shown_in_degrees(reports: list[dict[str, Any]]) -> None:
    report = copy.deepcopy(reports[0])
    report["attitude_error_deg"] = {"mean_axis": 1.146e-3, "eq64": 6.6e-4, "max": 2e-3}
    report["navigation_error"] = None
    assert rms_table(report).groups[0].rows[0][:4] == ["attitude", "deg", "1.146e-03", "6.600e-04"]
    maximum = by_label(lines([report]))["maximum", "attitude"]
    assert (maximum.unit, maximum.texts) == ("deg", ["0.002"])


def test_a_diverged_flight_has_all_torques_with_exponents(reports: list[dict[str, Any]]) -> None:
    report = copy.deepcopy(reports[0])
    torques = {"base_torque": 2.956e7, "torque_1_3": 99467.7447, "torque_4_6": 1.5}
    report["rms"]["mean_axis"] |= torques
    rows = {row[0]: row[2] for row in rms_table(report).groups[0].rows}
    assert [rows[key] for key in torques] == ["2.956e+07", "9.947e+04", "1.500e+00"]
    report["rms"]["mean_axis"] |= {"base_torque": 20.0, "torque_1_3": 9.0}
    rows = {row[0]: row[2] for row in rms_table(report).groups[0].rows}
    assert [rows[key] for key in torques] == ["20.0000", "9.0000", "1.5000"]
