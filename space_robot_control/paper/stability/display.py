"""A study as tables: every condition with its two numbers and a verdict."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from rich.console import Console

from ...analysis.tables import Column, Row, Table, Verdict
from ...analysis.terminal import print_table
from ...flight.terminal import say
from .check import Check
from .study import Study
from .super_twisting import SuperTwisting

TONES = {"holds": "good", "fails": "bad", "open": "open"}


def print_study(study: Study, console: Console) -> None:
    """Print all tables and a closing sentence."""
    flight = study.flight
    what = flight.description
    say(
        console,
        f"{what['controller']}, case {what['case']}, gains {what['gains']}, robot "
        f"{what['robot']}: {flight.ticks * flight.period:g} s, "
        f"joint friction {'on' if flight.has_friction else 'off'}",
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


def _table(title: str, heads: Sequence[str], rows: Iterable[Row]) -> Table:
    columns = [Column(is_label=True), *(Column(head) for head in heads)]
    return Table.of(title, columns, list(rows))


def _number(value: float | None) -> str:
    return "none" if value is None or value != value else f"{value:.3g}"


def _verdict(text: str, check: Check) -> Verdict:
    return Verdict(text, check.verdict, TONES[check.verdict])


def _below(check: Check) -> Verdict:
    return _verdict(f"{_number(check.value)} < {_number(check.limit)}", check)


def _above(check: Check) -> Verdict:
    return _verdict(f"{_number(check.limit)} > {_number(check.value)}", check)


def _lemma_1(study: Study) -> Table:
    rows = [
        [
            name, f"{extremes.min:.4f}", f"{extremes.max:.4f}", f"{extremes.max_at_s:.2f}",
            _verdict(f"{check.value:.4f} < {check.limit:g}", check),
        ]
        for name, extremes, check in (
            ("spectral norm, as printed", study.lemma_1.norm, study.lemma_1.norm_below_one),
            ("spectral radius", study.lemma_1.radius, study.lemma_1.radius_below_one),
        )
    ]  # fmt: skip
    title = "Lemma 1: W = E - H_S^-1 h_bar (69)"
    return _table(title, ("min", "max", "at t (s)", "below 1"), rows)


def _time_delay_error(study: Study) -> Table:
    flown, smooth = study.error, study.frictionless_error
    title = "Time-delay error eps (65), beta = max |d eps/dt| (rad/s3; base 1/s3)"
    heads = ["max |eps|", "beta", "at t (s)", "99.9 %"]
    rows = [
        [
            name, _number(flown.max_error[i]), _number(flown.beta[i]), f"{flown.beta_at_s[i]:.4f}",
            _number(flown.beta_99_9_percentile[i]),
        ]
        for i, name in enumerate(study.axis_names)
    ]  # fmt: skip
    if smooth:
        heads += ["frictionless", "99.9 %"]
        for i, row in enumerate(rows):
            row += [_number(smooth.beta[i]), _number(smooth.beta_99_9_percentile[i])]
    return _table(title, heads, rows)


def _gain_conditions(names: Sequence[str], twisting: SuperTwisting) -> Table:
    checks = zip(names, twisting.k_2_above_beta, twisting.k_1_squared_above_4_k_2, strict=True)
    rows = [[name, _above(bounded), _above(damped)] for name, bounded, damped in checks]
    return _table("Gain conditions (46)", ("K_2 > beta", "K_1^2 > 4 K_2"), rows)


def _circle_criterion(names: Sequence[str], twisting: SuperTwisting) -> Table:
    found = zip(names, twisting.circle_criterion, twisting.tolerated_beta, strict=True)
    rows = [[name, _below(check), _number(tolerated)] for name, check, tolerated in found]
    heads = "max |G| < 1 / beta (s3/rad)", "beta tolerated"
    return _table("Circle criterion (73)", heads, rows)


def _paper_lmi(names: Sequence[str], twisting: SuperTwisting) -> Table:
    found = zip(names, twisting.paper_m_eigenvalues, twisting.paper_m_residual, strict=True)
    rows = [
        [name, f"{_number(low)}, {_number(high)}", _below(check)]
        for name, (low, high), check in found
    ]
    heads = "eigenvalues of M", "of the LMI, largest"
    return _table("LMI (51), M of (48), beta = gamma = 0", heads, rows)


def _lmi(names: Sequence[str], twisting: SuperTwisting) -> Table:
    rows = []
    found = zip(
        names, twisting.measured_certificates, twisting.assumed_certificates, strict=True
    )  # fmt: skip
    for name, measured, assumed in found:
        cells = ["none"] * 4
        if assumed:
            low, high = assumed.m_eigenvalues
            cells = [
                _number(assumed.beta), _number(assumed.gamma), f"{_number(low)}, {_number(high)}",
                f"{assumed.residual:.1e}",
            ]  # fmt: skip
        rows.append([name, _number(measured.gamma if measured else None), *cells])
    return _table(
        "LMI (51), M free: gamma for beta measured, and for half the beta tolerated",
        ("gamma at\nbeta measured", "half\nbeta", "gamma", "eigenvalues\nof M",
         "of the LMI,\nlargest"),
        rows,
    )  # fmt: skip


def _matrices(names: Sequence[str], twisting: SuperTwisting) -> Table:
    rows = []
    for name, certificate in zip(names, twisting.assumed_certificates, strict=True):
        entries = certificate.m[[0, 0, 1], [0, 1, 1]] if certificate else [None] * 3
        rows.append([name, *(_number(entry) for entry in entries)])
    title = "M of that solution, for half the beta tolerated"
    return _table(title, ("M_11", "M_12", "M_22"), rows)


def _reaching(names: Sequence[str], twisting: SuperTwisting) -> Table:
    found = zip(
        names, twisting.initial_values, twisting.certificates, twisting.reaching_beta,
        twisting.reaching.threshold, twisting.reaching_time, strict=True,
    )  # fmt: skip
    rows = [
        [
            name, _number(value), _number(certificate.beta if certificate else None),
            _number(flown), _number(threshold), _below(check),
        ]
        for name, value, certificate, flown, threshold, check in found
    ]  # fmt: skip
    title = f"Reaching time (56) from an error of {twisting.initial_error:g} on every axis"
    heads = "V(0)", "its beta", "beta flown", "|s| below", "measured < bound (s)"
    return _table(title, heads, rows)


def _closing(study: Study, twisting: SuperTwisting) -> str:
    axes = len(twisting.gains)
    bounded = sum(check.holds is True for check in twisting.k_2_above_beta)
    pairs = zip(twisting.certificates, twisting.reaching_beta, strict=True)
    kept = sum(c is not None and bool(beta <= c.beta) for c, beta in pairs)
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
        f"The bound (56) presumes |d eps/dt| <= its beta, which was so on {kept} of {axes} axes."
    )
    return "\n".join(sentences)
