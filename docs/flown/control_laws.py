"""What is flown for docs/manual/control_laws.md."""

from __future__ import annotations

from flown_tables import Number, Options, Page, Table


def _row(sigma: str, corner_hz: int) -> list[str | Number]:
    options: Options = {
        "faults": [f"noise_joint_velocity@0:{sigma}"] if sigma != "0" else [],
        "parameters": {"controller": {"acceleration_filter_hz": float(corner_hz)}},
    }
    return [
        sigma,
        str(corner_hz or "none"),
        Number(options, "joints_1_3.rms"),
        Number(options, "torque_1_3.variation", ".3g"),
    ]


INTEGRALS = {("ctc", "paper"): 240.0, ("ctc", "seven_joint"): 340.0}
INTEGRALS |= {("slotine_li", "paper"): 38.0, ("slotine_li", "seven_joint"): 48.0}
"""K_I: W^3 / 8 and lambda^2 / 4 of the set `robust`."""
FRICTION = {"paper": (0.2, 0.02), "seven_joint": (0.8, 0.15)}
"""Viscous, N m s/rad, and Coulomb, N m, of every joint."""
WRISTS = {"paper": "joints_4_6.rms", "seven_joint": "joints_4_7.rms"}
AGAINST_FRICTION = {
    "none": (0.0, False),
    "friction": (1.0, False),
    "friction, 50 % too small": (0.5, False),
    "friction, 50 % too large": (1.5, False),
    "integral": (0.0, True),
    "both": (1.0, True),
    "both, 50 % too small": (0.5, True),
    "both, 50 % too large": (1.5, True),
}
"""Share of the friction that is fed forward, and whether there is an integral."""


def _with_friction(law: str, robot: str, share: float, has_integral: bool) -> Options:
    (viscous, coulomb), gains = FRICTION[robot], {}
    if share:
        gains = {"viscous": share * viscous, "coulomb": share * coulomb, "dead_band": 1e-4}
    if has_integral:
        gains["k_i"] = INTEGRALS[law, robot]
    return {
        "robot": robot,
        "controller": law,
        "gains": "robust",
        "sensors": "fine",
        "navigation": "filtered",
        "parameters": {
            "plant": {"friction.viscous": viscous, "friction.coulomb": coulomb},
            "controller": {f"{law}.{gain}": [value] for gain, value in gains.items()},
        },
    }


def _friction_row(law: str, name: str) -> list[str | Number]:
    row: list[str | Number] = [f"`{law}`", name]
    for robot, wrist in WRISTS.items():
        options = _with_friction(law, robot, *AGAINST_FRICTION[name])
        row += [Number(options, q) for q in ("attitude.rms", "joints_1_3.rms", wrist)]
    return row


PAGE = Page(
    "control_laws",
    "manual/control_laws.md",
    [
        Table(
            "low_pass",
            ["SIGMA, rad/s", "F, Hz", "joints 1-3", "torque 1-3"],
            [_row("0", 0), _row("1e-4", 0), _row("1e-4", 100), _row("1e-4", 20)],
        ),
        Table(
            "friction",
            [
                "law",
                "gains",
                "`paper`: attitude",
                "joints 1-3",
                "4-6",
                "`seven_joint`: attitude",
                "joints 1-3",
                "4-7",
            ],
            [
                _friction_row(law, name)
                for law in ("ctc", "slotine_li")
                for name in AGAINST_FRICTION
            ],
        ),
    ],
)
