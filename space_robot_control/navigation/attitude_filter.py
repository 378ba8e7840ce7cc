"""Multiplicative extended Kalman filter of the base attitude from star tracker and gyro.

Its six states are the attitude's error, a small rotation on the base's axes, and the gyro's bias
(Lefferts, Markley & Shuster, J. Guidance 5, 1982; Crassidis & Junkins, Optimal Estimation of
Dynamic Systems, 7.2.1). The gyro stands in for dynamics: ``omega = gyro - bias - noise``.

A star tracker is late: what it reports at tick k was so at k - D. The filter therefore stands at
k - D and is fed with the gyro's samples of that time, which a ring has kept. The attitude of k is
the filter's, turned by the D increments since. That is exact: no measurement is moved in time, no
covariance is approximated. Whenever attitude or bias change, the increments are summed anew.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from space_robot_model.dynamics.algebra import (
    dot,
    inverse_symmetric,
    store,
    transform_symmetric,
    vector,
)
from space_robot_model.dynamics.attitude import (
    compose,
    from_small_rotation,
    is_same_attitude,
    to_small_rotation,
)
from space_robot_msgs_py.compiled.kernels import kernel
from space_robot_msgs_py.compiled.lanes import any_lane, negated, where, whole
from space_robot_msgs_py.compiled.records import Record, nested, shaped

Array = NDArray[np.float64]

RING = 4096
"""Samples of the gyro that are kept."""
LONGEST_DELAY = RING - 2
"""Ticks by which a tracker may be late."""
FASTEST = 1.0
"""No body turns by more in a tick, rad on an axis: a sample beyond is cut, so that a single
wrong one cannot take the filter out of all arithmetic."""
MOST_REJECTED = 5
"""Rejected measurements in a row after which the filter restarts."""

NOT_STARTED, STARTED, FILTERING = 0.0, 1.0, 2.0
"""The stages: nothing seen; begun with a measurement of unknown age; with one of known age."""


class Scratch(Record):
    """Quaternions and matrices of one call."""

    quaternion: Array = shaped(lambda n: (4,))
    present: Array = shaped(lambda n: (4,))
    rotation: Array = shaped(lambda n: (3,))
    transition: Array = shaped(lambda n: (3, 6), "Upper half of the transition matrix")
    upper: Array = shaped(lambda n: (3, 6))
    gain: Array = shaped(lambda n: (6, 3))
    weighted: Array = shaped(lambda n: (6, 3))
    remaining: Array = shaped(lambda n: (6, 6))


class AttitudeFilter(Record):
    """Settings and memory of the attitude filter."""

    noise: Array = shaped(lambda n: (3, 3))
    """Covariance of a tracker's measurement on the base's axes, rad2."""
    angle_walk: float = shaped(lambda n: (), "Square of the gyro's angle random walk, rad2/s")
    rate_walk: float = shaped(lambda n: (), "Square of its rate random walk, rad2/s3")
    initial_bias_variance: float = shaped(lambda n: (), "rad2/s2")
    gate: float = shaped(lambda n: ())
    """Square of the largest accepted innovation, in standard deviations."""
    delay: float = shaped(lambda n: (), "D, ticks", uniform=True)
    stage: float = shaped(lambda n: (), "`NOT_STARTED`, `STARTED` or `FILTERING`")
    reported: Array = shaped(lambda n: (4,))
    """The tracker's last measurement, which is held until the next."""
    quaternion: Array = shaped(lambda n: (4,))
    """Estimated attitude at k - D, from the base to the inertial frame."""
    bias: Array = shaped(lambda n: (3,), "Estimated bias of the gyro, rad/s")
    covariance: Array = shaped(lambda n: (6, 6))
    """Of the errors of attitude (base's axes, rad) and bias (rad/s) at k - D."""
    present: Array = shaped(lambda n: (4,), "Estimated attitude at k")
    innovation: Array = shaped(lambda n: (3,))
    """Of the last measurement: measured less estimated attitude on the base's axes, rad."""
    updates: float = shaped(lambda n: (), "Number of measurements used")
    rejected: float = shaped(lambda n: (), "Number of measurements rejected by the gate")
    rejected_in_a_row: float = shaped(lambda n: ())
    gyro: Array = shaped(lambda n: (RING, 3))
    """Samples of the last ticks, rad/s, by tick modulo `RING`."""
    scratch: Scratch = nested(Scratch)


@kernel
def start(filter: AttitudeFilter, tick: int, quaternion: Array, gyro: Array, period: float) -> None:
    """Begin at ``tick`` with what the tracker reports, which may be of any age.

    A bias known from before is kept, see `forget`. Before ``tick`` the gyro is taken to have
    measured what it measures now.
    """
    for past in range(whole(filter.delay) + 2):
        _store(filter, tick - past, gyro, period)
    forget(filter, filter.stage == NOT_STARTED)
    filter.stage = STARTED
    _restart(filter, tick, quaternion, period, True)


@kernel
def forget(filter: AttitudeFilter, is_forgotten: bool) -> None:
    """Reset the bias estimate to its initial variance, where ``is_forgotten``."""
    for i in range(3):
        filter.bias[i] = where(is_forgotten, 0.0, filter.bias[i])
    for i in range(6):
        for j in range(6):
            initial = filter.initial_bias_variance if i == j and i >= 3 else 0.0
            filter.covariance[i, j] = where(is_forgotten, initial, filter.covariance[i, j])


@kernel
def drift(filter: AttitudeFilter, duration: float) -> None:
    """Propagate the bias over ``duration`` s without gyro samples."""
    for i in range(3):
        filter.covariance[3 + i, 3 + i] += filter.rate_walk * duration


@kernel
def propagate(filter: AttitudeFilter, tick: int, gyro: Array, period: float) -> None:
    """Go from the last tick to ``tick``, at which the gyro reports ``gyro`` (3,) rad/s."""
    _store(filter, tick, gyro, period)
    # two attitudes, by one increment each: that of now, and that of k - D with the covariance
    delayed, scratch = tick - whole(filter.delay), filter.scratch
    _increment(filter, tick, period)
    compose(filter.present, scratch.quaternion, filter.present)
    _increment(filter, delayed, period)
    compose(filter.quaternion, scratch.quaternion, filter.quaternion)
    propagate_covariance(filter, period)


@kernel
def _store(filter: AttitudeFilter, tick: int, gyro: Array, period: float) -> None:
    for i in range(3):
        filter.gyro[tick % RING, i] = min(max(gyro[i], -FASTEST / period), FASTEST / period)


@kernel
def _increment(filter: AttitudeFilter, tick: int, period: float) -> None:
    """Write into the scratch by how much the base turned in the tick that ended at ``tick``.

    The trapezoid of two samples: its error is of third order in the tick.
    """
    last, now = filter.gyro[(tick - 1) % RING], filter.gyro[tick % RING]
    rotation = filter.scratch.rotation
    for i in range(3):
        rotation[i] = (0.5 * (last[i] + now[i]) - filter.bias[i]) * period
    from_small_rotation(rotation, filter.scratch.quaternion)


@kernel
def propagate_covariance(filter: AttitudeFilter, period: float) -> None:
    """Propagate the covariance over a tick in which the base turned by the scratch's rotation r.

    ``P := Phi P Phi^T + Q`` with ``Phi = [[A, B], [0, E]]``, ``A = exp(-[r x])`` and
    ``B = -integral of exp(-[r x] t/period)``, both to second order in r, and Farrenkopf's exact Q
    (J. Guidance 1, 1978) of white noise on rate and on bias.
    """
    p, scratch = filter.covariance, filter.scratch
    rotation, transition, upper = scratch.rotation, scratch.transition, scratch.upper
    x, y, z = rotation[0], rotation[1], rotation[2]
    square = x * x + y * y + z * z
    for i in range(3):
        for j in range(3):
            same = 1.0 if i == j else 0.0
            twice = rotation[i] * rotation[j] - same * square  # [r x]^2 = r r^T - r^2 E
            transition[i, j] = same + 0.5 * twice
            transition[i, 3 + j] = -period * (same + twice / 6.0)
    # -[r x] in A, and its integral in B
    for factor, first in ((1.0, 0), (-0.5 * period, 3)):
        transition[0, first + 1] += factor * z
        transition[0, first + 2] -= factor * y
        transition[1, first] -= factor * z
        transition[1, first + 2] += factor * x
        transition[2, first] += factor * y
        transition[2, first + 1] -= factor * x
    for i in range(3):
        for j in range(6):
            total = 0.0
            for k in range(6):
                total += transition[i, k] * p[k, j]
            upper[i, j] = total
    # Farrenkopf's Q: of the angle, between angle and bias, of the bias (below)
    angle = (filter.angle_walk + filter.rate_walk * period * period / 3.0) * period
    both = -0.5 * filter.rate_walk * period * period
    for i in range(3):
        for j in range(i, 3):
            total = angle if i == j else 0.0
            for k in range(6):
                total += upper[i, k] * transition[j, k]
            p[i, j] = total
            p[j, i] = total
        for j in range(3):
            p[i, 3 + j] = upper[i, 3 + j] + (both if i == j else 0.0)
            p[3 + j, i] = p[i, 3 + j]
        p[3 + i, 3 + i] += filter.rate_walk * period


@kernel
def observe_tracker(
    filter: AttitudeFilter, tick: int, quaternion: Array, is_timed: bool, period: float
) -> None:
    """Take what the tracker reports at ``tick``; a measurement only if it is not the last one.

    ``is_timed``: the tick before was seen as well, so a new measurement is D ticks old; else it
    may be older, and it is not used.
    """
    is_new = negated(is_same_attitude(quaternion, filter.reported))
    if not any_lane(is_new):
        return
    for i in range(4):
        filter.reported[i] = where(is_new, quaternion[i], filter.reported[i])
    if not is_timed:
        return
    # of known age: the filter begins anew from it
    is_first = is_new & (filter.stage == STARTED)
    filter.stage = where(is_first, FILTERING, filter.stage)
    is_next = is_new & negated(is_first)
    is_used = update(filter, quaternion, is_next)
    is_rejected = is_next & negated(is_used)
    filter.updates += where(is_used, 1.0, 0.0)
    filter.rejected += where(is_rejected, 1.0, 0.0)
    in_a_row = where(is_rejected, filter.rejected_in_a_row + 1.0, filter.rejected_in_a_row)
    filter.rejected_in_a_row = where(is_used, 0.0, in_a_row)
    is_lost = is_rejected & (filter.rejected_in_a_row >= MOST_REJECTED)
    if any_lane(is_lost):
        forget(filter, is_lost)
    if any_lane(is_first | is_lost):
        _restart(filter, tick, quaternion, period, is_first | is_lost)
    if any_lane(is_used):
        recompute(filter, tick, period, is_used)


@kernel
def update(filter: AttitudeFilter, quaternion: Array, is_asked: bool) -> bool:
    """Update attitude, bias and covariance (Joseph's form) with a measurement of tick k - D.

    Returns:
        Whether it was asked and is within the gate: where not, nothing was changed.
    """
    if not any_lane(is_asked):
        return is_asked
    p, noise, scratch = filter.covariance, filter.noise, filter.scratch
    gain, weighted, rest = scratch.gain, scratch.weighted, scratch.remaining
    # S^-1 of the innovation's covariance S = H P H^T + R
    cosine = to_small_rotation(filter.quaternion, quaternion, filter.innovation)
    inverse = inverse_symmetric(
        (
            p[0, 0] + noise[0, 0],
            p[1, 1] + noise[1, 1],
            p[2, 2] + noise[2, 2],
            p[0, 1] + noise[0, 1],
            p[0, 2] + noise[0, 2],
            p[1, 2] + noise[1, 2],
        )
    )
    xx, yy, zz, xy, xz, yz = inverse
    innovation = vector(filter.innovation, 0)
    a, b, c = innovation
    distance = xx * a * a + yy * b * b + zz * c * c + 2.0 * (xy * a * b + xz * a * c + yz * b * c)
    # Mahalanobis' distance; an innovation beyond 180 degrees is no small rotation
    is_within = (filter.gate <= 0.0) | ((cosine > 0.0) & (distance <= filter.gate))
    is_used: bool = is_asked & is_within
    if not any_lane(is_used):
        return is_used
    for i in range(6):  # K = P H^T S^-1, H = [E 0]; P, R and S are symmetric: rows are columns
        store(transform_symmetric(inverse, vector(p[i], 0)), gain[i], 0)
    for i in range(6):  # (E - K H) P
        for j in range(6):
            rest[i, j] = p[i, j] - dot(vector(gain[i], 0), vector(p[j], 0))
    for i in range(6):
        for j in range(3):
            weighted[i, j] = dot(vector(gain[i], 0), vector(noise[j], 0)) - rest[i, j]
    for i in range(6):  # (E - K H) P (E - K H)^T + K R K^T, symmetric
        for j in range(i, 6):
            updated = rest[i, j] + dot(vector(weighted[i], 0), vector(gain[j], 0))
            p[i, j] = where(is_used, updated, p[i, j])
            p[j, i] = p[i, j]
    for i in range(3):
        scratch.rotation[i] = dot(vector(gain[i], 0), innovation)
        error = dot(vector(gain[3 + i], 0), innovation)
        filter.bias[i] = where(is_used, filter.bias[i] + error, filter.bias[i])
    from_small_rotation(scratch.rotation, scratch.quaternion)
    compose(filter.quaternion, scratch.quaternion, scratch.quaternion)
    for i in range(4):
        filter.quaternion[i] = where(is_used, scratch.quaternion[i], filter.quaternion[i])
    return is_used


@kernel
def _restart(
    filter: AttitudeFilter, tick: int, quaternion: Array, period: float, is_asked: bool
) -> None:
    """Restart from a measurement of the attitude at k - D, keeping the bias, where asked."""
    for i in range(4):
        filter.reported[i] = where(is_asked, quaternion[i], filter.reported[i])
        filter.quaternion[i] = where(is_asked, quaternion[i], filter.quaternion[i])
    filter.rejected_in_a_row = where(is_asked, 0.0, filter.rejected_in_a_row)
    p = filter.covariance
    for i in range(3):
        for j in range(3):
            p[i, j] = where(is_asked, filter.noise[i, j], p[i, j])
            p[i, 3 + j] = where(is_asked, 0.0, p[i, 3 + j])
            p[3 + i, j] = where(is_asked, 0.0, p[3 + i, j])
    recompute(filter, tick, period, is_asked)


@kernel
def recompute(filter: AttitudeFilter, tick: int, period: float, is_asked: bool) -> None:
    """Turn the attitude of k - D by the increments since, with the bias as it is now."""
    scratch = filter.scratch
    scratch.present[:] = filter.quaternion
    for past in range(tick - whole(filter.delay) + 1, tick + 1):
        _increment(filter, past, period)
        compose(scratch.present, scratch.quaternion, scratch.present)
    for i in range(4):
        filter.present[i] = where(is_asked, scratch.present[i], filter.present[i])
