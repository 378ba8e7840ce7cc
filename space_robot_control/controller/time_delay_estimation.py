"""The time-delay estimate (35), (36), shared by every law that uses one.

``N_hat(t) = F_S(t - delta) - h_bar rhodd(t - delta)`` holds only if the force is the one that was
*applied* while the acceleration was measured. Under zero-order hold the backward difference of
rhodot is the mean acceleration over the last interval, so it pairs with the force that the plant
reports as applied over that interval: not with the controller's own last output, which may
arrive late or saturate.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.compiled.kernels import kernel
from space_robot_msgs_py.compiled.lanes import any_lane, uniform, where, whole
from space_robot_msgs_py.compiled.records import Record, shaped

Array = NDArray[np.float64]

LONGEST_GAP = 20
"""Ticks between two states that still make a pair: without states the plant holds its command, so
the force it reports acted all that time."""


class TimeDelayPair(Record):
    """The last applied force and the acceleration it caused, per axis."""

    seen: float = shaped(lambda n: (), "1 if any tick has been observed, else 0")
    smoothing: float = shaped(lambda n: ())
    """Weight of a new pair in the low-pass, see `low_pass_weight`; 0: no low-pass."""
    tick: float = shaped(lambda n: (), "The last tick observed")
    rate: Array = shaped(lambda n: (n + 3,), "rhodot at that tick")
    applied_force: Array = shaped(lambda n: (n + 3,), "F_S over the last interval")
    acceleration: Array = shaped(lambda n: (n + 3,), "Mean rhodd over the last interval")


@kernel
def follows(pair: TimeDelayPair, tick: int) -> bool:
    """Return whether ``tick`` makes a pair with the last tick observed."""
    elapsed = tick - whole(pair.tick)
    return bool(uniform(pair.seen) == 1.0 and 1 <= elapsed <= LONGEST_GAP)


@kernel
def observe(
    pair: TimeDelayPair,
    tick: int,
    applied_force: Array,
    rate: Array,
    acceleration_desired: Array,
    period: float,
) -> None:
    """Take force and rate (m,) of the interval that ended at ``tick``.

    The first tick, and one after a longer gap, has no acceleration: the desired one is taken.
    A low-pass takes force and acceleration alike, so that they stay a pair.
    """
    known, elapsed = follows(pair, tick), tick - whole(pair.tick)
    weight = where(pair.smoothing > 0.0, pair.smoothing, 1.0) if known else 1.0
    for i in range(rate.size):
        force, acceleration = applied_force[i], acceleration_desired[i]
        if known:
            # mean rhodd of the interval over which the plant held `applied_force`
            acceleration = (rate[i] - pair.rate[i]) / (elapsed * period)
        if any_lane(weight < 1.0):
            smooth_force = pair.applied_force[i] + weight * (force - pair.applied_force[i])
            smooth = pair.acceleration[i] + weight * (acceleration - pair.acceleration[i])
            force = where(weight < 1.0, smooth_force, force)
            acceleration = where(weight < 1.0, smooth, acceleration)
        pair.applied_force[i] = force
        pair.acceleration[i] = acceleration
    pair.seen = 1.0
    pair.tick = tick
    pair.rate[:] = rate


@kernel
def time_delay_estimate(pair: TimeDelayPair, h_bar: Array, n_hat: Array) -> None:
    """Compute the estimate (35), (36) for a constant diagonal inertia ``h_bar`` (m,)."""
    # N_hat = F(t - delta) - h_bar rhodd(t - delta)
    for i in range(n_hat.size):
        n_hat[i] = pair.applied_force[i] - h_bar[i] * pair.acceleration[i]


@kernel
def nominal_estimate(pair: TimeDelayPair, inertia: Array, n_hat: Array) -> None:
    """Compute the estimate (36) with the ``inertia`` (m, m) H_S of the nominal model.

    This is incremental nonlinear dynamic inversion (Sieberling, Chu & Mulder 2010).
    """
    for i in range(n_hat.size):
        n_hat[i] = pair.applied_force[i]
        for j in range(n_hat.size):
            n_hat[i] -= inertia[i, j] * pair.acceleration[j]
