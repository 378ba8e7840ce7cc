"""Filters of rates: a low-pass of the base's, a Kalman filter of the joints' angles and rates.

The time-delay estimate differences a rate and takes the force that made it. So each filter passes
the torque through the same lag as the rate: lagging alike, the two stay a pair (see
`space_robot_control.controller.time_delay_estimation`).

The low-pass has two first-order stages in a row: one alone would leave the noise of a differenced
rate as it is in the highest frequencies.

The joints' filter is a steady-state Kalman filter of angle, rate and acceleration. The jerk is
taken for white noise (Singer's model without a time constant), angle and, if it is measured by
itself, rate are observed: with the angle alone this is the alpha-beta-gamma filter (Bar-Shalom, Li
& Kirubarajan, Estimation with Applications to Tracking and Navigation, 6.5). The ratio of jerk to
measurement noise is given as a bandwidth ``w``: with the continuous noise densities
``r = sigma^2 period``, the filter's poles are the stable roots of

    -s^6 + q (1/r_angle - s^2/r_rate) = 0,     q = w^6 / (1/r_angle + w^2/r_rate),

which with the angle alone are a Butterworth filter's of third order, with the rate alone one's of
second.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from space_robot_model.elementary.functions import exp
from space_robot_msgs_py.compiled.kernels import kernel, subroutine
from space_robot_msgs_py.compiled.lanes import uniform, where
from space_robot_msgs_py.compiled.records import Record, shaped

Array = NDArray[np.float64]

MOST_STEPS = 1_000_000
"""Steps of the Riccati equation; 500 s at 2 kHz."""


def low_pass_weight(corner_hz: float, period: float) -> float:
    """Return the weight of a new sample in a first-order low-pass; 0 without one."""
    return 1.0 - exp(-2.0 * math.pi * corner_hz * period)


class LowPass(Record):
    """Both stages of rate and torque of three axes."""

    weight: float = shaped(lambda n: ())
    """Of a new sample in each stage, see `low_pass_weight`; 0: no low-pass."""
    rate_stage: Array = shaped(lambda n: (3,))
    rate: Array = shaped(lambda n: (3,), "rad/s")
    torque_stage: Array = shaped(lambda n: (3,))
    torque: Array = shaped(lambda n: (3,), "N m")


@kernel
def begin_low_pass(low_pass: LowPass, rate: Array, torque: Array) -> None:
    """Begin in steady state at these values."""
    low_pass.rate_stage[:] = low_pass.rate[:] = rate
    low_pass.torque_stage[:] = low_pass.torque[:] = torque[:3]


@kernel
def pass_low(low_pass: LowPass, rate: Array, torque: Array) -> None:
    """Filter rate and torque (at least 3,) of one tick."""
    weight = where(low_pass.weight > 0.0, low_pass.weight, 1.0)
    for i in range(3):
        low_pass.rate_stage[i] = _stepped(low_pass.rate_stage[i], rate[i], weight)
        low_pass.rate[i] = _stepped(low_pass.rate[i], low_pass.rate_stage[i], weight)
        low_pass.torque_stage[i] = _stepped(low_pass.torque_stage[i], torque[i], weight)
        low_pass.torque[i] = _stepped(low_pass.torque[i], low_pass.torque_stage[i], weight)


@subroutine
def _stepped(last: float, now: float, weight: float) -> float:
    """Return a stage's next value; with a weight of 1 the new sample itself."""
    return where(weight == 1.0, now, last + weight * (now - last))


class JointFilter(Record):
    """Gains of the filter, the same for all joints, and the state of each joint."""

    is_on: float = shaped(lambda n: (), uniform=True)
    """0: angles and rates are handed on as they are measured."""
    angle_gain: Array = shaped(lambda n: (3,))
    """Of an angle's innovation on angle, rate and acceleration: 1, 1/s, 1/s2."""
    rate_gain: Array = shaped(lambda n: (3,))
    """Of a rate's innovation, taken after the angle's: s, 1, 1/s; zero if there is none."""
    angle: Array = shaped(lambda n: (n,), "rad")
    rate: Array = shaped(lambda n: (n,), "rad/s")
    acceleration: Array = shaped(lambda n: (n,), "rad/s2")
    angle_lag: Array = shaped(lambda n: (n,))
    """Lag of the angle of the same filter on a unit inertia that the torque accelerates, rad."""
    rate_lag: Array = shaped(lambda n: (n,), "Lag of that filter's rate, rad/s")
    torque_assumed: Array = shaped(lambda n: (n,))
    """Acceleration that this filter estimates of the unit inertia: N m."""
    torque: Array = shaped(lambda n: (n,), "The torque that lags as the rate does, N m")


def jerk_density(bandwidth: float, angle_noise: float, rate_noise: float, period: float) -> float:
    """Return q, rad2/s5, for a bandwidth, rad/s; noises: standard deviations (rate 0: none)."""
    of_angle = 1.0 / (angle_noise * angle_noise * period)
    of_rate = 1.0 / (rate_noise * rate_noise * period) if rate_noise > 0.0 else 0.0
    # q = w^6 / (1/r_angle + w^2/r_rate)
    square = bandwidth * bandwidth
    return square * square * square / (of_angle + square * of_rate)


def tune(
    filter: JointFilter, bandwidth_hz: float, angle_noise: float, rate_noise: float, period: float
) -> None:
    """Write the gains of the steady state into ``filter``, or turn it off (bandwidth 0)."""
    filter.is_on = 1.0 if bandwidth_hz > 0.0 else 0.0
    if not filter.is_on:
        return
    bandwidth = 2.0 * math.pi * bandwidth_hz
    density = jerk_density(bandwidth, angle_noise, rate_noise, period)
    # beside the bandwidth there is the pole at which an angle corrects an integrated rate
    slowest = min(bandwidth, rate_noise / angle_noise) if rate_noise > 0.0 else bandwidth
    least = 40.0 / MOST_STEPS  # of a smaller pole the quotient may overflow
    steps = min(MOST_STEPS, math.ceil(40.0 / min(1.0, max(least, slowest * period))))
    steady_gains(
        filter.angle_gain,
        filter.rate_gain,
        angle_noise * angle_noise,
        rate_noise * rate_noise,
        density,
        period,
        steps,
    )


@kernel
def steady_gains(
    angle_gain: Array,
    rate_gain: Array,
    angle_variance: float,
    rate_variance: float,
    density: float,
    period: float,
    steps: int,
) -> Array:
    """Step the Riccati equation until it has settled; write the gains.

    Returns:
        (3, 3) covariance before an update.
    """
    # plain arithmetic: results of library solvers differ between machines
    t, p = period, np.zeros((3, 3))
    noise, transition = np.zeros((3, 3)), np.eye(3)
    transition[0, 1], transition[1, 2], transition[0, 2] = t, t, 0.5 * t * t
    for i in range(3):
        for j in range(3):  # integral of the jerk's effect, t^(2-i)/(2-i)! on state i
            power = 5 - i - j
            factor = (1.0 if i > 0 else 2.0) * (1.0 if j > 0 else 2.0)
            noise[i, j] = density / (power * factor)
            for _ in range(power):
                noise[i, j] *= t
    p[:] = noise
    p[0, 0] += angle_variance
    before, moved = np.zeros((3, 3)), np.zeros((3, 3))
    for _ in range(steps):
        before[:] = p
        _gain(p, 0, angle_variance, angle_gain)
        if rate_variance > 0.0:
            _gain(p, 1, rate_variance, rate_gain)
        for i in range(3):
            for j in range(3):
                total = 0.0
                for k in range(i, 3):
                    total += transition[i, k] * p[k, j]
                moved[i, j] = total
        for i in range(3):
            for j in range(i, 3):
                total = noise[i, j]
                for k in range(j, 3):
                    total += moved[i, k] * transition[j, k]
                p[i, j] = total
                p[j, i] = total
    return before


@kernel
def _gain(p: Array, measured: int, variance: float, gain: Array) -> None:
    """Write the gain of a scalar measurement, and update ``p`` by Joseph's form."""
    for i in range(3):
        gain[i] = p[i, measured] / (p[measured, measured] + variance)
    row = p[measured].copy()
    for i in range(3):
        for j in range(i, 3):
            p[i, j] += (
                gain[i] * gain[j] * (row[measured] + variance) - gain[i] * row[j] - gain[j] * row[i]
            )
            p[j, i] = p[i, j]


@kernel
def begin_joints(filter: JointFilter, angle: Array, rate: Array, torque: Array) -> None:
    """Begin with the measured angles and rates (n,), and the torques (n,), as steady."""
    filter.angle[:] = angle
    filter.rate[:] = rate
    filter.acceleration[:] = 0.0
    filter.angle_lag[:] = 0.0
    filter.rate_lag[:] = 0.0
    filter.torque_assumed[:] = torque
    filter.torque[:] = torque


@kernel
def filter_joints(
    filter: JointFilter, angle: Array, rate: Array, torque: Array, duration: float
) -> None:
    """Go on by ``duration`` s to measured angles and rates (n,), under torques (n,) held till now.

    The torque passes through what the filter makes of an acceleration, so that torque and
    differenced rate stay a pair for the time-delay estimate.
    """
    if uniform(filter.is_on) == 0.0:
        begin_joints(filter, angle, rate, torque)
        return
    t, of_angle, of_rate = duration, filter.angle_gain, filter.rate_gain
    for i in range(filter.angle.size):
        a = filter.acceleration[i]
        x = filter.angle[i] + t * (filter.rate[i] + 0.5 * t * a)
        v = filter.rate[i] + t * a
        innovation = angle[i] - x
        x += of_angle[0] * innovation
        v += of_angle[1] * innovation
        a += of_angle[2] * innovation
        # the rate is taken after the angle: its noise is independent of the angle's
        innovation = rate[i] - v
        filter.angle[i] = x + of_rate[0] * innovation
        filter.rate[i] = v + of_rate[1] * innovation
        filter.acceleration[i] = a + of_rate[2] * innovation
        # the same for the torque, in its filter's errors, for its angle would grow without bound
        surprise = torque[i] - filter.torque_assumed[i]
        before = filter.rate_lag[i]
        x = filter.angle_lag[i] + t * (before + 0.5 * t * surprise)
        v = before + t * surprise
        a = filter.torque_assumed[i] + of_angle[2] * x
        v -= of_angle[1] * x
        x -= of_angle[0] * x
        filter.torque_assumed[i] = a + of_rate[2] * v
        filter.angle_lag[i] = x - of_rate[0] * v
        filter.rate_lag[i] = v - of_rate[1] * v
        filter.torque[i] = torque[i] - (filter.rate_lag[i] - before) / t
