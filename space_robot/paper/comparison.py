"""Measured and printed values of Table V, the chatter of the laws, and the paper's claims."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import Any, NamedTuple

from ..console.tables import Column, JudgedCell, Table
from .flights import CHATTER, DEFINITIONS, VARIANTS, Result
from .table_v import COLUMNS, HEADINGS, PRINTED, TORQUE, TRACKING

TDE_LAWS = ("tde_smc", "tde_tsmc", "tde_stc")


class Cell(NamedTuple):
    """One number of Table V and the measured value."""

    controller: str
    case: str
    gains: str
    friction: bool
    definition: str
    column: str
    measured: float | None
    """Measured value; None if the flight diverged."""
    printed: float
    ratio: float | None
    diverged_tick: int | None

    @property
    def text(self) -> str:
        """``measured / printed (ratio)``."""
        if self.measured is None or self.ratio is None:
            return f"diverged at tick {self.diverged_tick}"
        spec = ".4f" if "torque" in self.column else ".2e"
        ratio = f"{self.ratio:.3f}" if self.ratio > 0.01 else f"{self.ratio:.1e}"
        return f"{self.measured:{spec}} / {self.printed:{spec}} ({ratio})"


def cells(results: Iterable[Result]) -> list[Cell]:
    """Compare every flight with Table V in every column, by both definitions."""
    compared = []
    for row, variant, _, diverged_tick, metrics, _ in results:
        for definition in DEFINITIONS:
            for column, printed in zip(COLUMNS, PRINTED[row], strict=True):
                measured = metrics[f"{column}.{definition}"] if metrics else None
                ratio = None if measured is None else measured / printed
                compared.append(
                    Cell(
                        row.controller,
                        row.case,
                        variant.gains,
                        variant.friction,
                        definition,
                        column,
                        measured,
                        printed,
                        ratio,
                        diverged_tick,
                    )
                )
    return compared


def variant_tables(comparison: Sequence[Cell]) -> Iterator[Table]:
    """Tabulate each variant and definition."""
    columns = (
        Column("controller", is_label=True),
        Column("case", is_label=True),
        *(Column(*heading) for heading in HEADINGS.values()),
    )
    for definition, meaning in DEFINITIONS.items():
        for variant in VARIANTS:
            rows: dict[tuple[str, str], list[str]] = {}
            for cell in comparison:
                if (cell.gains, cell.friction, cell.definition) == (*variant, definition):
                    row = cell.controller, cell.case
                    rows.setdefault(row, [*row]).append(cell.text)
            if rows:
                yield Table.of(f"{variant.title}; {meaning}", columns, list(rows.values()))


def chatter(results: Iterable[Result]) -> list[dict[str, Any]]:
    """Return the chatter of every compared flight that did not diverge, for JSON.

    The total variation per time, N m/s, and the share of the power above 100 Hz, both the mean of
    the axes, by torque column of Table V.
    """
    return [
        {
            "controller": r.row.controller,
            "gains": r.variant.gains,
            **{key: {c: r.metrics[f"{c}.{key}"] for c in TORQUE} for key in CHATTER},
        }
        for r in results
        if r.chatters and r.metrics
    ]


def chatter_table(flights: Iterable[dict[str, Any]]) -> Table:
    """Tabulate `chatter`."""
    names = ("base", "joints 1-3", "joints 4-6")
    columns = (
        Column("controller", is_label=True),
        Column("gains", is_label=True),
        *(Column(f"{name}: variation", "N m/s", ".3g") for name in names),
        *(Column(f"{name}: power > 100 Hz", spec=".1e") for name in names),
    )
    rows = [
        [x["controller"], x["gains"], *(x[key][column] for key in CHATTER for column in TORQUE)]
        for x in flights
    ]
    return Table.of("Chatter in case 1, printed friction", columns, rows)


class Claim(NamedTuple):
    """A claim of the paper as an inequality between ``value`` and ``limit``."""

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
    verdicts = {True: JudgedCell("", "holds", "good"), False: JudgedCell("", "fails", "bad")}
    rows = [
        [c["text"], c["value"], f"{c['relation']} {c['limit']:g}", verdicts[c["holds"]]]
        for c in records
    ]
    return Table.of("", columns, rows)


def claims(results: Iterable[Result], comparison: Iterable[Cell]) -> list[Claim]:
    """Return every claim whose flights are among the results."""
    cells = [c for c in comparison if (c.definition, c.gains) == ("rms", "printed") and c.ratio]
    free = [c for c in cells if c.controller == "tde_stc" and not c.friction]
    rubbing = [c for c in cells if c.controller in TDE_LAWS and c.friction]
    judged: list[tuple[str, list[float], str, float]] = [
        (
            "TDE-STC's torques are Table V's, friction-free: largest relative difference",
            [abs((c.ratio or 0.0) - 1.0) for c in free if c.column in TORQUE],
            "<=",
            0.01,
        ),
        (
            "The TDE laws track closer than printed in every cell: largest measured / printed",
            [c.ratio or 0.0 for c in rubbing if c.column in TRACKING],
            "<=",
            1.0,
        ),
    ]
    variation = {
        (r.row.controller, r.variant.gains): r.metrics["base_torque.variation"]
        for r in results
        if r.chatters and r.metrics
    }
    own = variation.get(("tde_stc", "printed"))
    smoother = "TDE-STC is smoother, printed gains, ideal sensors: base torque's total variation, "
    smoothest = "TDE-STC is the smoothest TDE law whatever the gains: "
    for law, gains, text, factor in (
        ("tde_tsmc", "printed", f"{smoother}tde_tsmc / tde_stc", 5.0),
        ("tde_smc", "printed", f"{smoother}tde_smc / tde_stc", 100.0),
        ("tde_tsmc", "tuned", f"{smoothest}tde_tsmc tuned / tde_stc", 1.0),
    ):
        ratios = [variation[law, gains] / own] if own and (law, gains) in variation else []
        judged.append((text, ratios, ">=", factor))
    for words, flown in (("with friction", rubbing), ("friction-free", free)):
        errors = {(c.case, c.column): c.measured for c in flown if c.controller == "tde_stc"}
        for case in ("4-1", "4-2"):
            pairs = [(errors.get((case, name)), errors.get(("1", name))) for name in TRACKING]
            growth = [heavy / light for heavy, light in pairs if heavy and light]
            text = "Payload and disturbance hardly degrade TDE-STC, no error doubles, "
            judged.append((f"{text}{words}: case {case} / 1", growth, "<=", 2.0))
    return [
        Claim(text, max(values), relation, limit)
        for text, values, relation, limit in judged
        if values
    ]
