"""Integration of joints with Coulomb friction: slip, stick, stop and breakaway.

Wheels are joints here. Within a step no friction changes its sign: a joint that slides keeps its
sense, one that stands is locked. Where a joint comes to rest the step is cut, at the root of its
velocity; there, and at the begin of every step, joints at rest may break away. The friction
torques then solve the box-constrained complementarity problem of the joints at rest:

    |f_i| <= f_C,   thetadd_i = 0 if |f_i| < f_C,   thetadd_i sign(f_i) >= 0 if |f_i| = f_C

which has one solution since ``H^-1`` is positive definite. It is computed by pivoting with
the least index first, which cannot cycle (Murty 1974; with two bounds Judice & Pires 1992). What is
at rest is known from the state alone: its velocity is zero to the last bit.

Friction that is not set-valued has no directions, so that no joint stands and no step is cut.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from space_robot_model.dynamics.model import Model
from space_robot_msgs_py.compiled.kernels import kernel, subroutine
from space_robot_msgs_py.compiled.lanes import any_lane, negated, uniform, where, whole

from ..environment.environment import Environment
from .integrator import Stages, disturb, first_velocity, rk4_step, state_derivative, state_size

Array = NDArray[np.float64]

MOST_CUTS = 32
"""Cuts of one step; joints of a real robot come to rest once or twice in it. Of a flight that
diverges, velocities may have several roots in a step, so that cuts would not end."""
MOST_PIVOTS = 64
MOST_TRIALS = 64
AT_REST = 1e-16
"""rad/s; a velocity that small where the step is cut is rounding."""
NONE = -1


@kernel
def integrate(
    model: Model, environment: Environment, x: Array, time: float, period: float, stages: Stages
) -> None:
    """Advance ``x`` in place from ``time`` by ``period``, s; ``stages.actuation`` is held."""
    left = period
    stages.held[: whole(environment.friction.count)] = 0.0
    for _ in range(MOST_CUTS):
        slip_or_stick(model, environment, x, time, stages)
        rk4_step(model, environment, x, time, left, stages)
        joint = first_at_rest(model, environment, x, stages)
        if joint == NONE:
            _take(model, environment, stages, x)
            return
        velocity = first_velocity(model) + joint
        if x[velocity] == 0.0:  # broke away and came back
            stages.held[joint] = 1.0
            continue
        length = left
        for _ in range(MOST_CUTS):  # one that comes to rest still earlier is met on the way
            velocity = first_velocity(model) + joint
            length = cut(model, environment, x, time, length, velocity, stages)
            stages.end[velocity] = 0.0
            joint = first_at_rest(model, environment, x, stages)
            if joint == NONE:
                break
        _take(model, environment, stages, x)
        stages.held[: whole(environment.friction.count)] = 0.0
        time += length
        left -= length
    slip_or_stick(model, environment, x, time, stages)
    rk4_step(model, environment, x, time, left, stages)
    _take(model, environment, stages, x)


@subroutine
def _take(model: Model, environment: Environment, stages: Stages, x: Array) -> None:
    for i in range(state_size(model, environment)):
        x[i] = stages.end[i]


@kernel
def slip_or_stick(
    model: Model, environment: Environment, x: Array, time: float, stages: Stages
) -> None:
    """Find which joints slide in which sense and which stand in ``x``, and its derivative.

    They are written into ``stages.directions``, ``stages.data.locked`` and ``stages.slope[0]``.
    """
    directions, data, coulomb = stages.directions, stages.data, environment.friction.coulomb
    n, derivative = whole(environment.friction.count), stages.slope[0]
    first, sticks = first_velocity(model), environment.friction.set_valued
    disturbance = stages.disturbance[: 3 + whole(model.actuated_count)]
    for i in range(n):
        directions[i] = sticks * np.sign(x[first + i]) if coulomb[i] > 0.0 else 0.0
        data.locked[i] = sticks if x[first + i] == 0.0 and coulomb[i] > 0.0 else 0.0
    disturb(environment, time, disturbance, stages)
    for _ in range(MOST_PIVOTS):
        state_derivative(model, environment, x, disturbance, stages, derivative)
        changed = NONE
        for i in range(n):
            if x[first + i] != 0.0 or coulomb[i] * sticks == 0.0 or stages.held[i] != 0.0:
                continue
            if data.locked[i] != 0.0:
                if abs(data.holding[i]) > coulomb[i]:
                    data.locked[i], directions[i] = 0.0, np.sign(data.holding[i])
                    changed = i
            elif derivative[first + i] * directions[i] < 0.0:
                data.locked[i], directions[i] = 1.0, 0.0
                changed = i
            if changed != NONE:
                break
        if changed == NONE:
            return


@kernel
def glide(
    model: Model, environment: Environment, x: Array, time: float, period: float, stages: Stages
) -> bool:
    """Write into ``stages.end`` the state after ``x`` if no joint stops or breaks away.

    In lanes, where those of the others must be found by `integrate`, flight by flight.

    Returns:
        In which lanes that is so.
    """
    directions, coulomb, end = stages.directions, environment.friction.coulomb, stages.end
    first, sticks = first_velocity(model), uniform(environment.friction.set_valued)
    locked, n = stages.data.locked, whole(environment.friction.count)
    for i in range(n):
        has_friction = coulomb[i] * sticks > 0.0
        directions[i] = where(has_friction, np.sign(x[first + i]), 0.0)
        locked[i] = where(has_friction & (x[first + i] == 0.0), 1.0, 0.0)
    disturbance = stages.disturbance[: 3 + whole(model.actuated_count)]
    disturb(environment, time, disturbance, stages)
    state_derivative(model, environment, x, disturbance, stages, stages.slope[0])
    goes_on = True
    for i in range(n):
        breaks_away = (locked[i] != 0.0) & (abs(stages.data.holding[i]) > coulomb[i])
        goes_on = goes_on & negated(breaks_away)
    if not any_lane(goes_on):
        return goes_on
    rk4_step(model, environment, x, time, period, stages)
    for i in range(n):
        goes_on = goes_on & negated(end[first + i] * directions[i] < 0.0)
    return goes_on


@kernel
def first_at_rest(model: Model, environment: Environment, x: Array, stages: Stages) -> int:
    """Return the joint that came to rest first between ``x`` and ``stages.end``, or `NONE`."""
    directions, end = stages.directions, stages.end
    first, earliest, joint = first_velocity(model), 2.0, NONE
    for i in range(whole(environment.friction.count)):
        before, after = x[first + i], end[first + i]
        if after * directions[i] < 0.0:
            share = before / (before - after)
            if share < earliest:
                earliest, joint = share, i
    return joint


@kernel
def cut(
    model: Model,
    environment: Environment,
    x: Array,
    time: float,
    length: float,
    velocity: int,
    stages: Stages,
) -> float:
    """Return the time after which ``x[velocity]`` is zero, s, and leave that state in the stages.

    It has changed its sign in ``stages.end``, ``length`` later. The root is computed by the
    Illinois variant of false position (Dowell & Jarratt 1971).
    """
    low, at_low = 0.0, x[velocity]
    high, at_high = length, stages.end[velocity]
    side = 0
    for _ in range(MOST_TRIALS):
        length = (low * at_high - high * at_low) / (at_high - at_low)
        rk4_step(model, environment, x, time, length, stages)
        rate = stages.end[velocity]
        if abs(rate) <= AT_REST or not low < length < high:
            break
        if rate * at_high > 0.0:
            high, at_high = length, rate
            if side == -1:
                at_low *= 0.5
            side = -1
        else:
            low, at_low = length, rate
            if side == 1:
                at_high *= 0.5
            side = 1
    return length
