"""What is flown for docs/measurements/reality.md."""

from __future__ import annotations

from base_numbers import ATTITUDE, ended_at
from faults import with_fault
from flown_tables import Number, Options, Page, Table

LAWS = {"tde_stc": "TDE-STC, printed", "tde_smc": "TDE-SMC, printed", "tde_tsmc": "TDE-TSMC, tuned"}
TICKS_PER_S = 2000.0


def _scaled(factor: str) -> list[Options]:
    return [with_fault(law, f"torque_scale@0:all={factor}") for law in LAWS]


PAGE = Page(
    "reality",
    "measurements/reality.md",
    [
        Table(
            "torque_scale",
            ["", *LAWS.values()],
            [
                [
                    "FACTOR 0.995: attitude error",
                    *(Number(own, ATTITUDE, ".1e") for own in _scaled("0.995")),
                ],
                [
                    "FACTOR 0.99: diverges at tick",
                    *(Number(own, ended_at, ".0f", TICKS_PER_S) for own in _scaled("0.99")),
                ],
            ],
        )
    ],
)
