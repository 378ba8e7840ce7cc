"""The laws' equations in NumPy, over whole histories of random signals at once."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.signal import lfilter

from space_robot_control.laws import ControlLaw, Signals
from space_robot_model.elementary.matrices import Array
from space_robot_msgs_py.compiled.records import Block

Gains = dict[str, Array]

PERIOD = 5e-4
TICKS = 12


class History:
    """Random signals of ``TICKS`` ticks, (TICKS, m) each."""

    e: Array
    edot: Array
    rhodd_d: Array
    n_hat: Array
    bias: Array
    inertia: Array
    rho: Array
    rho_rate: Array
    applied: Array
    rates_d: Array

    def __init__(self, axes: int, seed: int) -> None:
        rng = np.random.default_rng(seed)
        shape = (TICKS, axes)
        self.e, self.edot, self.rhodd_d, self.n_hat, self.bias = rng.normal(size=(5, *shape))
        # errors of all sizes, some of them zero: sign, root and boundary layer matter there
        self.e *= 10.0 ** rng.uniform(-6.0, 0.0, shape)
        self.edot *= 10.0 ** rng.uniform(-6.0, 0.0, shape)
        nothing = rng.random(shape) < 0.1
        self.e[nothing] = self.edot[nothing] = 0.0
        root = rng.normal(size=(TICKS, axes, axes))
        self.inertia = root @ root.transpose(0, 2, 1) + np.eye(axes)
        self.rho, self.rho_rate, self.applied = rng.normal(size=(3, *shape))
        # of all sizes, some of them zero: inside the dead band and outside
        self.rates_d = rng.normal(size=shape) * 10.0 ** rng.uniform(-2.0, 2.0, shape)
        self.rates_d[rng.random(shape) < 0.1] = 0.0

    def block(self, k: int) -> Block:
        """The signals of a tick."""
        block = Signals.block(self.e.shape[1] - 3)
        signals = Signals.view(block)
        signals.error[:], signals.error_rate[:] = self.e[k], self.edot[k]
        signals.acceleration_desired[:], signals.n_hat[:] = self.rhodd_d[k], self.n_hat[k]
        signals.nominal.inertia[:], signals.nominal.bias[:] = self.inertia[k], self.bias[k]
        signals.rho[:], signals.rho_rate[:] = self.rho[k], self.rho_rate[k]
        signals.applied_force[:] = self.applied[k]
        signals.reference.joint_velocities[:] = self.rates_d[k, 3:]
        return block

    def at(self, k: int) -> Signals:
        """A view of them."""
        return Signals.view(self.block(k))

    def through_model(self, u: Array) -> Array:
        """H_S u at every tick."""
        result: Array = np.einsum("kij,kj->ki", self.inertia, u)
        return result


def sign_root(s: Array) -> Array:
    """|s|^1/2 sign(s)."""
    root: Array = np.sign(s) * np.abs(s) ** 0.5
    return root


def friction(h: History, g: Gains) -> Array:
    """The friction of the joints' desired motion; none on the base."""
    moves = np.abs(h.rates_d) > g["dead_band"]
    torque: Array = g["viscous"] * h.rates_d + g["coulomb"] * moves * np.sign(h.rates_d)
    torque[:, :3] = 0.0
    return torque


def with_integral(h: History, g: Gains, law: Callable[[Array], Array]) -> Array:
    """The forces of a law, of the integral of K_I e at every tick.

    Each integral depends on the last force: where less than half of it was applied, what would
    make it larger is not added.
    """
    integral, last = np.zeros_like(h.e), np.zeros_like(h.e[0])
    for k in range(TICKS):
        held = (np.abs(h.applied[k]) < 0.5 * np.abs(last)) & (last * h.e[k] > 0.0)
        integral[k:] += np.where(held, 0.0, PERIOD * g["k_i"] * h.e[k])
        last = law(integral)[k]
    return law(integral)


def pd_acceleration(h: History, g: Gains) -> Array:
    """u_PD of (31)."""
    return h.rhodd_d + g["k_d"] * h.edot + g["k_p"] * h.e


def ctc(h: History, g: Gains) -> Array:
    """(30), (31)."""
    known = h.bias + friction(h, g)
    return with_integral(h, g, lambda z: h.through_model(pd_acceleration(h, g) + z) + known)


def ctc_smc(h: History, g: Gains) -> Array:
    """(57), (58)."""
    u = h.rhodd_d + g["lambda"] * h.edot + g["k_i"] * h.e

    def law(integral: Array) -> Array:
        s = h.edot + g["lambda"] * h.e + integral
        sat = np.where(np.abs(s) > g["delta"], np.sign(s), s / g["delta"])
        return h.through_model(u) + h.bias + g["g"] * sat + friction(h, g)

    return with_integral(h, g, law)


def tde_smc(h: History, g: Gains) -> Array:
    """(59)."""
    s = h.edot + g["lambda"] * h.e
    return g["h_bar"] * (h.rhodd_d + g["lambda"] * h.edot) + h.n_hat + g["g"] * np.sign(s)


def tde_tsmc(h: History, g: Gains) -> Array:
    """(60); the integral of edd is edot - edot(0), the rest summed from the second tick on."""
    summed = np.cumsum((g["k_d"] * h.edot + g["k_p"] * h.e)[1:], axis=0) * PERIOD
    s = h.edot - h.edot[0] + np.vstack([np.zeros_like(h.e[:1]), summed])
    return g["h_bar"] * (pd_acceleration(h, g) + g["k_1"] * sign_root(s)) + h.n_hat


def tde_stc(h: History, g: Gains) -> Array:
    """(41), (42)."""
    s = h.edot + g["lambda"] * h.e
    integral = np.cumsum(g["k_2"] * np.sign(s), axis=0) * PERIOD
    u = h.rhodd_d + g["lambda"] * h.edot + g["k_1"] * sign_root(s) + integral
    return g["h_bar"] * u + h.n_hat


def pd(h: History, g: Gains) -> Array:
    """K_P e + K_D edot."""
    torque = g["k_p"] * h.e + g["k_d"] * h.edot
    return with_integral(h, g, lambda z: torque + z + friction(h, g))


def pd_feedforward(h: History, g: Gains) -> Array:
    """``F = H_S u + c_S`` solved for u of the joints and F of the base, with u of the base and F
    of the joints known; PD is added on the base."""
    torque = g["k_p"] * h.e + g["k_d"] * h.edot
    return with_integral(h, g, lambda z: with_compensation(h, torque + z) + friction(h, g))


def with_compensation(h: History, torque: Array) -> Array:
    """PD's torque, on the base with that of the motion which it causes of the joints."""
    force, axes = torque.copy(), h.e.shape[1]
    for k in range(TICKS):
        # unknowns: F_b, then u_q
        left = np.hstack([np.eye(axes)[:, :3], -h.inertia[k][:, 3:]])
        known = h.inertia[k][:, :3] @ h.rhodd_d[k, :3] + h.bias[k]
        right = known - np.concatenate([np.zeros(3), force[k, 3:]])
        force[k, :3] += np.linalg.solve(left, right)[:3]
    return force


def indi(h: History, g: Gains) -> Array:
    """(37) with H_S in place of h_bar."""
    return h.through_model(pd_acceleration(h, g)) + h.n_hat


def dob(h: History, g: Gains) -> Array:
    """The disturbance ``F_S - J rhodd`` through ``g / (s + g)``, s by backward differences."""
    rates = np.vstack([h.rho_rate[0] - PERIOD * h.rhodd_d[0], h.rho_rate])
    disturbance = h.applied - g["inertia"] * np.diff(rates, axis=0) / PERIOD
    estimate = np.empty_like(disturbance)
    for axis, bandwidth in enumerate(g["bandwidth"] * PERIOD):
        numerator, denominator = [bandwidth], [1.0 + bandwidth, -1.0]
        first = disturbance[0, axis]  # in the steady state of the first disturbance
        column, _ = lfilter(
            numerator, denominator, disturbance[:, axis], zi=[first / (1.0 + bandwidth)]
        )
        estimate[:, axis] = column
    return g["inertia"] * pd_acceleration(h, g) + estimate


STEP = np.array([[1.0, 1.0, 0.5], [0.0, 1.0, 1.0], [0.0, 0.0, 1.0]])
"""``[z_1, T z_2, T^2 z_3]`` from one tick to the next without a force."""
SEEN = np.array([1.0, 0.0, 0.0])


def current_estimator(beta: float) -> Array:
    """Ackermann's formula for an observer ``x = x_p + L (y - C x_p)``, ``x_p = A x``, whose error
    has all poles at ``beta``."""
    observability = np.array([SEEN @ np.linalg.matrix_power(STEP, k) for k in (1, 2, 3)])
    wanted = np.linalg.matrix_power(STEP - beta * np.eye(3), 3)
    gain: Array = wanted @ np.linalg.solve(observability, [0.0, 0.0, 1.0])
    return gain


def adrc(h: History, g: Gains) -> Array:
    """The extended state observer of each axis as a state space, and its control."""
    force = np.empty_like(h.e)
    for axis in range(h.e.shape[1]):
        inertia, omega_c = g["inertia"][axis], g["omega_c"][axis]
        gain = current_estimator(1.0 / (1.0 + g["omega_o"][axis] * PERIOD))
        desired = h.rhodd_d[:, axis]
        pushed = h.applied[:, axis] / inertia * PERIOD**2
        scale = np.array([1.0, PERIOD, PERIOD**2])
        x = scale * [h.rho[0, axis], h.rho_rate[0, axis], desired[0]] - [0, 0, pushed[0]]
        for k in range(TICKS):
            if k:
                x = STEP @ x + STEP[:, 2] * pushed[k] - [0, 0, pushed[k]]
                x = x + gain * (h.rho[k, axis] - SEEN @ x)
            z = x / scale
            rho_d = h.e[k, axis] + h.rho[k, axis]
            rate_d = h.edot[k, axis] + h.rho_rate[k, axis]
            u = desired[k] + omega_c**2 * (rho_d - z[0]) + 2.0 * omega_c * (rate_d - z[1])
            force[k, axis] = inertia * (u - z[2])
    return force


EQUATIONS: dict[str, Callable[[History, Gains], Array]] = {
    "ctc": ctc,
    "ctc_smc": ctc_smc,
    "tde_smc": tde_smc,
    "tde_tsmc": tde_tsmc,
    "tde_stc": tde_stc,
    "pd": pd,
    "pd_feedforward": pd_feedforward,
    "indi": indi,
    "dob": dob,
    "adrc": adrc,
}


def random_gains(law: type[ControlLaw], axes: int, seed: int) -> Gains:
    """Gains of a law; bandwidths of observers are far above those of control."""
    rng = np.random.default_rng(seed)
    gains = {name: rng.uniform(0.1, 5.0, axes) for name in law.gain_descriptions()}
    for name, scale in {"delta": 1e-2, "bandwidth": 1e3, "omega_o": 1e2}.items():
        if name in gains:
            gains[name] *= scale
    return gains


def forces(law: ControlLaw, history: History) -> Array:
    """The forces of a law over a history, (TICKS, m)."""
    return np.array([law.force(history.at(k)).copy() for k in range(TICKS)])
