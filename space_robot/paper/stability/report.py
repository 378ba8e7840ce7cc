"""A study as data for JSON; NaN and infinity become None."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from .check import Check
from .lemma_1 import SAMPLING
from .lyapunov import Certificate
from .study import StabilityStudy
from .super_twisting import SuperTwisting
from .time_delay_error import ErrorDerivative


def report(study: StabilityStudy) -> dict[str, Any]:
    """Return the results of a study; lists have one entry per axis, in the order of ``axes``."""
    flight, lemma_1 = study.flight, study.lemma_1
    content = {
        **{key: flight.description[key] for key in ("controller", "case", "gains", "robot")},
        "friction": flight.scenario.has_friction,
        "duration_s": flight.ticks * flight.period,
        "axes": study.axis_names,
        "lemma_1": {
            "sampled_every_s": SAMPLING,
            "spectral_norm": lemma_1.norm._asdict(),
            "spectral_radius": lemma_1.radius._asdict(),
            "spectral_norm_below_1": lemma_1.norm_below_one,
            "spectral_radius_below_1": lemma_1.radius_below_one,
        },
        "time_delay_error": {"as_flown": study.error, "without_friction": study.frictionless_error},
        "super_twisting": study.super_twisting and _super_twisting(study.super_twisting),
    }
    plain: dict[str, Any] = _plain(content)
    return plain


def _super_twisting(twisting: SuperTwisting) -> dict[str, Any]:
    return {
        "k_1": twisting.k_1,
        "k_2": twisting.k_2,
        "beta": twisting.beta,
        "tolerated_beta": twisting.tolerated_beta,
        "beta_below_k_2": twisting.k_2_above_beta,
        "4_k_2_below_k_1_squared": twisting.k_1_squared_above_4_k_2,
        "circle_criterion": twisting.circle_criterion,
        "lmi": {
            "residual_of_paper_m_at_beta_0_gamma_0": twisting.paper_m_residual,
            "paper_m_eigenvalues": twisting.paper_m_eigenvalues,
            "measured_beta": twisting.measured_certificates,
            "assumed_beta_half_of_tolerated": twisting.assumed_certificates,
        },
        "reaching": {
            "initial_error": twisting.initial_error,
            "initial_lyapunov_value": twisting.initial_values,
            "threshold_of_s": twisting.reaching.threshold,
            "beta_of_bound": [c and c.beta for c in twisting.certificates],
            "beta_of_this_flight": twisting.reaching_beta,
            "reaching_time_s_below_bound": twisting.reaching_time,
        },
    }


def _plain(value: Any) -> Any:
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
    if isinstance(value, float):
        return float(value) if math.isfinite(value) else None
    return value
