"""What is flown for docs/explanation/base_actuators.md."""

from __future__ import annotations

from base_numbers import (
    ATTITUDE,
    DEGREES,
    DRIFT,
    JOINTS_1_3,
    LAWS,
    PEAKS,
    attitude_error_at,
    first_at_limit,
    largest_attitude_error,
    largest_wheel_torque,
    pulses,
)
from flown_tables import Number, Options, Page, Sentence, Table, Text

ACTUATORS = ("ideal", "wheels", "small_wheels", "wheels_and_thrusters", "thrusters", "none")
SHOWN = (ATTITUDE, JOINTS_1_3)
"""In each cell of the table of laws and bases."""
IDEAL: Options = {}
STC_ON_SMALL_WHEELS: Options = {"actuators": "small_wheels", "controller": "tde_stc"}
SLOW: Options = {
    "actuators": "small_wheels",
    "mission": {
        "start": {"joints_deg": [0, 120, 220, 0, -10, 0]},
        "segments": [
            {"joints_deg": [15, 110, 185, 45, 10, -25], "duration": 50},
            {"joints_deg": [30, 100, 150, 90, 30, -50], "duration": 50},
        ],
    },
}
COMES_BACK: Options = {
    "actuators": "small_wheels",
    "duration": 180.0,
    "parameters": {
        "controller": {
            "tde_stc.lambda": [*[0.1] * 3, *[1.0] * 6],
            "tde_stc.k_1": [*[5e-3] * 3, 0.2, 0.2, 0.2, 0.4, 0.2, 0.2],
            "tde_stc.k_2": [*[1e-5] * 3, 3e-3, 3e-3, 3e-3, 4e-3, 2e-3, 2e-3],
        }
    },
}
ROBUST_THRUSTERS: Options = {"actuators": "thrusters", "gains": "robust", "controller": "tde_stc"}


def _bases(label: str, options: Options) -> list[str | Text]:
    laws = ({**options, "controller": law} for law in LAWS)
    return [label, *(Text("{}; {}", tuple(Number(o, q) for q in SHOWN)) for o in laws)]


def _asked(label: str, options: Options) -> list[str | Number | Text]:
    return [
        label,
        Text("{}, {}, {}", tuple(Number(options, peak, ".2f") for peak in PEAKS)),
        Number(options, "sizing.peak_momentum", ".1f"),
    ]


def _after(law: str) -> list[str | Number]:
    options = {"actuators": "small_wheels", "controller": law, "duration": 120.0}
    times = (30.0, 60.0, 120.0)
    return [law, *(Number(options, attitude_error_at(t), ".3g", 1e3) for t in times)]


PAGE = Page(
    "base_actuators",
    "explanation/base_actuators.md",
    (
        Table(
            "asked",
            ("case, robot", "peak torque x, y, z (N m)", "stored momentum (N m s)"),
            [
                _asked("1, `paper`", IDEAL),
                _asked("3, `paper`", {"case": "3"}),
                _asked("4-2, `paper`", {"case": "4-2"}),
                _asked("1, `seven_joint`", {"robot": "seven_joint"}),
            ],
        ),
        Table(
            "bases",
            ("actuators", *LAWS),
            [
                *(_bases(f"`{name}`", {"actuators": name}) for name in ACTUATORS),
                _bases("`thrusters`, gains `robust`", ROBUST_THRUSTERS),
            ],
        ),
        Table(
            "after",
            ("law, gains `default`", "30 s", "60 s", "120 s"),
            [_after(law) for law in LAWS],
        ),
        Sentence(
            "The mission needs {} N m about a base axis and {} N m s of momentum.",
            (Number(IDEAL, PEAKS[1], ".1f"), Number(IDEAL, "sizing.peak_momentum", ".1f")),
        ),
        Sentence(
            "The most loaded wheel needs {} N m, and the attitude error is {}.",
            (Number(SLOW, largest_wheel_torque), Number(SLOW, ATTITUDE)),
        ),
        Sentence(
            "With TDE-STC they are at their limit in {} % of the ticks, first after {} s.",
            (
                Number(STC_ON_SMALL_WHEELS, "wheels.saturation", ".0f", 100.0),
                Number(STC_ON_SMALL_WHEELS, first_at_limit, ".1f"),
            ),
        ),
        Sentence(
            "the base turns by {}° with every law",
            (Number({"actuators": "none", "controller": "tde_stc"}, DRIFT, ".1f", DEGREES),),
        ),
        Sentence(
            "`--fault wheel_fail@10:3` on `wheels` causes an error of at most {} with TDE-STC",
            (
                Number(
                    {"actuators": "wheels", "faults": ["wheel_fail@10:3"]}, largest_attitude_error
                ),
            ),
        ),
        Sentence(
            "recovers: the error is {} at 30 s, {} at 90 s and {} at the end.",
            tuple(
                Number(COMES_BACK, attitude_error_at(t), ".2g", 1e3) for t in (30.0, 90.0, 180.0)
            ),
        ),
        Sentence(
            "the flight takes {} g of propellant and {} pulses, and pushes the robot by {} mm.",
            (
                Number(ROBUST_THRUSTERS, "sizing.thrusters.propellant", ".0f", 1e3),
                Number(ROBUST_THRUSTERS, pulses, ".0f"),
                Number(ROBUST_THRUSTERS, "pushed.max", ".0f", 1e3),
            ),
        ),
    ),
)
