"""Adaptive control with the nominal model's inertial parameters (Slotine & Li 1987)."""

from __future__ import annotations

import numpy as np

from space_robot_model.dynamics.algebra import (
    inverse_symmetric,
    scale,
    store,
    transform_symmetric,
    vector,
)
from space_robot_model.dynamics.attitude import rotate
from space_robot_model.dynamics.model import Model
from space_robot_model.dynamics.regressor import (
    MassCoordinates,
    Regressor,
    column,
    force_in_rho,
    force_on_vectors_into,
    mass_coordinates_into,
    motions_into,
    second_moments_into,
    take_rho,
    vectors_into,
)
from space_robot_model.elementary.linear_algebra import cholesky_into, move_to_side, normalise
from space_robot_msgs_py.compiled.kernels import kernel, subroutine
from space_robot_msgs_py.compiled.lanes import any_lane, uniform, where
from space_robot_msgs_py.compiled.records import nested, shaped

from .base import Array, CompiledLaw, Signals
from .friction import IntegralMemory, add_error, add_friction, friction_gains, integral_gain, plus
from .gains import LawGains, per_axis

SLOWEST_ADAPTATION = 1e-30
"""Smallest rate in 1/J that counts as such; 0 in ``gamma`` stands for it, and nothing adapts."""
LARGEST_SPREAD = 0.99
"""Larger values of ``spread`` count as this: the lightest robot has a mass."""


class Gains(LawGains):
    """Gains of the law; a body has those of its joint's axis, the base those of its first axis."""

    lambda_: Array = per_axis("slope of the sliding surface", "1/s", search=(0.1, 300.0))
    k_d: Array = per_axis("gain K_D of s", "N m s", search=(1e-2, 300.0), per_inertia=True)
    gamma: Array = per_axis("rate of adaptation", "1/J", search=(1e-2, 1e6))
    spread: Array = per_axis(
        "largest relative deviation of a body's mass and inertia", search=(0.0, 0.5), scale="linear"
    )
    k_i = integral_gain("1/s2", 1e4)
    viscous, coulomb, dead_band = friction_gains()


def _second_moments(description: str) -> Array:
    """Declare a matrix like the second moments D, see `space_robot_model.dynamics`."""
    matrix: Array = shaped(lambda n: (2 * n + 3, 2 * n + 3), description)
    return matrix


def _vectors(description: str) -> Array:
    """Declare a three-vector for each row of D, as a column."""
    vectors: Array = shaped(lambda n: (3, 2 * n + 3), description)
    return vectors


class Memory(IntegralMemory):
    """The integral, the estimate, what bounds it, and scratch."""

    v: Array = per_axis("reference velocity rhodot_d + lambda e", "rad/s (eps: 1/s)")
    base_rate: Array = shaped(lambda n: (3,), "v0 of a base that nothing turns, rad/s")
    is_ready: float = shaped(lambda n: (), "1 after the first tick")
    gamma: Array = per_axis("the gain of the last tick", "1/J")
    spread: Array = per_axis("the gain of the last tick")
    estimate: Array = _second_moments("estimated D")
    lower: Array = _second_moments("D of the lightest robot")
    upper: Array = _second_moments("D of the heaviest robot")
    metric: Array = _second_moments("B: the adaptation is B (gradient) B")
    root: Array = _second_moments("Cholesky's factor of B")
    width: float = shaped(lambda n: (), "distance from the lightest to the heaviest robot")
    factor: Array = shaped(lambda n: (n + 1,), "factor of each body")
    coordinates: MassCoordinates = nested(MassCoordinates)
    regressor: Regressor = nested(Regressor)
    forces: Array = _vectors("on the vectors of the regressor")
    metric_s: Array = _vectors("B J s, and scratch")
    metric_a: Array = _vectors("B (J vdot + Jdot v)")
    work: Array = _second_moments("scratch")
    axes: Array = _second_moments("scratch")


@kernel
def slotine_li(signals: Signals, gains: Gains, memory: Memory, period: float) -> None:
    """Compute one tick: s, v, force; then one step of the estimate."""
    e, edot, rate, work = signals.error, signals.error_rate, signals.rho_rate, memory.regressor
    s, u, v, force = memory.s, memory.u, memory.v, memory.force
    is_first = memory.is_ready == 0.0
    is_new = is_first
    for i in range(e.size):
        is_new = is_new | (memory.gamma[i] != gains.gamma[i])
        is_new = is_new | (memory.spread[i] != gains.spread[i])
    if any_lane(is_new):
        bound_estimate(signals.model, gains, memory)
    add_error(e, gains.k_i, signals.applied_force, force, memory.integral, period)
    for i in range(e.size):
        # v = rhodot_d + lambda e is s + rhodot; u is vdot; both with the integral
        s[i] = plus(edot[i] + gains.lambda_[i] * e[i], memory.integral[i])
        v[i] = s[i] + rate[i]
        u[i] = signals.acceleration_desired[i] + gains.lambda_[i] * edot[i]
        u[i] = plus(u[i], gains.k_i[i] * e[i])
    # F_S = Y pi + K_D s
    near, desired = signals.attitude_error, signals.reference
    vectors_into(signals.model, near, signals.joint_positions, work)
    if uniform(signals.base_is_free) == 0.0:
        take_rho(near, desired.omega_base, desired.alpha_base, rate, s, v, u, work)
        estimated_force(signals.model, memory)
        force_in_rho(work, force)
        for i in range(3):
            force[i] += gains.k_d[i] * s[i]
    else:
        let_base_float(signals, gains, memory, is_first, period)
    for i in range(3, e.size):
        force[i] += gains.k_d[i] * s[i]
    add_friction(gains.viscous, gains.coulomb, gains.dead_band, desired.joint_velocities, force)
    adapt(memory, period)


@kernel
def estimated_force(model: Model, memory: Memory) -> None:
    """Write the force ``Y pi`` for the motion in ``memory.regressor``."""
    motions_into(model, memory.regressor)
    multiply(memory.estimate, memory.regressor.acceleration, memory.forces)
    force_on_vectors_into(model, memory.forces, memory.regressor, memory.force)


@kernel
def let_base_float(
    signals: Signals, gains: Gains, memory: Memory, is_first: bool, period: float
) -> None:
    """Compute ``Y pi`` of the joints of a robot whose base nothing turns.

    The base's reference velocity v0 is not chosen but moves so that the base needs no torque:
    ``[Y(q, qdot, v, vdot) pi]_0 + K_0 (v0 - w0) = 0`` gives v0dot, for the estimated inertia of the
    whole robot is positive definite. Then all that is proven for m axes holds for s0 = v0 - w0,
    too. Of a small rotation eps is half, so K_0 is a quarter of the base's K_D.
    """
    work, base_rate, inertia = memory.regressor, memory.base_rate, memory.metric_s
    rotate(work.rotation, signals.omega_base, work.velocity[:3])
    for i in range(3):
        base_rate[i] = where(is_first, work.velocity[i], base_rate[i])
        work.s[i], work.v[i] = base_rate[i] - work.velocity[i], base_rate[i]
        work.v_rate[i] = 0.0
    for i in range(3, memory.s.size):
        work.velocity[i], work.s[i] = signals.rho_rate[i], memory.s[i]
        work.v[i], work.v_rate[i] = memory.v[i], memory.u[i]
    estimated_force(signals.model, memory)
    multiply(memory.estimate, work.vectors, inertia)
    # rotational inertia of the whole estimated robot, from its second moments
    xx = yy = zz = xy = xz = yz = 0.0
    for k in range(inertia.shape[1]):
        x, y, z = column(work.vectors, k)
        xx, yy, zz = xx + x * inertia[0, k], yy + y * inertia[1, k], zz + z * inertia[2, k]
        xy, xz, yz = xy + x * inertia[1, k], xz + x * inertia[2, k], yz + y * inertia[2, k]
    mobility = inverse_symmetric((yy + zz, xx + zz, xx + yy, -xy, -xz, -yz))
    for i in range(3):
        memory.force[i] += 0.25 * gains.k_d[i] * work.s[i]
    # v0dot by which the base's row of Y pi + K_0 s0 is zero
    acceleration = transform_symmetric(mobility, vector(memory.force, 0))
    store(scale(acceleration, -1.0), work.v_rate, 0)
    estimated_force(signals.model, memory)
    for i in range(3):
        base_rate[i] += period * work.v_rate[i]
        memory.force[i] = 0.0


@kernel
def bound_estimate(model: Model, gains: Gains, memory: Memory) -> None:
    """Compute what bounds the estimate; start at the nominal model if there is none yet."""
    for i in range(gains.gamma.size):
        memory.gamma[i], memory.spread[i] = gains.gamma[i], gains.spread[i]
    factor, coordinates = memory.factor, memory.coordinates
    mass_coordinates_into(model, coordinates)
    for i in range(factor.size):
        factor[i] = 1.0
    second_moments_into(model, coordinates, factor, memory.work)
    size, is_first = memory.work.shape[0], memory.is_ready == 0.0
    for k in range(size):
        for c in range(size):
            memory.estimate[k, c] = where(is_first, memory.work[k, c], memory.estimate[k, c])
    memory.is_ready = 1.0
    for i in range(factor.size):
        factor[i] = 1.0 - min(of_body(gains.spread, i), LARGEST_SPREAD)
    second_moments_into(model, coordinates, factor, memory.lower)
    for i in range(factor.size):
        factor[i] = 1.0 + min(of_body(gains.spread, i), LARGEST_SPREAD)
    second_moments_into(model, coordinates, factor, memory.upper)
    for i in range(factor.size):
        gamma = of_body(gains.gamma, i)
        factor[i] = np.sqrt(where(gamma > SLOWEST_ADAPTATION, gamma, SLOWEST_ADAPTATION))
    second_moments_into(model, coordinates, factor, memory.metric)
    cholesky_into(memory.metric, 0, memory.root)
    for k in range(size):
        for c in range(size):
            memory.work[k, c] = memory.upper[k, c] - memory.lower[k, c]
    normalise(memory.work, memory.root)
    memory.width = 0.0
    for k in range(size):
        memory.width += memory.work[k, k]


@subroutine
def of_body(gain: Array, i: int) -> float:
    """Return the value of a gain (m,) for body i, 0 being the base."""
    value: float = gain[0] if i == 0 else gain[2 + i]
    return value


@kernel
def adapt(memory: Memory, period: float) -> None:
    """Step the estimate by ``B Y^T s B``, and move it to where the bodies are physical.

    No step is longer than the set of physical estimates is wide: this concerns absurd s only.
    """
    s, a = memory.regressor.sliding, memory.regressor.acceleration
    metric_s, metric_a = memory.metric_s, memory.metric_a
    multiply(memory.metric, s, metric_s)
    multiply(memory.metric, a, metric_a)
    of_s, of_a = 0.0, 0.0
    for c in range(3):
        for k in range(s.shape[1]):
            of_s += s[c, k] * metric_s[c, k]
            of_a += a[c, k] * metric_a[c, k]
    # length of the step in the norm of Gamma^-1, at most (Schwarz)
    length = period * np.sqrt(abs(of_s)) * np.sqrt(abs(of_a))
    is_finite = np.isfinite(length)
    step = 0.5 * period * where(length > memory.width, memory.width / length, 1.0)
    for k in range(s.shape[1]):
        row = memory.estimate[k]
        sk = column(metric_s, k)
        ak = column(metric_a, k)
        for c in range(s.shape[1]):
            change = sk[0] * metric_a[0, c] + ak[0] * metric_s[0, c]
            change += sk[1] * metric_a[1, c] + ak[1] * metric_s[1, c]
            change += sk[2] * metric_a[2, c] + ak[2] * metric_s[2, c]
            row[c] = where(is_finite, row[c] + step * change, row[c])
    # projected onto what is lighter than the heaviest robot, then heavier than the lightest
    root, work, axes = memory.root, memory.work, memory.axes
    move_to_side(memory.estimate, memory.upper, -1.0, root, work, axes)
    move_to_side(memory.estimate, memory.lower, 1.0, root, work, axes)


@kernel
def multiply(matrix: Array, vectors: Array, out: Array) -> None:
    """Write ``vectors @ matrix`` into ``out`` (3, N), for a symmetric matrix (N, N)."""
    for c in range(3):
        total = out[c]
        for k in range(total.size):
            total[k] = 0.0
        for i in range(total.size):
            factor, row = vectors[c, i], matrix[i]
            for k in range(total.size):
                total[k] += factor * row[k]


class SlotineLi(CompiledLaw):
    """``F_S = Y(rho, rhodot, v, vdot) pi + K_D s``, ``pidot = Gamma Y^T s`` projected.

    ``s = edot + lambda e`` and ``v = rhodot_d + lambda e``. The parameters pi are the second
    moments D of `space_robot_model.dynamics.regressor`, in which the model of a free-floating
    robot is exactly linear; the standard parameters of its bodies are not such (Xu, Shum, Lee &
    Kanade, CMU-RI-TR-91-14, 1991). ``Gamma G = B G B``, with B the moments of the nominal robot
    with every body scaled by the root of its ``gamma``: for equal ``gamma``, ``gamma D0 G D0``.

    D stays between the moments of the robots whose bodies are all lighter and all heavier by
    ``spread``. This set is convex and has all robots whose bodies deviate by no more; all of it is
    positive definite, and so is H_S of every estimate. With a perfect plant
    ``s^T H_S s / 2 + |pi - pi*|^2 / 2``, in the norm of ``Gamma^-1``, falls by ``s^T K_D s``
    (Slotine & Li, Int. J. Robotics Research 6(3), 1987). The estimate starts at the nominal
    robot whenever the law takes over.

    With the gains of `friction` s and v have ``K_I (integral of e)`` as well, which leaves the
    proof as it is, and F_S the friction of the desired motion of the joints.
    """

    name = "slotine_li"
    gains_type, memory_type = Gains, Memory
    kernel = staticmethod(slotine_li)
