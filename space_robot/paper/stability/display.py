"""Tables of a stability study: every condition with both numbers and a verdict."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence

from rich.console import Console

from ...console.tables import Column, JudgedCell, Table, Value
from ...console.terminal import say
from ...console.terminal_tables import print_table
from .check import Check
from .lyapunov import Certificate
from .study import StabilityStudy
from .super_twisting import SuperTwisting

TONES = {"holds": "good", "fails": "bad", "open": "open", "not applicable": "open"}


def print_study(study: StabilityStudy, console: Console) -> None:
    """Print all tables and a closing sentence."""
    flight = study.flight
    what = flight.description
    say(
        console,
        f"{what['controller']}, case {what['case']}, gains {what['gains']}, robot "
        f"{what['robot']}: {flight.ticks * flight.period:g} s, "
        f"joint friction {'on' if flight.scenario.has_friction else 'off'}",
    )
    print_table(_lemma_1(study), console)
    print_table(_time_delay_error(study), console)
    twisting, names = study.super_twisting, study.axis_names
    if twisting is None:
        say(
            console,
            f"(46) to (77) are about the gains k_1 and k_2: they do not apply to "
            f"{what['controller']}.",
        )
        return
    for table in (_gain_conditions, _circle_criterion, _paper_lmi, _lmi, _matrices, _reaching):
        print_table(table(names, twisting), console)
    say(console, _closing(study, twisting))


def _by_axis(
    title: str, names: Sequence[str], columns: Iterable[tuple[str, Iterable[Value]]]
) -> Table:
    """Return a table with one row per axis, from the heads and cells of its columns."""
    heads, cells = zip(*columns, strict=True)
    rows = list(zip(names, *cells, strict=True))
    return Table.of(title, [Column(is_label=True), *map(Column, heads)], rows)


def _number(value: float) -> str:
    return "none" if math.isnan(value) else f"{value:.3g}"


def _numbers(values: Iterable[float]) -> str:
    return ", ".join(map(_number, values))


def _of_each(
    certificates: Iterable[Certificate | None], text: Callable[[Certificate], str]
) -> list[str]:
    return ["none" if certificate is None else text(certificate) for certificate in certificates]


def _verdict(text: str, check: Check) -> JudgedCell:
    return JudgedCell(text, check.verdict, TONES[check.verdict])


def _below(check: Check) -> JudgedCell:
    return _verdict(f"{_number(check.value)} < {_number(check.limit)}", check)


def _above(check: Check) -> JudgedCell:
    return _verdict(f"{_number(check.limit)} > {_number(check.value)}", check)


def _lemma_1(study: StabilityStudy) -> Table:
    rows = [
        [
            name,
            f"{extremes.min:.4f}",
            f"{extremes.max:.4f}",
            f"{extremes.max_at_s:.2f}",
            _verdict(f"{check.value:.4f} < {check.limit:g}", check),
        ]
        for name, extremes, check in (
            ("spectral norm, as printed", study.lemma_1.norm, study.lemma_1.norm_below_one),
            ("spectral radius", study.lemma_1.radius, study.lemma_1.radius_below_one),
        )
    ]
    heads = ("", "min", "max", "at t (s)", "below 1")
    columns = [Column(head, is_label=not head) for head in heads]
    return Table.of("Lemma 1: W = E - H_S^-1 H̄ (69)", columns, rows)


def _time_delay_error(study: StabilityStudy) -> Table:
    flown, smooth = study.error, study.frictionless_error
    columns = [
        ("max |eps|", map(_number, flown.max_error)),
        ("beta", map(_number, flown.beta)),
        ("at t (s)", map("{:.4f}".format, flown.beta_at_s)),
        ("99.9 %", map(_number, flown.beta_99_9_percentile)),
    ]
    if smooth:
        columns += [
            ("frictionless", map(_number, smooth.beta)),
            ("99.9 %", map(_number, smooth.beta_99_9_percentile)),
        ]
    title = "Time-delay error eps (65), beta = max |d eps/dt| (rad/s3; base 1/s3)"
    return _by_axis(title, study.axis_names, columns)


def _gain_conditions(names: Sequence[str], twisting: SuperTwisting) -> Table:
    columns = (
        ("K_2 > beta", map(_above, twisting.k_2_above_beta)),
        ("K_1^2 > 4 K_2", map(_above, twisting.k_1_squared_above_4_k_2)),
    )
    return _by_axis("Gain conditions (46)", names, columns)


def _circle_criterion(names: Sequence[str], twisting: SuperTwisting) -> Table:
    columns = (
        ("max |G| < 1 / beta (s3/rad)", map(_below, twisting.circle_criterion)),
        ("beta tolerated", map(_number, twisting.tolerated_beta)),
    )
    return _by_axis("Circle criterion (73)", names, columns)


def _paper_lmi(names: Sequence[str], twisting: SuperTwisting) -> Table:
    columns = (
        ("eigenvalues of M", map(_numbers, twisting.paper_m_eigenvalues)),
        ("of the LMI, largest", map(_below, twisting.paper_m_residual)),
    )
    return _by_axis("LMI (51), M of (48), beta = gamma = 0", names, columns)


def _lmi(names: Sequence[str], twisting: SuperTwisting) -> Table:
    measured, assumed = twisting.measured_certificates, twisting.assumed_certificates
    columns = (
        ("gamma at\nbeta measured", _of_each(measured, lambda c: _number(c.gamma))),
        ("half\nbeta", _of_each(assumed, lambda c: _number(c.beta))),
        ("gamma", _of_each(assumed, lambda c: _number(c.gamma))),
        ("eigenvalues\nof M", _of_each(assumed, lambda c: _numbers(c.m_eigenvalues))),
        ("of the LMI,\nlargest", _of_each(assumed, lambda c: f"{c.residual:.1e}")),
    )
    title = "LMI (51), M free: gamma for beta measured, and for half the beta tolerated"
    return _by_axis(title, names, columns)


def _matrices(names: Sequence[str], twisting: SuperTwisting) -> Table:
    assumed = twisting.assumed_certificates
    columns = (
        ("M_11", _of_each(assumed, lambda c: _number(c.m[0, 0]))),
        ("M_12", _of_each(assumed, lambda c: _number(c.m[0, 1]))),
        ("M_22", _of_each(assumed, lambda c: _number(c.m[1, 1]))),
    )
    return _by_axis("M of that solution, for half the beta tolerated", names, columns)


def _reaching(names: Sequence[str], twisting: SuperTwisting) -> Table:
    columns = (
        ("V(0)", map(_number, twisting.initial_values)),
        ("its beta", _of_each(twisting.certificates, lambda c: _number(c.beta))),
        ("beta flown", map(_number, twisting.reaching_beta)),
        ("|s| below", map(_number, twisting.reaching.threshold)),
        ("measured < bound (s)", map(_below, twisting.reaching_time)),
    )
    title = f"Reaching time (56) from an error of {twisting.initial_error:g} on every axis"
    return _by_axis(title, names, columns)


def _closing(study: StabilityStudy, twisting: SuperTwisting) -> str:
    axes = len(twisting.gains)
    bounded = sum(check.holds is True for check in twisting.k_2_above_beta)
    kept = sum(check.applies for check in twisting.reaching_time)
    sentences = [
        f"K_2 > beta holds on {bounded} of {axes} axes. The conditions are sufficient, not "
        "necessary: where one fails nothing is proven. None of these flights diverged."
    ]
    if study.frictionless_error:
        over = sum(study.frictionless_error.beta >= twisting.k_2)
        sentences.append(
            f"Without friction beta is K_2 or more on {over} of {axes} axes: eps follows u (70), "
            "and K_1 |s|^1/2 in u is infinitely steep at s = 0, so beta depends on the gains."
        )
    sentences.append(
        f"The bound (56) presumes |d eps/dt| <= its beta, which was so on {kept} of {axes} axes: "
        "on the others it says nothing."
    )
    return "\n".join(sentences)
