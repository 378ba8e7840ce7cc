"""The table of a flight's sizing: what was asked of the base, and whether its actuators have it."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import groupby
from typing import Any

from ..console.tables import Column, Group, JudgedCell, Row, Table
from .words import Report

BY_AXIS = (
    ("peak torque", "N m", "peak_torque_n_m"),
    ("RMS torque", "N m", "rms_torque_n_m"),
    ("angular impulse", "N m s", "angular_impulse_n_m_s"),
    ("stored momentum", "N m s", "peak_momentum_n_m_s"),
    ("pulses", "-", "pulses"),
    ("propellant", "kg", "propellant_kg"),
)
"""Definition, unit and key of what is asked of each axis."""

MANY_TIMES = 10.0
"""Lack, as a share of what a part has, from which on the table has a multiple, not a margin."""


def sizing_table(report: Report) -> Table | None:
    """Tabulate the sizing of a flight; None where it has none."""
    sizing = report["sizing"]
    if sizing is None:
        return None
    requirements = sizing["requirements"]
    parts = groupby(requirements, key=lambda requirement: requirement["part"])
    judged = {(r["part"], r["quantity"]): r for r in requirements}
    groups = [
        Group(list(_of_axis(name, axis, judged)), name) for name, axis in sizing["axes"].items()
    ]
    groups += [
        Group([_row(r["quantity"], r["unit"], r["asked"], r) for r in each], part)
        for part, each in parts
        if part not in sizing["axes"]
    ]
    columns = (
        Column(is_label=True),
        Column("unit", is_label=True),
        Column("asked", spec=".4g"),
        *((Column("has"), Column("margin")) if requirements else ()),
    )
    rows = [Group([row[: len(columns)] for row in g.rows], g.name) for g in groups]
    return Table(_title(sizing), columns, rows, _notes(report))


def _of_axis(name: str, axis: dict[str, Any], judged: dict[tuple[str, str], Any]) -> Iterator[Row]:
    for quantity, unit, key in BY_AXIS:
        if axis[key] is not None:
            yield _row(quantity, unit, axis[key], judged.get((name, quantity)))


def _row(quantity: str, unit: str, asked: float, judged: dict[str, Any] | None) -> Row:
    if judged is None:
        return quantity, unit, asked, "", ""
    has = "no limit" if judged["has"] is None else f"{judged['has']:.4g}"
    if judged["is_at_limit"]:
        return quantity, unit, asked, has, JudgedCell("", "at the limit", "bad")
    margin = judged["margin"]
    if margin is not None and margin <= -MANY_TIMES:
        return quantity, unit, asked, has, JudgedCell("", f"{1.0 - margin:.3g} times", "bad")
    text = "" if margin is None else f"{100.0 * margin:+.0f} %"
    verdict = ("has it", "good") if judged["is_met"] else ("lacks it", "bad")
    return quantity, unit, asked, has, JudgedCell(text, *verdict)


def _title(sizing: dict[str, Any]) -> str:
    if not sizing["requirements"]:
        return "what the flight asks of its base"
    who = "had" if sizing["flown"] else "would have"
    return f"what the flight asks of its base, and what actuators {sizing['actuators']} {who}"


def _notes(report: Report) -> list[str]:
    sizing, notes = report["sizing"], []
    if report["metrics"].get("wheels.saturation"):
        notes.append(
            "wheels were at their limits: what the law then asked for is not what the mission "
            "asks; fly ideal actuators for that"
        )
    if not sizing["requirements"] or sizing["flown"]:
        return notes
    parts = {requirement["part"] for requirement in sizing["requirements"]}
    if "thrusters" in parts:
        notes.append("propellant: the least, were thrusters not on or off; pulses: fly them")
    if "wheel_1" in parts:
        notes.append("wheels share what is asked by the pseudo-inverse of their axes")
    return notes
