"""How far the time-delay estimate N_hat was from N, from recorded motion and torque alone.

``N = F_S - Mbar rhodd`` (33) is all that the constant diagonal inertia Mbar (the gain ``h_bar``)
leaves out; ``N_hat(t) = N(t - delta)`` (35), (36). The controller forms N_hat from the pair that
`space_robot_control.time_delay_estimation` keeps: the torque *applied* over the last interval and
the mean acceleration over it. Both are in a bag, so N_hat follows without the telemetry.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.flight_log import FlightLog

from .generalised_motion import applied_force, mean_acceleration, measured_rows

Array = NDArray[np.float64]


def neglected_force(log: FlightLog, h_bar: Array) -> Array:
    """(N-1, m) ``N`` (33) over the interval that begins at each tick.

    N m on the joints; on the base the generalised force that belongs to eps, twice the torque
    where the attitude is small.
    """
    return applied_force(log) - h_bar * mean_acceleration(log)


def delayed_estimate(neglected: Array, smoothing: float = 0.0, rest: bool = True) -> Array:
    """(N-1, m) ``N_hat`` at the ticks 1 to N-1, as the controller forms it.

    Args:
        neglected: (N-1, m) `neglected_force`.
        smoothing: weight of a new pair in the low-pass, see
            `time_delay_estimation.low_pass_weight`; 0: no low-pass.
        rest: whether the rows begin at the flight's start, at rest; else the low-pass begins at
            the first row.
    """
    if not 0.0 < smoothing < 1.0:
        return neglected
    from scipy.signal import lfilter  # slow to import, and hardly ever needed

    before = np.zeros_like(neglected[:1]) if rest else neglected[:1]
    estimate: Array
    estimate, _ = lfilter(
        [smoothing], [1.0, smoothing - 1.0], neglected, axis=0, zi=(1.0 - smoothing) * before
    )
    return estimate


def estimate_error(log: FlightLog, h_bar: Array, smoothing: float = 0.0) -> Array:
    """(K, m) ``N - N_hat`` at the ticks 1 to N-2, in the units of `neglected_force`.

    Ticks whose state was filled in (`FlightLog.filled`), and their neighbours, are left out: what
    stands there was not measured.
    """
    neglected = neglected_force(log, h_bar)
    estimate = delayed_estimate(neglected, smoothing, rest=log.first_tick == 0)
    error = neglected[1:] - estimate[:-1]
    if log.filled:
        there = measured_rows(log)
        error = error[there[:-2] & there[1:-1] & there[2:]]
    return error
