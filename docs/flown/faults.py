"""What is flown for docs/manual/faults.md."""

from __future__ import annotations

from typing import Any

from base_numbers import ended_at
from flown_tables import Cell, Number, Options, Page, Table, Text

LAWS = {"tde_stc": "TDE-STC", "tde_smc": "TDE-SMC", "tde_tsmc": "TDE-TSMC"}
REPORT, DRIVE = "torque_scale@0:all=0.9901", "drive_scale@0:all=1.01"
ECHO = {"parameters": {"plant": {"torque_echo": "given"}}}


def with_fault(law: str, fault: str, **others: Any) -> Options:
    """Return a flight of case 1 with the gains of the page."""
    gains = "tuned" if law == "tde_tsmc" else "printed"
    return {"controller": law, "gains": gains, "faults": [fault], **others}


def _diverging(label: str, fault: str, **others: Any) -> list[Cell]:
    flights = (with_fault(law, fault, **others) for law in LAWS)
    return [label, *(Text("{} s", (Number(own, ended_at, ".1f"),)) for own in flights)]


PAGE = Page(
    "faults",
    "manual/faults.md",
    [
        Table(
            "torques",
            ["", *LAWS.values()],
            [
                _diverging(f"`--fault {REPORT}` (report 1 % too large)", REPORT),
                ["`--fault torque_scale@0:all=0.995`", *["flies"] * 3],
                ["`--fault torque_scale@0:all=0.98`, `h_bar` of 500, 20, 0.5", *["flies"] * 3],
                ["`--fault drive_scale@0:all=0.99`, or 1.01", *["flies, unchanged"] * 3],
                _diverging(f"`--fault {DRIVE} --set plant.torque_echo=given`", DRIVE, **ECHO),
            ],
        )
    ],
)
