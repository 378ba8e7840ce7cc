"""The time-delay estimate (35), (36), shared by every law that uses one.

``N_hat(t) = F_S(t - delta) - Hbar rhodd(t - delta)`` holds only if the force is the one that was
*applied* while the acceleration was measured. Under zero-order hold the backward difference of
rhodot is the mean acceleration over the last interval, so it pairs with the force that the plant
reports as applied over that interval: not with the controller's own last output, which may
arrive late or saturate.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.compiled import kernel
from space_robot_sim.records import Record, shaped

Array = NDArray[np.float64]


class TimeDelayPair(Record):
    """The last applied force and the acceleration it caused, per axis."""

    seen: float = shaped(lambda n: ())
    """Whether any tick has been observed, 0 or 1."""
    tick: float = shaped(lambda n: ())
    """The last tick observed."""
    rate: Array = shaped(lambda n: (n + 3,))
    """rhodot at that tick."""
    applied_force: Array = shaped(lambda n: (n + 3,))
    """F_S over the last interval."""
    acceleration: Array = shaped(lambda n: (n + 3,))
    """Mean rhodd over the last interval."""


@kernel
def observe(
    pair: TimeDelayPair, tick: int, applied_force: Array, rate: Array, period: float
) -> None:
    """Take force and rate (m,) of the interval that ended at ``tick``.

    The first tick, and one after a gap, has no pair: the last one is kept.
    """
    if pair.seen == 1.0 and tick == pair.tick + 1.0:
        for i in range(rate.size):
            pair.applied_force[i] = applied_force[i]
            pair.acceleration[i] = (rate[i] - pair.rate[i]) / period
    pair.seen = 1.0
    pair.tick = tick
    pair.rate[:] = rate


@kernel
def time_delay_estimate(pair: TimeDelayPair, h_bar: Array, n_hat: Array) -> None:
    """(36) for a constant diagonal inertia ``h_bar`` (m,)."""
    for i in range(n_hat.size):
        n_hat[i] = pair.applied_force[i] - h_bar[i] * pair.acceleration[i]
