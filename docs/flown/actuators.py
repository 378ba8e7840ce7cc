"""What is flown for docs/manual/actuators.md."""

from __future__ import annotations

from base_numbers import ATTITUDE, DEGREES, DRIFT, asked_of_a_wheel, impulse, largest_wheel_torque
from flown_tables import Number, Options, Page, Sentence, Table, Text

MODULATIONS = ("schmitt", "sigma_delta", "pwm")
SETS = (
    ("tde_stc", "robust"),
    ("ctc", "robust"),
    ("ctc_smc", "tuned"),
    ("tde_stc", "printed"),
    ("ctc", "tuned"),
)
ON_THRUSTERS: Options = {"actuators": "thrusters", "gains": "robust", "navigation": "filtered"}


def _modulated(law: str, gains: str) -> list[str | Text]:
    cells: list[str | Text] = [f"{law}, `{gains}`"]
    for modulation in MODULATIONS:
        options = {
            "actuators": "thrusters",
            "controller": law,
            "gains": gains,
            "parameters": {"controller": {"allocation.modulation": modulation}},
        }
        shown = (Number(options, ATTITUDE, ".1e"), Number(options, impulse, ".0f"))
        cells.append(Text("{}; {}", shown))
    return cells


def _on_wheels(law: str, **controller: object) -> Options:
    options: dict[str, object] = {"actuators": "wheels", "controller": law}
    return options | ({"parameters": {"controller": controller}} if controller else {})


PAGE = Page(
    "actuators",
    "manual/actuators.md",
    (
        Table(
            "modulations",
            ("", *(f"`{name}`" for name in MODULATIONS)),
            [_modulated(law, gains) for law, gains in SETS],
        ),
        Sentence(
            "the wheel with the largest load must deliver {} N m and {} N m s.",
            (
                Number({"controller": "tde_stc"}, asked_of_a_wheel("peak torque"), ".2f"),
                Number({"controller": "tde_stc"}, asked_of_a_wheel("largest momentum"), ".1f"),
            ),
        ),
        Sentence(
            "The base turns by {}° in case 1 with every law",
            (Number({"actuators": "none", "controller": "tde_stc"}, DRIFT, ".1f", DEGREES),),
        ),
        Sentence(
            "the largest motor torque of a wheel is {} N m with the first, {} N m with the second.",
            tuple(
                Number(options, largest_wheel_torque, ".2f")
                for options in (
                    _on_wheels("tde_stc"),
                    _on_wheels(
                        "tde_stc",
                        **{"allocation.wheels": "least_largest", "allocation.null_gain": 0.0},
                    ),
                )
            ),
        ),
        Sentence(
            "(CTC-SMC, case 1: {} attitude error without, {} with 50 rad/s)",
            tuple(
                Number(options, ATTITUDE)
                for options in (
                    _on_wheels("ctc_smc"),
                    _on_wheels("ctc_smc", **{"allocation.least_speed": 50.0}),
                )
            ),
        ),
        Sentence(
            "the error is about the same for `fine` sensors (tde_stc {}), and {} for `tactical` "
            "ones.",
            (
                Number({**ON_THRUSTERS, "sensors": "fine"}, ATTITUDE),
                Number({**ON_THRUSTERS, "sensors": "tactical"}, ATTITUDE),
            ),
        ),
        Sentence(
            "the errors are those of ideal torque (tde_stc {}, ideal {})",
            (Number(_on_wheels("tde_stc"), ATTITUDE), Number({"controller": "tde_stc"}, ATTITUDE)),
        ),
    ),
)
