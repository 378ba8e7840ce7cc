"""Small motions of a robot under the linear part of a law, in discrete time.

Between two ticks the torque is held. With r and p the measured rates and positions in rho, w the
weight of the low-pass of the time-delay pair, H^ the inertia of the law's estimate, and b F the
force that is reported for a commanded force F, the inputs of the law (`linear_law`) are

    e = -p,  edot = -r,  rho = p,  rhodot = r,  F_applied = b F_k-1,
    N_hat_k = (1 - w) N_hat_k-1 + w (b F_k-1 - H^ (r_k - r_k-1) / period).

These motions have the states ``[x, law's states, F_k-1, N_hat_k-1, r_k-1]``, x those of the robot;
those that a law does not use are left out. Noise of the measured e and r, and of the r that the
pair takes, is an input.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from space_robot_model.elementary.matrices import Array

from .inertia import Posture
from .linear_law import LinearLaw

SLOWEST_GROWTH = 1e-6
"""Growth in a tick up to which a loop counts as stable: that of rounding errors."""
MOST_SCALE = 1.0
"""Largest margin in torque scale that is searched: a torque reported twice as large."""
MOST_ACTUAL = 100.0
"""Largest ratio of actual to commanded torque that is searched."""


class SmallMotion(NamedTuple):
    """Motions near a posture, with states ``[q, qdot]`` and forces in rho."""

    step: Array
    """(2k, 2k) state a period later, by the state."""
    by_force: Array
    """(2k, m) the same by a force that is held."""
    rate: Array
    """(m, k) rates in rho that encoders and gyro measure, by qdot."""
    posture: Posture
    """As a law with a model knows it."""


def rigid_motion(
    inertia: Array, posture: Posture, period: float, damping: Array | None = None
) -> SmallMotion:
    """Return the motions ``H rhodd + d rhod = F`` of a rigid robot, ``inertia`` H (m, m).

    ``damping``: d (m,), N m s/rad; None: none.
    """
    axes = len(inertia)
    one, none, compliance = np.eye(axes), np.zeros((axes, axes)), np.linalg.inv(inertia)
    if damping is not None:
        from scipy.linalg import expm  # slow to import

        rates: Any = [[none, one, none], [none, -compliance * damping, compliance], [none] * 3]
        whole = expm(period * np.block(rates))[: 2 * axes]
        return SmallMotion(whole[:, : 2 * axes], whole[:, 2 * axes :], one, posture)
    step = np.block([[one, period * one], [none, one]])
    by_force = np.vstack([0.5 * period**2 * compliance, period * compliance])
    return SmallMotion(step, by_force, one, posture)


class LinearLoop(NamedTuple):
    """Small motions of robot and law, with Z states and 3 m inputs: noise of e, r, and pair's r."""

    step: Array
    """(Z, Z) state a tick later, by the state."""
    by_noise: Array
    """(Z, 3 m) the same by noise."""
    force: Array
    """(m, Z) force of a tick, by the state."""
    force_by_noise: Array
    """(m, 3 m) the same by noise."""


def linear_loop(
    motion: SmallMotion,
    law: LinearLaw,
    weight: float,
    reported: float = 1.0,
    actual: float = 1.0,
    is_late: bool = False,
) -> LinearLoop:
    """Return the closed loop of a law.

    Args:
        motion: of the robot.
        law: in the same posture.
        weight: w of the low-pass of the time-delay pair; 1: none.
        reported: b, ratio of reported to commanded torque.
        actual: ratio of actual to commanded torque.
        is_late: whether a command acts, and is reported, a tick later.
    """
    rate = motion.rate
    axes, count = rate.shape
    has_estimate = law.estimate is not None and law.uses("n_hat")
    has_force = has_estimate or law.uses("applied_force") or is_late
    parts = _parts(
        {
            "robot": 2 * count,
            "law": len(law.step),
            "force": axes if has_force else 0,
            "late_force": axes if is_late else 0,
            "n_hat": axes if has_estimate else 0,
            "last_rate": axes if has_estimate else 0,
            "error_noise": axes,
            "rate_noise": axes,
            "pair_noise": axes,
        }
    )
    none = np.zeros((axes, count))
    e = parts["error_noise"] - np.hstack([rate, none]) @ parts["robot"]
    r = np.hstack([none, rate]) @ parts["robot"]
    noisy, pair_rate = r + parts["rate_noise"], r + parts["pair_noise"]
    signals = {"error": e, "error_rate": -noisy, "rho": -e, "rho_rate": noisy}
    applied = parts["late_force"] if is_late else parts["force"]
    if has_force:
        signals["applied_force"] = reported * applied
    if has_estimate:
        assert law.estimate is not None
        acceleration = (pair_rate - parts["last_rate"]) / law.period
        pair = reported * applied - law.estimate @ acceleration
        signals["n_hat"] = parts["n_hat"] + weight * (pair - parts["n_hat"])
    states, force = law.step @ parts["law"], law.force_by_state @ parts["law"]
    for name, value in signals.items():
        states = states + law.state_by[name] @ value
        force = force + law.force_by[name] @ value
    acting = parts["force"] if is_late else force
    rows = [motion.step @ parts["robot"] + actual * motion.by_force @ acting, states]
    if has_force:
        rows.append(force)
    if is_late:
        rows.append(parts["force"])
    if has_estimate:
        rows += [signals["n_hat"], pair_rate]
    whole, size = np.vstack(rows), force.shape[1] - 3 * axes
    return LinearLoop(whole[:, :size], whole[:, size:], force[:, :size], force[:, size:])


def growth(matrix: Array) -> float:
    """Return the largest absolute eigenvalue of a matrix."""
    return float(np.abs(np.linalg.eigvals(matrix)).max())


def bisect(low: float, high: float, holds: Callable[[float], bool], halvings: int = 14) -> float:
    """Return the largest number up to which something holds, between ``low`` and ``high``."""
    for _ in range(halvings):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if holds(middle) else (low, middle)
    return low


class RigidLoop:
    """A law on a rigid robot in some postures."""

    def __init__(
        self,
        inertia: Array,
        postures: Sequence[Posture],
        laws: Sequence[LinearLaw],
        weight: float,
        damping: Array | None = None,
    ) -> None:
        """Close the loop.

        Args:
            inertia: (K, m, m) of the actual robot.
            postures: (K,) of the nominal robot.
            laws: (K,) in these postures.
            weight: of the low-pass of the time-delay pair; 1: none.
            damping: see `rigid_motion`.
        """
        period = laws[0].period
        pairs = zip(inertia, postures, strict=True)
        motions = [rigid_motion(*pair, period, damping) for pair in pairs]
        self._parts = list(zip(motions, laws, strict=True))
        self._weight = weight

    def radius(self, reported: float = 1.0, actual: float = 1.0, is_late: bool = False) -> float:
        """Return the largest growth in a tick, with torque and delay as in `linear_loop`."""
        loops = (linear_loop(*p, self._weight, reported, actual, is_late) for p in self._parts)
        return max(growth(loop.step) for loop in loops)

    def is_stable(self, reported: float = 1.0, actual: float = 1.0) -> bool:
        """Return True if no small motion grows."""
        return all(self._is_stable(index, reported, actual) for index in range(len(self._parts)))

    def margin(self) -> float:
        """Return the share by which the reported torque may exceed the commanded one.

        At most `MOST_SCALE`; negative: ``1 - radius`` of a loop that is not stable.
        """
        return self._least(MOST_SCALE, lambda index, x: self._is_stable(index, 1.0 + x, 1.0))

    def largest_scale(self) -> float:
        """Return the largest stable ratio of actual to commanded torque, at most `MOST_ACTUAL`."""
        if not self.is_stable():
            return 0.0
        more = self._least(MOST_ACTUAL - 1.0, lambda index, x: self._is_stable(index, 1.0, 1.0 + x))
        return 1.0 + more

    def _least(self, most: float, is_stable: Callable[[int, float], bool]) -> float:
        """Return the smallest limit of all postures, at most ``most``."""
        limit = most
        for index in range(len(self._parts)):
            if is_stable(index, limit):
                continue
            if not is_stable(index, 0.0):
                return 1.0 - self.radius()
            limit = bisect(0.0, limit, partial(is_stable, index))
        return limit

    def _is_stable(self, index: int, reported: float, actual: float) -> bool:
        loop = linear_loop(*self._parts[index], self._weight, reported, actual)
        return growth(loop.step) <= 1.0 + SLOWEST_GROWTH


def _parts(sizes: dict[str, int]) -> dict[str, Array]:
    """Return for each part of a state the matrix (size, Z) that selects it."""
    whole, start, parts = np.eye(sum(sizes.values())), 0, {}
    for name, size in sizes.items():
        parts[name] = whole[start : start + size]
        start += size
    return parts
