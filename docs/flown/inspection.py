"""What is flown for docs/explanation/inspection.md."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
from base_numbers import largest_base_torque
from flown_tables import Number, Options, Page, Table
from orbit import stored
from scipy.spatial.transform import Rotation

from space_robot import Scenario
from space_robot.analysis.described import plant_settings
from space_robot.analysis.mission_plan import plan_report, planned_segments
from space_robot.api.flown_flight import FlownFlight

LAWS = ("tde_stc", "indi", "ctc", "pd_feedforward")
SOURCES = {"gravity_gradient": "gravity gradient", "drag": "drag", "sunlight": "sunlight"}
TICKS = {0.005: "5", 0.002: "2", 0.0005: "0.5"}
PART_S = 300.0
AT_400_KM = {"orbital_elements.height": 400e3}


def _inspection(law: str = "tde_stc", **others: Any) -> Options:
    return {
        "robot": "ets_vii",
        "mission": "ets_vii_inspection",
        "orbit": "iss",
        "actuators": "wheels_and_torquers",
        "sensors": "fine",
        "navigation": "filtered",
        "gains": "robust",
        "period": 0.005,
        "controller": law,
        "parameters": {"plant": AT_400_KM},
        **others,
    }


LOADED = _inspection(parameters={"plant": AT_400_KM, "controller": {"allocation.dump": "none"}})
"""The wheels keep what they take."""
UNLOADED = _inspection()


@cache
def _plan() -> dict[str, Any]:
    scenario = Scenario(**_inspection()).check().scenario
    robot = scenario.robots.controller
    segments = planned_segments(robot, scenario.reference, scenario.plant)
    report = plan_report(robot, segments, {"flown": scenario.assumed_actuators})
    return {**report["sources"], "all": report}


def planned(source: str) -> Callable[[FlownFlight], float]:
    """Return the largest momentum that `plan` gives for a source, N m s."""

    def momentum(_: FlownFlight) -> float:
        return float(_plan()[source]["momentum"])

    momentum.__name__ = f"planned_{source}"
    return momentum


def planned_share(_: FlownFlight) -> float:
    """Return the share of its momentum to which `plan` fills a wheel."""
    return float(_plan()["all"]["actuators"][0]["momentum"])


def flown_share(flown: FlownFlight) -> float:
    """Return the largest share of its momentum that a wheel had."""
    wheels = plant_settings(flown.log).wheels
    spin = np.abs(wheels.spin_momenta(flown.log.wheel_velocities)).max(axis=0)
    return float(np.max(spin / wheels.values("max_momentum")))


def given(flown: FlownFlight) -> float:
    """Return the largest change of the wheels' momentum, on inertial axes, N m s."""
    wheels, rows = plant_settings(flown.log).wheels, slice(None, None, 200)
    spin = wheels.spin_momenta(flown.log.wheel_velocities[rows]) @ wheels.unit_axes
    held = Rotation.from_quat(flown.log.quaternion[rows], scalar_first=True).apply(spin)
    return float(np.linalg.norm(held - held[0], axis=1).max())


def _pointing(options: Options) -> list[str | Number]:
    angle = "half_cone"
    return [
        Number(options, f"{angle}.rms", ".2g"),
        Number(options, f"{angle}.max", ".2g"),
        Number(options, f"{angle}.jitter_rms", ".2g"),
        Number(options, "tool.rms", ".2g", 1e3),
        Number(options, "tool.max", ".2g", 1e3),
        Number(options, "base_torque.rms", ".2g"),
        Number(options, largest_base_torque, ".2g"),
    ]


def _source(source: str) -> list[str | Number]:
    return [
        f"{SOURCES[source]}, N m s",
        Number(LOADED, planned(source), ".3g"),
        Number(LOADED, f"impulse_{source}.max", ".3g"),
    ]


HEAD = (
    *("half cone: RMS, arcsec", "largest", "jitter in 1 s, RMS"),
    *("tool: RMS, mm", "largest", "base torque: RMS, N m", "largest"),
)

PAGE = Page(
    "inspection",
    "explanation/inspection.md",
    (
        Table(
            "plan",
            ("", "`plan`", "flown"),
            [
                *map(_source, SOURCES),
                [
                    "all and the motion, N m s",
                    Number(LOADED, planned("all"), ".2f"),
                    Number(LOADED, given, ".2f"),
                ],
                [
                    "fullest wheel, % of 20 N m s",
                    Number(LOADED, planned_share, ".1f", 100.0),
                    Number(LOADED, flown_share, ".1f", 100.0),
                ],
            ],
        ),
        Table("laws", ("law", *HEAD), [[f"`{law}`", *_pointing(_inspection(law))] for law in LAWS]),
        Table(
            "unloading",
            ("unloaded by", "at the start, N m s", "1/4", "1/2", "at the end"),
            [
                [label, *(Number(options, stored(s), ".2f") for s in (0.0, 0.25, 0.5, 1.0))]
                for label, options in (("nothing", LOADED), ("magnetic torquers", UNLOADED))
            ],
        ),
        Table(
            "ticks",
            ("tick, ms", *HEAD),
            [
                [label, *_pointing(_inspection(period=period, duration=PART_S))]
                for period, label in TICKS.items()
            ],
        ),
    ),
)
