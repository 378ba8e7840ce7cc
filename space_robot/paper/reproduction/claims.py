"""The paper's claims about its law as inequalities, tested by the flights."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import Any, NamedTuple

from ...console.tables import Column, JudgedCell, Table
from .flights import Result
from .table import Cell
from .table_v import TORQUE, TRACKING

TDE_LAWS = ("tde_smc", "tde_tsmc", "tde_stc")


class Claim(NamedTuple):
    """A claim as an inequality between ``value`` and ``limit``."""

    text: str
    value: float
    relation: str
    """``<=`` or ``>=``."""
    limit: float

    @property
    def holds(self) -> bool:
        """True if the inequality is met."""
        return self.value <= self.limit if self.relation == "<=" else self.value >= self.limit

    def as_record(self) -> dict[str, Any]:
        """Return the claim as a dictionary for JSON."""
        return {**self._asdict(), "holds": self.holds}


def claims_table(records: Iterable[dict[str, Any]]) -> Table:
    """Tabulate claims from `Claim.as_record`, each with its verdict."""
    columns = (
        Column("claim", is_label=True),
        Column("measured", spec=".4g"),
        Column("limit"),
        Column(is_label=True),
    )
    rows = [
        [
            claim["text"],
            claim["value"],
            f"{claim['relation']} {claim['limit']:g}",
            JudgedCell("", "holds", "good") if claim["holds"] else JudgedCell("", "fails", "bad"),
        ]
        for claim in records
    ]
    return Table.of("", columns, rows)


def claims(results: Sequence[Result], comparison: Sequence[Cell]) -> list[Claim]:
    """Return every claim whose flights are among the results."""
    paper = [c for c in comparison if c.definition == "rms" and c.gains == "printed"]
    claims = list(_torques(paper))
    claims += _tracking(paper)
    claims += _chatter(results)
    claims += _robustness(paper)
    return claims


def _torques(cells: Iterable[Cell]) -> Iterator[Claim]:
    flown = (c for c in cells if c.controller == "tde_stc" and not c.friction)
    if ratios := [c.ratio for c in flown if c.column in TORQUE and c.ratio is not None]:
        yield Claim(
            "TDE-STC's torques are Table V's, friction-free: largest relative difference",
            max(abs(ratio - 1.0) for ratio in ratios),
            "<=",
            0.01,
        )


def _tracking(cells: Iterable[Cell]) -> Iterator[Claim]:
    flown = (c for c in cells if c.controller in TDE_LAWS and c.friction)
    if ratios := [c.ratio for c in flown if c.column in TRACKING and c.ratio is not None]:
        yield Claim(
            "The TDE laws track closer than printed in every cell: largest measured / printed",
            max(ratios),
            "<=",
            1.0,
        )


def _chatter(results: Sequence[Result]) -> Iterator[Claim]:
    variation = {
        (r.row.controller, r.variant.gains): r.metrics["base_torque.variation"]
        for r in results
        if r.chatters and r.metrics
    }
    own = variation.get(("tde_stc", "printed"))
    if not own:
        return
    for law, factor in (("tde_tsmc", 5.0), ("tde_smc", 100.0)):
        if (law, "printed") in variation:
            yield Claim(
                "TDE-STC is smoother, printed gains, ideal sensors: base torque's total "
                f"variation, {law} / tde_stc",
                variation[law, "printed"] / own,
                ">=",
                factor,
            )
    if ("tde_tsmc", "tuned") in variation:
        yield Claim(
            "TDE-STC is the smoothest TDE law whatever the gains: tde_tsmc tuned / tde_stc",
            variation["tde_tsmc", "tuned"] / own,
            ">=",
            1.0,
        )


def _robustness(cells: Sequence[Cell]) -> Iterator[Claim]:
    flown = [c for c in cells if c.controller == "tde_stc" and c.column in TRACKING]
    errors = {(c.case, c.column, c.friction): c.measured for c in flown}
    for friction, words in ((True, "with friction"), (False, "friction-free")):
        for case in ("4-1", "4-2"):
            pairs = [
                (errors.get((case, column, friction)), errors.get(("1", column, friction)))
                for column in TRACKING
            ]
            growth = [heavy / light for heavy, light in pairs if heavy and light]
            if growth:
                yield Claim(
                    "Payload and disturbance hardly degrade TDE-STC, no error doubles, "
                    f"{words}: case {case} / 1",
                    max(growth),
                    "<=",
                    2.0,
                )
