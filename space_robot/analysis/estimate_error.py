"""The error of the time-delay estimate N_hat of N, from recorded motion and torque alone.

``N = F_S - h_bar rhodd`` (33) is all that the constant diagonal inertia h_bar (the gain ``h_bar``)
leaves out; ``N_hat(t) = N(t - delta)`` (35), (36). The controller forms N_hat from the pair of
`space_robot_control.controller.time_delay_estimation`: the torque *reported* for the last
interval and the mean acceleration *measured* over it. Both are in a bag, so N_hat follows without
the telemetry.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from typing import Any

import numpy as np

from space_robot_control.navigation.rate_filters import low_pass_weight
from space_robot_model.elementary.matrices import Array
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.bag.law_history import laws_of
from space_robot_msgs_py.errors import InputError

from .analysed_log import AnalysedLog
from .described import DIRECT, NotDescribedError, flown_name, flown_settings
from .errors import applied_force, continuous_error, mean_acceleration, measured_rows
from .series import Definition, TimeSeries, series

HBar = Callable[[FlightLog], Array]
"""h_bar in force in the rows of a log: (m,), or (N, m) with NaN under a law without an estimate, or
with one of the nominal inertia."""


@series(
    "estimate error",
    {
        "estimate_error_base": Definition(
            "N m",
            "N - N_hat on the base, of the generalised force of eps_e (about twice the torque)",
            is_vector=True,
        ),
        "estimate_error_prismatic": Definition("N", "N - N_hat of the time-delay estimate"),
        "estimate_error_*": Definition("N m", "N - N_hat of the time-delay estimate"),
    },
)
def estimate_error(flight: AnalysedLog) -> TimeSeries:
    """Return the error of the time-delay estimate of the laws in force."""
    log = flight.log
    axes = {f"estimate_error_{name}": index for name, index in flight.groups.items()}
    values = estimate_errors(log, recorded_h_bar, law_smoothing(log), rest=log.first_tick == 0)
    return TimeSeries(axes, values, _unknown(log))


def estimate_errors(
    log: FlightLog, h_bar: HBar, smoothing: float = 0.0, rest: bool = True
) -> Callable[[int, int], Array]:
    """Return a function from rows, in order, to ``N - N_hat`` (stop - start, m).

    N is of the true motion and the torque given, N_hat of the motion measured and the torque
    reported, as the controller had them. A row is NaN where a state that it needs is missing or was
    filled in (`FlightLog.filled`), and under a law without an estimate. The first and the last are.

    Args:
        log: a flight without gaps.
        h_bar: of the laws in force.
        smoothing: weight of a new pair in the low-pass, see `low_pass_weight`; 0: no low-pass.
        rest: whether the flight begins at rest; else the low-pass begins at the first row.
    """
    reported, low_pass = log.as_measured(), PairFilter(smoothing, rest)

    def values(start: int, stop: int) -> Array:
        first, last = max(start - 1, 0), min(stop + 1, log.ticks)
        rows, errors = log.rows(first, last), np.full((stop - start, log.axes), np.nan)
        if rows.ticks < 3:
            return errors
        true = _pairs(rows)
        as_reported = true if reported is log else _pairs(reported.rows(first, last))
        estimates = low_pass.of(first, as_reported)
        law_h_bar = h_bar(rows)
        own = law_h_bar[1:-1] if law_h_bar.ndim == 2 else law_h_bar
        # force and acceleration outlast a change of law or gains, their h_bar does not
        estimate = estimates[:-1, 0] - own * estimates[:-1, 1]
        error = true[1:, 0] - own * true[1:, 1] - estimate
        known = np.broadcast_to(np.isfinite(own).all(axis=-1), len(error))
        is_measured = measured_rows(reported, first, last)
        known = known & is_measured[:-2] & is_measured[1:-1] & is_measured[2:]
        if not np.isfinite(error[known]).all():
            raise InputError("the attitude's error was 180 degrees, where J0 of (1) is singular")
        row = first + 1 - start
        errors[row : row + len(error)][known] = error[known]
        return errors

    return values


class PairFilter:
    """``N_hat`` as the controller forms it of force and acceleration, interval after interval.

    It is linear, so that it may be formed of both before h_bar is known. Arguments as in
    `estimate_errors`.
    """

    def __init__(self, smoothing: float = 0.0, rest: bool = True) -> None:
        self._smoothing, self._rest = smoothing, rest
        self._state: Array | None = None
        self._stop, self._last = 0, np.empty(0)

    def of(self, first: int, pairs: Array) -> Array:
        """Return (K, ...) filtered; those before the last call's end are taken from there.

        Args:
            first: interval of the flight that ``pairs`` begin with.
            pairs: (K, ...).
        """
        smoothing, known = self._smoothing, self._stop - first
        inputs = pairs[max(known, 0) :]
        if not (0.0 < smoothing < 1.0 and len(inputs)):
            return pairs
        from scipy.signal import lfilter  # slow to import, and hardly ever needed

        if self._state is None:
            before = np.zeros_like(inputs[:1]) if self._rest else inputs[:1]
            self._state = (1.0 - smoothing) * before
        filtered: Any = lfilter([smoothing], [1.0, smoothing - 1.0], inputs, axis=0, zi=self._state)
        estimates: Array
        estimates, self._state = filtered
        if known > 0:
            estimates = np.concatenate([self._last[len(self._last) - known :], estimates])
        self._stop, self._last = first + len(pairs), estimates[-2:].copy()
        return estimates


def _pairs(rows: FlightLog) -> Array:
    """(K, 2, m) force and mean acceleration over each interval between two rows."""
    error = continuous_error(rows)
    with np.errstate(divide="ignore", invalid="ignore"):  # J0 may be singular
        return np.stack([applied_force(rows, error), mean_acceleration(rows, error)], axis=1)


def _unknown(log: FlightLog) -> str:
    laws = laws_of(log)
    if laws and not any(any(law.gains.get("h_bar", ())) for law in laws):
        names = ", ".join(sorted({law.name for law in laws}))
        return f"{names} has no time-delay estimate with a constant h_bar"
    return "three measured states in a row are needed"


def law_smoothing(log: FlightLog) -> float:
    """Return the weight of a new pair in the low-pass of the laws' time-delay estimate; 0: none."""
    if flown_name(log, "navigation") != DIRECT:
        raise InputError("the filtered states that N_hat is formed of are not recorded")
    if not log.laws:
        raise InputError("the laws in force were not recorded")
    with suppress(NotDescribedError):
        filter_hz = flown_settings(log).controller.acceleration_filter_hz
        return low_pass_weight(filter_hz, log.timebase.period)
    return 0.0


def recorded_h_bar(log: FlightLog) -> Array:
    """Return h_bar of the laws in force in the rows of ``log``, see `HBar`."""
    laws, none = laws_of(log), np.full(log.axes, np.nan)
    rows: list[Array] = [none]
    for law in laws:
        values = law.gains.get("h_bar", ())
        fits = len(values) in (1, log.axes) and any(values)  # zeros: the nominal inertia
        rows.append(np.broadcast_to(values, log.axes) if fits else none)
    if len(laws) == 1 and laws[0].tick <= log.first_tick:
        return np.asarray(rows[1])
    ticks = np.arange(log.first_tick, log.first_tick + log.ticks)
    which = np.searchsorted([law.tick for law in laws], ticks, side="right")
    return np.array(rows)[which]
