"""What is flown for docs/explanation/ets_vii.md."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import yaml
from base_numbers import largest_base_torque
from flown_tables import Number, Options, Page, Sentence, Table, Text

PATH = "explanation/ets_vii.md"
MISSIONS = ("ets_vii_out_and_back", "ets_vii_lift", "ets_vii_reactionless")
LARGEST, END, DEGREES = "attitude_drift.max", "attitude_drift.end", 180.0 / np.pi
ROBOT: Options = {"robot": "ets_vii", "controller": "ctc", "period": 0.002}
FREE: Options = {**ROBOT, "actuators": "none"}
OTHER_READING = "ets_vii_traceable.yaml"
"""Beside this file."""
LEFT_ALONE: Options = {
    **FREE,
    "mission": MISSIONS[-1],
    "orbit": "ets_vii",
    "parameters": {"plant": {"orbital_elements.anomaly_deg": 45.0}},
}


def _nominal(mission: str) -> list[str | Number | Text]:
    free = {**FREE, "mission": mission}
    orbit, wheels = {**free, "orbit": "ets_vii"}, {**ROBOT, "actuators": "wheels"}
    held = {**wheels, "mission": mission}
    return [
        f"`{mission}`",
        Number(free, LARGEST, ".3g", DEGREES),
        Number(orbit, LARGEST, ".3g", DEGREES),
        Number(held, largest_base_torque, ".3g"),
        Number(held, "sizing.peak_momentum", ".3g"),
    ]


def _read(mission: str) -> Number:
    text = Path(__file__).with_name(OTHER_READING).read_text("utf-8")
    options = {**FREE, "mission": mission, "plant_robot": yaml.safe_load(text)}
    return Number(options, LARGEST, ".3g", DEGREES)


LONG = (LEFT_ALONE, {**LEFT_ALONE, "duration": 600.0})

PAGE = Page(
    "ets_vii",
    PATH,
    (
        Table(
            "nominal",
            (
                "mission",
                "base free: drift, °",
                "in orbit, °",
                "wheels: torque, N m",
                "momentum, N m s",
            ),
            [_nominal(mission) for mission in MISSIONS],
        ),
        Sentence(
            "it turns the base by {}° (out and back), {}° (lift) and {}° (reactionless)",
            tuple(_read(mission) for mission in MISSIONS),
        ),
        Sentence(
            "At its end the base has drifted by {}°, after 600 s by {}°",
            tuple(Number(own, END, ".3g", DEGREES) for own in LONG),
        ),
    ),
)
