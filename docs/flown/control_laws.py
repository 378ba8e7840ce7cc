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


PAGE = Page(
    "control_laws",
    "manual/control_laws.md",
    [
        Table(
            "low_pass",
            ["SIGMA, rad/s", "F, Hz", "joints 1-3", "torque 1-3"],
            [_row("0", 0), _row("1e-4", 0), _row("1e-4", 100), _row("1e-4", 20)],
        )
    ],
)
