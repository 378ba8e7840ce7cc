"""Integration of a step: classical Runge-Kutta under zero-order hold, slip and stick of friction.

Wheels are joints here. Within a step no friction changes its sense: a joint that slides keeps it,
one that stands is locked. Where a joint comes to rest the step is cut, at the root of its velocity;
there, and at the begin of every step, joints at rest may break away. The friction torques then
solve the box-constrained complementarity problem of the joints at rest:

    |f_i| <= f_C,   thetadd_i = 0 if |f_i| < f_C,   thetadd_i sign(f_i) >= 0 if |f_i| = f_C

which has one solution since ``H^-1`` is positive definite. It is computed by pivoting with
the least index first, which cannot cycle (Murty 1974; with two bounds Judice & Pires 1992). What is
at rest is known from the state alone: its velocity is zero to the last bit.

Friction that is not set-valued has no directions, so that no joint stands and no step is cut.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from space_robot_model.dynamics.aba import aba
from space_robot_model.dynamics.attitude import quaternion_rate, rotate
from space_robot_model.dynamics.kinematics import forward_kinematics, rotor_row, spatial_velocities
from space_robot_model.dynamics.model import MOST_JOINTS, MOST_MOVING, Data, Model
from space_robot_model.orbit.propagation import gravity
from space_robot_msgs_py.compiled.kernels import kernel, subroutine
from space_robot_msgs_py.compiled.lanes import any_lane, negated, uniform, where, whole
from space_robot_msgs_py.compiled.records import Record, nested, shaped
from space_robot_msgs_py.samples import MOST_WHEELS

from ..environment.disturbance import add_loads, disturbance_torque
from ..environment.environment import Environment
from ..environment.friction import friction_torque
from ..environment.gravity_gradient import add_gravity_gradient
from ..environment.surfaces import add_surface_wrenches

Array = NDArray[np.float64]


MOST_NUMBERS = 13 + 2 * MOST_JOINTS + MOST_WHEELS + 2 * MOST_JOINTS + 6
"""Numbers that a state has room for."""


class Stages(Record):
    """Scratch of the integrator.

    A state ``x`` is ``[r0 (3), quaternion (4), theta (N), v0 (3), w0 (3), thetadot (N), Omega (W),
    thetadot_m (G), theta_m (G), R (3), V (3)]``, velocities on inertial axes; ``Omega`` are those
    of the wheels against the base, ``theta_m`` the motor angles of the joints with gears, R and V
    position and velocity of the origin from the Earth's centre, in an orbit. Joints are in the
    order of `Model`; the rest is unused.
    """

    stage: Array = shaped(lambda n: (MOST_NUMBERS,))
    """State at which the current stage is evaluated."""
    slope: Array = shaped(lambda n: (4, MOST_NUMBERS))
    """Time derivatives."""
    end: Array = shaped(lambda n: (MOST_NUMBERS,))
    """State at the end of a step."""
    actuation: Array = shaped(lambda n: (6 + MOST_MOVING,))
    """What the actuators give over the step: force (N) and torque (N m) on the base's axes, which
    turn with it, torques on the joints, actuated ones first, then those of wheels' motors, N m.
    Force and torque include the user's own wrench."""
    force: Array = shaped(lambda n: (6 + MOST_MOVING,))
    """Generalised force, base part on inertial axes."""
    magnetic: Array = shaped(lambda n: (3,))
    """Torque of the magnetic field on the base, inertial axes, N m."""
    disturbance: Array = shaped(lambda n: (3 + MOST_JOINTS,))
    """f_d of (61) and of loads on joints, N m; none on passive joints."""
    friction: Array = shaped(lambda n: (MOST_MOVING,))
    """f_f of each joint, then of each wheel, then of each rotor seen through its gear, N m."""
    directions: Array = shaped(lambda n: (MOST_MOVING,))
    """The sense in which each of them slides over the step, see `friction_torque`."""
    held: Array = shaped(lambda n: (MOST_MOVING,))
    """1 for those that came back to rest within the step in which they broke away."""
    data: Data = nested(Data)
    """Its ``locked`` joints and wheels stand over the step."""


@subroutine
def first_velocity(model: Model) -> int:
    """Return where in a state the velocity of the first joint stands."""
    return 13 + whole(model.joint_count)


@subroutine
def first_motor_angle(model: Model) -> int:
    """Return where in a state the velocities end and the motor angles begin."""
    rotors = whole(model.rotor_count)
    return first_velocity(model) + whole(model.joint_count) + whole(model.wheel_count) + rotors


@subroutine
def first_orbit_number(model: Model) -> int:
    """Return where in a state the position of the origin in an orbit stands."""
    return first_motor_angle(model) + whole(model.rotor_count)


@subroutine
def state_size(model: Model, environment: Environment) -> int:
    """Return how many numbers a state of the robot has."""
    return first_orbit_number(model) + 6 * whole(environment.orbit.is_on)


@subroutine
def add_disturbances(
    environment: Environment, time: float, disturbance: Array, stages: Stages
) -> None:
    """Write f_d at ``time`` (s); a user's wrench on the base is added to ``stages.actuation``."""
    disturbance_torque(environment.disturbance, time, disturbance)
    if uniform(environment.loads.is_on) != 0.0:
        add_loads(environment.loads, time, stages.actuation[:6], disturbance)


@kernel
def state_derivative(
    model: Model, environment: Environment, x: Array, disturbance: Array, stages: Stages, out: Array
) -> None:
    """Write xdot of the state ``x`` (see `Stages`) into ``out``: (27).

    ``disturbance`` (n+3,) is f_d, N m, about inertial axes, then on the actuated joints. The stages
    have the actuation, and which joints and wheels slide in which sense and which stand.
    """
    n, friction, data = whole(model.joint_count), environment.friction, stages.data
    quaternion, theta = x[3:7], x[7 : 7 + n]
    v0, w0, velocities = x[7 + n : 10 + n], x[10 + n : 13 + n], x[13 + n :]
    force, actuation, opposing = stages.force, stages.actuation, stages.friction
    # (27) solved for the accelerations by `aba`: what drives is F - f_d - f_f
    forward_kinematics(model, quaternion, theta, data)
    spatial_velocities(model, w0, velocities, data)
    rotate(data.rotation, actuation[:3], force[:3])
    rotate(data.rotation, actuation[3:6], force[3:6])
    for k in range(3):
        force[3 + k] -= disturbance[k]
    friction_torque(friction, velocities, stages.directions, opposing)
    motors = first_motor_angle(model) - 1
    for i in range(n):
        j = whole(model.row[i])
        if i < whole(model.actuated_count) and uniform(model.rotor[j]) != 0.0:
            # a spring between link and rotor: drive and friction act on the rotor alone
            row, motor = rotor_row(model, j), motors + whole(model.rotor[j])
            spring = model.stiffness[j] * (x[motor] - theta[j])
            spring += model.damping[j] * (velocities[row] - velocities[j])
            force[6 + j] = spring - disturbance[3 + i]
            force[6 + row] = actuation[6 + i] - spring - opposing[row]
            out[motor] = velocities[row]
        elif i < whole(model.actuated_count):
            force[6 + j] = actuation[6 + i] - disturbance[3 + i] - opposing[j]
        else:
            spring = model.stiffness[j] * (theta[j] - model.rest[j])
            force[6 + j] = -spring - model.damping[j] * velocities[j] - opposing[j]
    for k in range(n, n + whole(model.wheel_count)):
        force[6 + k] = actuation[6 + k] - opposing[k]
    for k in range(3):
        out[k] = v0[k]
    if uniform(environment.orbit.is_on) != 0.0:
        _add_orbit(model, environment, x, stages, out)
    quaternion_rate(quaternion, w0, out[3:7])
    for i in range(n):
        out[7 + i] = velocities[i]
    aba(model, w0, velocities, force, data, out[7 + n :])


@subroutine
def _add_orbit(
    model: Model, environment: Environment, x: Array, stages: Stages, out: Array
) -> None:
    """Add what acts in orbit to bias forces and force, and write the origin's rates."""
    orbit, at = environment.orbit, first_orbit_number(model)
    for k in range(3):
        out[at + k] = x[at + 3 + k]
    gravity(x[at : at + 3], orbit.has_j2, out[at + 3 : at + 6])
    if uniform(orbit.has_gradient) != 0.0:
        add_gravity_gradient(model, x[at : at + 3], x[:3], orbit.has_j2, stages.data)
    if uniform(environment.surfaces.count) > 0.0:
        add_surface_wrenches(environment.surfaces, model, stages.data)
    rotate(stages.data.rotation, orbit.magnetic_torque, stages.magnetic)
    for k in range(3):
        stages.force[3 + k] += stages.magnetic[k]


@kernel
def rk4_step(
    model: Model, environment: Environment, x: Array, time: float, period: float, stages: Stages
) -> None:
    """Write into ``stages.end`` the state ``period`` s after ``x`` at ``time``; quaternion unit.

    ``stages.actuation`` is held; ``stages.slope[0]`` is the derivative in ``x``.
    """
    size, end = state_size(model, environment), stages.end
    slope, stage = stages.slope, stages.stage
    disturbance = stages.disturbance[: 3 + whole(model.actuated_count)]
    for k in range(1, 4):
        step = period if k == 3 else 0.5 * period
        if k != 2:  # the two stages in the middle are at one time
            add_disturbances(environment, time + step, disturbance, stages)
        for i in range(size):
            stage[i] = x[i] + step * slope[k - 1, i]
        state_derivative(model, environment, stage, disturbance, stages, slope[k])
    for i in range(size):
        slopes = slope[0, i] + 2.0 * (slope[1, i] + slope[2, i]) + slope[3, i]
        end[i] = x[i] + period / 6.0 * slopes
    # a step of Runge and Kutta's leaves the unit sphere by an error of fifth order
    norm = np.sqrt(end[3] * end[3] + end[4] * end[4] + end[5] * end[5] + end[6] * end[6])
    for i in range(3, 7):
        end[i] /= norm


MOST_CUTS = 32
"""Cuts of one step; joints of a real robot come to rest once or twice in it. Of a flight that
diverges, velocities may have several roots in a step, so that cuts would not end."""
MOST_PIVOTS = 64
MOST_TRIALS = 64
AT_REST = 1e-16
"""rad/s; a velocity that small where the step is cut is rounding."""
NO_JOINT = -1


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
        if joint == NO_JOINT:
            _accept(model, environment, stages, x)
            return
        velocity = first_velocity(model) + joint
        if x[velocity] == 0.0:  # broke away and came back
            stages.held[joint] = 1.0
            continue
        length = left
        for _ in range(MOST_CUTS):  # one that comes to rest still earlier is met on the way
            velocity = first_velocity(model) + joint
            length = find_stop(model, environment, x, time, length, velocity, stages)
            stages.end[velocity] = 0.0  # by this zero a joint at rest is known
            joint = first_at_rest(model, environment, x, stages)
            if joint == NO_JOINT:
                break
        _accept(model, environment, stages, x)
        stages.held[: whole(environment.friction.count)] = 0.0
        time += length
        left -= length
    slip_or_stick(model, environment, x, time, stages)
    rk4_step(model, environment, x, time, left, stages)
    _accept(model, environment, stages, x)


@subroutine
def _accept(model: Model, environment: Environment, stages: Stages, x: Array) -> None:
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
    add_disturbances(environment, time, disturbance, stages)
    for _ in range(MOST_PIVOTS):
        state_derivative(model, environment, x, disturbance, stages, derivative)
        # one joint a round, the first: pivoting with the least index cannot cycle
        changed = NO_JOINT
        for i in range(n):
            if x[first + i] != 0.0 or coulomb[i] * sticks == 0.0 or stages.held[i] != 0.0:
                continue
            if data.locked[i] != 0.0:
                if abs(data.holding[i]) > coulomb[i]:
                    data.locked[i], directions[i] = 0.0, np.sign(data.holding[i])
                    changed = i
            # it was let go, but would be pushed back: the friction holds it
            elif derivative[first + i] * directions[i] < 0.0:
                data.locked[i], directions[i] = 1.0, 0.0
                changed = i
            if changed != NO_JOINT:
                break
        if changed == NO_JOINT:
            return


@kernel
def regular_step(
    model: Model, environment: Environment, x: Array, time: float, period: float, stages: Stages
) -> bool:
    """Write into ``stages.end`` the state after ``x`` in lanes where no joint stops or breaks away.

    Returns:
        The mask of these lanes; the others are to be integrated by `integrate`, one by one.
    """
    directions, coulomb, end = stages.directions, environment.friction.coulomb, stages.end
    first, sticks = first_velocity(model), uniform(environment.friction.set_valued)
    locked, n = stages.data.locked, whole(environment.friction.count)
    for i in range(n):
        has_friction = coulomb[i] * sticks > 0.0
        directions[i] = where(has_friction, np.sign(x[first + i]), 0.0)
        locked[i] = where(has_friction & (x[first + i] == 0.0), 1.0, 0.0)
    disturbance = stages.disturbance[: 3 + whole(model.actuated_count)]
    add_disturbances(environment, time, disturbance, stages)
    state_derivative(model, environment, x, disturbance, stages, stages.slope[0])
    # a standing joint whose holding torque exceeds f_C breaks away
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
    """Return the joint that came to rest first between ``x`` and ``stages.end``, or `NO_JOINT`."""
    directions, end = stages.directions, stages.end
    first, earliest, joint = first_velocity(model), 2.0, NO_JOINT
    for i in range(whole(environment.friction.count)):
        before, after = x[first + i], end[first + i]
        if after * directions[i] < 0.0:
            # by a straight line between the two; `find_stop` has the root
            share = before / (before - after)
            if share < earliest:
                earliest, joint = share, i
    return joint


@kernel
def find_stop(
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
            # Illinois: an end that stays twice counts half, else the other would creep
            if side == -1:
                at_low *= 0.5
            side = -1
        else:
            low, at_low = length, rate
            if side == 1:
                at_high *= 0.5
            side = 1
    return length
