"""The time-delay error (65) of a flight and the bound beta of its derivative.

``eps = h_bar^-1 (N - N_hat)`` is the error of the estimate in units of acceleration, with
``N = F_S - h_bar rhodd`` (33). All three belong to one interval: a command of tick k acts until
tick k+1, and the mean acceleration over it is ``(rhodot_k+1 - rhodot_k) / delta``. For a law
``F_S = h_bar u + N_hat`` this is the paper's ``eps = u - rhodd``.

This beta is that of the closed loop. By (70) chi contains ``W (u(t) - u(t - delta))``, and u
contains ``K_1 |s|^1/2 sign(s)``, whose slope at s = 0 is infinite: beta depends on the gains that
it is compared with. Coulomb friction adds jumps whenever a joint starts or stops.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.bag.flight_log import FlightLog

from ...analysis.errors import neglected_force

Array = NDArray[np.float64]


@dataclass(frozen=True)
class ErrorDerivative:
    """Largest values of eps and its derivative, per axis (m,)."""

    max_error: Array
    """Largest |eps|, rad/s2 (eps: 1/s2)."""
    beta: Array
    """Largest |eps_k+1 - eps_k| / delta, rad/s3 (eps: 1/s3)."""
    beta_at_s: Array
    """Time of this maximum, s."""
    beta_99_9_percentile: Array
    """99.9th percentile of the same, which ignores jumps in up to 0.1 % of the ticks."""


def time_delay_error(log: FlightLog, h_bar: Array) -> Array:
    """Return eps (N-1, m) over the interval after each tick, of a flight with telemetry.

    Before tick 1 there is no estimate, so row 0 has N_hat = 0.
    """
    if log.telemetry is None:
        raise ValueError("the time-delay error needs a log with the controller's telemetry")
    n_hat = log.telemetry[:-1, 2]
    error: Array = (neglected_force(log, h_bar) - n_hat) / h_bar
    return error


def error_derivative(error: Array, period: float) -> ErrorDerivative:
    """Return the bounds of ``error`` (N-1, m), sampled every ``period`` s, without row 0."""
    estimated = error[1:]
    derivative = np.abs(np.diff(estimated, axis=0)) / period
    return ErrorDerivative(
        max_error=np.max(np.abs(estimated), axis=0),
        beta=np.max(derivative, axis=0),
        beta_at_s=(np.argmax(derivative, axis=0) + 2).astype(np.float64) * period,
        beta_99_9_percentile=np.percentile(derivative, 99.9, axis=0),
    )
