"""A turning body, its star tracker and its gyro, in plain NumPy; and a filter fed with them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from oracles import skew
from scipy.integrate import solve_ivp
from scipy.linalg import expm, solve_discrete_are

from space_robot_control.navigation.attitude_filter import (
    AttitudeFilter,
    observe_tracker,
    propagate,
    start,
)
from space_robot_control.navigation.navigation import Navigation
from space_robot_control.navigation.settings import NavigationFilterSettings
from space_robot_model.elementary.matrices import Array
from space_robot_msgs_py.compiled.kernels import kernel

Rate = Callable[[float], Array]


class Case(NamedTuple):
    """Sensors, and the times at which they measure."""

    across: float = 5e-5
    about: float = 5e-5
    arw: float = 1e-6
    rrw: float = 1e-9
    bias: float = 1e-6
    period: float = 0.02
    interval: int = 5
    """Ticks between two measurements of the tracker."""
    delay: int = 0
    """Ticks from a measurement to its report."""

    @property
    def settings(self) -> NavigationFilterSettings:
        return NavigationFilterSettings(
            tracker_across=self.across,
            tracker_about=self.about,
            tracker_boresight=[0.0, 0.0, 1.0],
            joint_angle_noise=1e-7,
            joint_rate_noise=0.0,
            gyro_angle_walk=self.arw,
            gyro_rate_walk=self.rrw,
            gyro_bias=self.bias,
            tracker_delay=self.delay * self.period,
            rate_filter_hz=0.0,
            joint_bandwidth_hz=0.0,
        )

    def filter(self) -> AttitudeFilter:
        return Navigation.build(1, self.settings, self.period).attitude


def riccati(case: Case, omega: Array) -> Array:
    """(6, 6) covariance before an update, in steady state, of a body that turns at ``omega``."""
    continuous = np.zeros((6, 6))
    continuous[:3, :3], continuous[:3, 3:] = -skew(omega), -np.eye(3)
    density = np.diag([case.arw**2] * 3 + [case.rrw**2] * 3)
    dt = case.period * case.interval
    # Van Loan 1978
    both = expm(np.block([[-continuous, density], [np.zeros((6, 6)), continuous.T]]) * dt)
    transition = both[6:, 6:].T
    noise = transition @ both[:6, 6:]
    of_tracker = np.diag([case.across**2] * 2 + [case.about**2])
    scale = np.diag([1e5] * 3 + [1e8] * 3)  # rad and rad/s differ by far
    inverse = np.linalg.inv(scale)
    found = solve_discrete_are(
        (scale @ transition @ inverse).T,
        np.eye(6, 3),
        scale @ noise @ scale,
        scale[:3, :3] @ of_tracker @ scale[:3, :3],
    )
    covariance: Array = inverse @ found @ inverse
    return covariance


class Measured(NamedTuple):
    """What both report, (ticks, 4) and (ticks, 3), and the bias that nobody knows, (ticks, 3)."""

    quaternions: Array
    gyro: Array
    bias: Array


def product(left: Array, right: Array) -> Array:
    """Of quaternions (..., 4), w first."""
    (a, u), (b, v) = (np.split(q, [1], axis=-1) for q in np.broadcast_arrays(left, right))
    scalar = a * b - np.sum(u * v, axis=-1, keepdims=True)
    return np.concatenate([scalar, a * v + b * u + np.cross(u, v)], axis=-1)


def exponential(rotation: Array) -> Array:
    """The quaternions of rotation vectors (..., 3)."""
    half = 0.5 * np.linalg.norm(rotation, axis=-1, keepdims=True)
    return np.concatenate([np.cos(half), 0.5 * np.sinc(half / np.pi) * rotation], -1)


def attitude_error(estimate: Array, truth: Array) -> Array:
    """Rotation vector from the estimate to the truth, on the body's axes; small ones."""
    error = product(estimate * np.array([1.0, -1.0, -1.0, -1.0]), truth)
    result: Array = 2.0 * error[..., 1:] * np.sign(error[..., :1])
    return result


def turned_by(rate: Rate, ticks: int, period: float, start: Array | None = None) -> Array:
    """Attitudes (ticks, 4) of a body that turns at ``rate(t)`` on its own axes."""

    def derivative(t: float, q: Array) -> Array:
        return 0.5 * product(q, np.r_[0.0, rate(t)])

    first = np.array([1.0, 0.0, 0.0, 0.0]) if start is None else start
    times = period * np.arange(ticks)
    found = solve_ivp(
        derivative, (0.0, times[-1]), first, "DOP853", times, rtol=1e-12, atol=1e-13, max_step=1.0
    )
    attitudes: Array = (found.y / np.linalg.norm(found.y, axis=0)).T
    return attitudes


def measure(
    case: Case, attitudes: Array, rates: Array, rng: np.random.Generator, bias: Any = None
) -> Measured:
    """One draw of all noise; the bias begins at ``bias``, or anywhere within its deviation."""
    ticks, period = len(attitudes), case.period
    walk = case.rrw * np.sqrt(period) * rng.normal(size=(ticks, 3))
    walk[0] = case.bias * rng.normal(size=3) if bias is None else bias
    biases = walk.cumsum(0)
    white = np.sqrt(case.arw**2 / period + case.rrw**2 * period / 12.0)
    over = 0.5 * (biases + np.vstack([biases[:1], biases[:-1]]))  # mean of the tick before
    gyro = rates + over + white * rng.normal(size=(ticks, 3))
    noise = rng.normal(size=(ticks, 3)) * np.array([case.across, case.across, case.about])
    seen = product(attitudes, exponential(noise))
    taken = (np.arange(ticks) - case.delay) // case.interval * case.interval
    return Measured(seen[np.maximum(taken, 0)], gyro, biases)


class Estimated(NamedTuple):
    """What a filter knew at the end of each tick."""

    delayed: Array
    """(ticks, 4) attitude at k - D."""
    present: Array
    """(ticks, 4) attitude at k."""
    bias: Array
    """(ticks, 3)."""
    covariance: Array
    """(ticks, 6, 6) of the delayed attitude and the bias."""


def filtered(case: Case, measured: Measured, filter: AttitudeFilter | None = None) -> Estimated:
    """Run a filter over all ticks."""
    shapes = ((4,), (4,), (3,), (6, 6))
    out = Estimated(*(np.empty((len(measured.gyro), *shape)) for shape in shapes))
    run(filter or case.filter(), measured.quaternions, measured.gyro, case.period, *out)
    return out


@kernel
def run(
    filter: AttitudeFilter,
    quaternions: Array,
    gyro: Array,
    period: float,
    delayed: Array,
    present: Array,
    bias: Array,
    covariance: Array,
) -> None:
    for tick in range(gyro.shape[0]):
        if tick == 0:
            start(filter, 0, quaternions[0], gyro[0], period)
        else:
            propagate(filter, tick, gyro[tick], period)
            observe_tracker(filter, tick, quaternions[tick], True, period)
        delayed[tick] = filter.quaternion
        present[tick] = filter.present
        bias[tick] = filter.bias
        covariance[tick] = filter.covariance
