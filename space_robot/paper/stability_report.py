"""A stability study as data for JSON, and as tables with both numbers of every condition."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict
from typing import Any

import numpy as np
from rich.console import Console

from ..console.tables import Column, JudgedCell, Table, Value, named
from ..console.terminal import print_table, say
from .lyapunov import Certificate
from .stability import (
    LEMMA_1_EVERY_S,
    AxisConditions,
    Check,
    ErrorDerivative,
    StabilityStudy,
    SuperTwisting,
)

TONES = {"holds": "good", "fails": "bad", "open": "open", "not applicable": "open"}


def report(study: StabilityStudy) -> dict[str, Any]:
    """Return the results of a study; lists have one entry per axis, in the order of ``axes``."""
    flight, lemma_1 = study.flight, study.lemma_1
    content = {
        **{key: flight.description[key] for key in ("controller", "case", "gains", "robot")},
        "friction": flight.scenario.has_friction,
        "duration_s": flight.ticks * flight.period,
        "axes": study.axis_names,
        "lemma_1": {
            "sampled_every_s": LEMMA_1_EVERY_S,
            "spectral_norm": lemma_1.norm._asdict(),
            "spectral_radius": lemma_1.radius._asdict(),
            "spectral_norm_below_1": lemma_1.norm.below_one,
            "spectral_radius_below_1": lemma_1.radius.below_one,
        },
        "time_delay_error": {"as_flown": study.error, "without_friction": study.frictionless_error},
        "super_twisting": study.super_twisting and _super_twisting(study.super_twisting),
    }
    as_data: dict[str, Any] = _plain(content)
    return as_data


def _super_twisting(twisting: SuperTwisting) -> dict[str, Any]:
    columns = dict(zip(AxisConditions._fields, zip(*twisting.axes, strict=True), strict=True))
    return {
        **{name: columns[name] for name in ("k_1", "k_2", "beta", "tolerated_beta")},
        "beta_below_k_2": columns["beta_below_k_2"],
        "4_k_2_below_k_1_squared": columns["four_k_2_below_k_1_squared"],
        "circle_criterion": columns["circle_criterion"],
        "lmi": {
            "residual_of_paper_m_at_beta_0_gamma_0": columns["paper_m_residual"],
            "paper_m_eigenvalues": columns["paper_m_eigenvalues"],
            "measured_beta": columns["measured"],
            "assumed_beta_half_of_tolerated": columns["assumed"],
        },
        "reaching": {
            "initial_error": twisting.initial_error,
            "initial_lyapunov_value": columns["initial_value"],
            "threshold_of_s": twisting.reaching.threshold,
            "beta_of_bound": [x.certificate and x.certificate.beta for x in twisting.axes],
            "beta_of_this_flight": columns["reaching_beta"],
            "reaching_time_s_below_bound": columns["reaching_time"],
        },
    }


def _plain(value: Any) -> Any:
    """Return what JSON can have; NaN and infinity become None."""
    if isinstance(value, Check):
        return _plain({"holds": value.holds, **value._asdict()})
    if isinstance(value, (Certificate, ErrorDerivative)):
        return _plain(asdict(value))
    if isinstance(value, np.ndarray):
        return _plain(value.tolist())
    if isinstance(value, Mapping):
        return {key: _plain(entry) for key, entry in value.items()}
    if isinstance(value, Sequence) and not isinstance(value, str):
        return [_plain(entry) for entry in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def print_study(study: StabilityStudy, console: Console) -> None:
    """Print all tables and a closing sentence."""
    flight, twisting = study.flight, study.super_twisting
    names = flight.description
    say(
        console,
        f"{names['controller']}, case {names['case']}, gains {names['gains']}, robot "
        f"{names['robot']}: {flight.ticks * flight.period:g} s, "
        f"joint friction {'on' if flight.scenario.has_friction else 'off'}",
    )
    print_table(_lemma_1(study), console)
    columns: list[tuple[str, Iterable[Value]]] = [
        ("max |eps|", map(_number, study.error.max_error)),
        ("beta", map(_number, study.error.beta)),
        ("at t (s)", map("{:.4f}".format, study.error.beta_at_s)),
        ("99.9 %", map(_number, study.error.beta_99_9_percentile)),
    ]
    if smooth := study.frictionless_error:
        columns.append(("frictionless", map(_number, smooth.beta)))
        columns.append(("99.9 %", map(_number, smooth.beta_99_9_percentile)))
    title = "Time-delay error eps (65), beta = max |d eps/dt| (rad/s3; base 1/s3)"
    print_table(_by_axis(title, study.axis_names, columns), console)
    if twisting is None:
        say(
            console,
            f"(46) to (77) are about the gains k_1 and k_2: they do not apply to "
            f"{names['controller']}.",
        )
        return
    for title, columns in _conditions(twisting).items():
        print_table(_by_axis(title, study.axis_names, columns), console)
    say(console, _closing(study, twisting))


def _lemma_1(study: StabilityStudy) -> Table:
    norms = {
        "spectral norm, as printed": study.lemma_1.norm,
        "spectral radius": study.lemma_1.radius,
    }
    rows = [
        [name, x.min, x.max, x.max_at_s, _verdict(f"{x.max:.4f} < 1", x.below_one)]
        for name, x in norms.items()
    ]
    heads = {"min": ".4f", "max": ".4f", "at t (s)": ".2f", "below 1": ""}
    columns = [named(), *(Column(head, "", spec) for head, spec in heads.items())]
    return Table.of("Lemma 1: W = E - H_S^-1 H̄ (69)", columns, rows)


def _conditions(twisting: SuperTwisting) -> dict[str, list[tuple[str, Iterable[Value]]]]:
    """Return heading and cells of each column, by the titles of the tables."""
    axes = twisting.axes
    assumed = [axis.assumed for axis in axes]
    return {
        "Gain conditions (46)": [
            ("K_2 > beta", [_above(axis.beta_below_k_2) for axis in axes]),
            ("K_1^2 > 4 K_2", [_above(axis.four_k_2_below_k_1_squared) for axis in axes]),
        ],
        "Circle criterion (73)": [
            ("max |G| < 1 / beta (s3/rad)", [_below(axis.circle_criterion) for axis in axes]),
            ("beta tolerated", [_number(axis.tolerated_beta) for axis in axes]),
        ],
        "LMI (51), M of (48), beta = gamma = 0": [
            ("eigenvalues of M", [_numbers(axis.paper_m_eigenvalues) for axis in axes]),
            ("of the LMI, largest", [_below(axis.paper_m_residual) for axis in axes]),
        ],
        "LMI (51), M free: gamma for beta measured, and for half the beta tolerated": [
            ("gamma at\nbeta measured", _each((x.measured for x in axes), "gamma")),
            ("half\nbeta", _each(assumed, "beta")),
            ("gamma", _each(assumed, "gamma")),
            ("eigenvalues\nof M", [_numbers(c.m_eigenvalues) if c else "none" for c in assumed]),
            ("of the LMI,\nlargest", [f"{c.residual:.1e}" if c else "none" for c in assumed]),
        ],
        "M of that solution, for half the beta tolerated": [
            ("M_11", [_number(c.m[0, 0]) if c else "none" for c in assumed]),
            ("M_12", [_number(c.m[0, 1]) if c else "none" for c in assumed]),
            ("M_22", [_number(c.m[1, 1]) if c else "none" for c in assumed]),
        ],
        f"Reaching time (56) from an error of {twisting.initial_error:g} on every axis": [
            ("V(0)", [_number(axis.initial_value) for axis in axes]),
            ("its beta", _each((axis.certificate for axis in axes), "beta")),
            ("beta flown", [_number(axis.reaching_beta) for axis in axes]),
            ("|s| below", map(_number, twisting.reaching.threshold)),
            ("measured < bound (s)", [_below(axis.reaching_time) for axis in axes]),
        ],
    }


def _by_axis(
    title: str, names: Sequence[str], columns: Iterable[tuple[str, Iterable[Value]]]
) -> Table:
    heads, cells = zip(*columns, strict=True)
    rows = list(zip(names, *cells, strict=True))
    return Table.of(title, [named(), *map(Column, heads)], rows)


def _each(certificates: Iterable[Certificate | None], name: str) -> list[str]:
    return ["none" if c is None else _number(getattr(c, name)) for c in certificates]


def _number(value: float) -> str:
    return "none" if math.isnan(value) else f"{value:.3g}"


def _numbers(values: Iterable[float]) -> str:
    return ", ".join(map(_number, values))


def _verdict(text: str, check: Check) -> JudgedCell:
    return JudgedCell(text, check.verdict, TONES[check.verdict])


def _below(check: Check) -> JudgedCell:
    return _verdict(f"{_number(check.value)} < {_number(check.limit)}", check)


def _above(check: Check) -> JudgedCell:
    return _verdict(f"{_number(check.limit)} > {_number(check.value)}", check)


def _closing(study: StabilityStudy, twisting: SuperTwisting) -> str:
    axes = len(twisting.axes)
    bounded = sum(axis.beta_below_k_2.holds is True for axis in twisting.axes)
    kept = sum(axis.reaching_time.applies for axis in twisting.axes)
    sentences = [
        f"K_2 > beta holds on {bounded} of {axes} axes. The conditions are sufficient, not "
        "necessary: where one fails nothing is proven. None of these flights diverged."
    ]
    if study.frictionless_error:
        beta = study.frictionless_error.beta.tolist()
        over = sum(b >= axis.k_2 for b, axis in zip(beta, twisting.axes, strict=True))
        sentences.append(
            f"Without friction beta is K_2 or more on {over} of {axes} axes: eps follows u (70), "
            "and K_1 |s|^1/2 in u is infinitely steep at s = 0, so beta depends on the gains."
        )
    sentences.append(
        f"The bound (56) presumes |d eps/dt| <= its beta, which was so on {kept} of {axes} axes: "
        "on the others it says nothing."
    )
    return "\n".join(sentences)
