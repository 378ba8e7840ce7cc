"""What is flown for docs/explanation/nominal_inertia.md."""

from __future__ import annotations

from typing import Any

from flown_tables import Number, Options, Page, Table

from space_robot.analysis.analysed_log import AnalysedLog
from space_robot.analysis.measure import evaluate, measure
from space_robot.analysis.words import with_statistic
from space_robot.api.flown_flight import FlownFlight

ROBOTS = ("paper", "seven_joint", "dual_arm", "ets_vii", "canadarm", "canadarm2")
SLOPE = {"lambda": [20.0], "k_1": [0.02], "k_2": [1e-4]}
"""Gains in units of acceleration, which need no robot."""
NOMINAL: dict[str, Any] = {"controller": "tde_stc", "gains": {"h_bar": "nominal", **SLOPE}}
PRINTED: dict[str, Any] = {"controller": "tde_stc", "gains": "printed"}
SCALES = (0.8, 1.005, 1.01, 1.2)
GRADES = ("fine", "tactical", "coarse")
CORNER_HZ = 20.0
RIPPLE = "base_torque.ripple"


def largest_rms(flown: FlownFlight) -> float | None:
    """Return the largest RMS error of attitude and joints; None if the flight diverged."""
    if flown.ending.outcome != "complete":
        return None
    numbers, _ = evaluate(AnalysedLog(flown.log), groups=("errors",))
    errors = with_statistic(numbers, "rms")
    return max(errors[key] for key in errors if key == "attitude" or key.startswith("joints"))


def _of_robot(robot: str) -> list[str | Number]:
    shared: Options = {"robot": robot, "case": "1", "duration": 20.0}
    unfiltered = {"controller": {"acceleration_filter_hz": 0.0}}
    flights: list[Options] = [
        {**shared, "controller": "ctc", "gains": "tuned"},
        {**shared, "controller": "tde_stc", "gains": "tuned"},
        {**shared, **NOMINAL, "parameters": unfiltered},
    ]
    return [f"`{robot}`", *(Number(own, largest_rms, ".1e") for own in flights)]


def _of_scale(factor: float) -> list[str | Number]:
    changed = {"plant": {"echo_scale": [factor]}}
    flights: list[Options] = [{**own, "parameters": changed} for own in (PRINTED, NOMINAL)]
    return [f"{factor:g}", *(Number(own, largest_rms, ".1e") for own in flights)]


def _of_grade(grade: str) -> list[str | Number]:
    shared: Options = {"case": "3", "sensors": grade, "navigation": "filtered", "duration": 20.0}
    strong = {"h_bar": "nominal", "lambda": [20.0], "k_1": [0.1], "k_2": [2e-3]}
    flights: list[Options] = [
        {**shared, "controller": law, "gains": "robust"} for law in ("ctc", "tde_stc")
    ]
    corner = {"controller": {"acceleration_filter_hz": CORNER_HZ}}
    flights.append({**shared, "controller": "tde_stc", "gains": strong, "parameters": corner})
    cells: list[str | Number] = [grade]
    for own in flights:
        cells += [Number(own, largest_rms, ".1e"), Number(own, base_ripple, ".2g")]
    return cells


def base_ripple(flown: FlownFlight) -> float | None:
    """Return the ripple of the torque on the base, N m; None if the flight diverged."""
    if flown.ending.outcome != "complete":
        return None
    return measure(flown.log, [RIPPLE])[RIPPLE]


PAGE = Page(
    "nominal_inertia",
    "explanation/nominal_inertia.md",
    (
        Table(
            "robots",
            ("robot", "CTC", "TDE-STC, constant", "TDE-STC, nominal"),
            [_of_robot(robot) for robot in ROBOTS],
        ),
        Table(
            "scales",
            ("reported, of the applied torque", "constant, Table IV", "nominal"),
            [_of_scale(factor) for factor in SCALES],
        ),
        Table(
            "grades",
            (
                "sensors",
                "CTC",
                "ripple",
                "TDE-STC, constant",
                "ripple",
                "TDE-STC, nominal",
                "ripple",
            ),
            [_of_grade(grade) for grade in GRADES],
        ),
    ),
)
