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

from space_robot_sim.compiled import kernel

Array = NDArray[np.float64]


class TimeDelayEstimator:
    """Stores the last applied force and the acceleration it caused, per axis."""

    def __init__(self, axes: int, period: float) -> None:
        self._period = period
        self._tick: int | None = None
        self._rate = np.zeros(axes)
        self.applied_force = np.zeros(axes)
        """(m,) F_S over the last interval."""
        self.acceleration = np.zeros(axes)
        """(m,) mean rhodd over the last interval."""
        self.n_hat = np.zeros(axes)
        """(m,) the last estimate."""

    def observe(self, tick: int, applied_force: Array, rate: Array) -> None:
        """Take the pair of the interval that ended at ``tick``.

        The first tick, and one after a gap, has no pair: the last one is kept.
        """
        if self._tick is not None and tick == self._tick + 1:
            pair(
                applied_force, rate, self._rate, self._period, self.applied_force, self.acceleration
            )
        self._tick = tick
        self._rate[:] = rate

    def estimate(self, h_bar: Array) -> Array:
        """N_hat (m,) for a constant diagonal inertia ``h_bar`` (m,); valid until the next call."""
        time_delay_estimate(self.applied_force, h_bar, self.acceleration, self.n_hat)
        return self.n_hat


@kernel
def pair(
    force: Array, rate: Array, last_rate: Array, period: float, force_out: Array,
    acceleration: Array,
) -> None:  # fmt: skip
    """Keep the applied force and the backward difference of ``rate``."""
    for i in range(force.size):
        force_out[i] = force[i]
        acceleration[i] = (rate[i] - last_rate[i]) / period


@kernel
def time_delay_estimate(force: Array, h_bar: Array, acceleration: Array, n_hat: Array) -> None:
    """(36)."""
    for i in range(force.size):
        n_hat[i] = force[i] - h_bar[i] * acceleration[i]
