"""One step of classical Runge-Kutta under zero-order hold of the actuators."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from space_robot_model.dynamics.aba import aba
from space_robot_model.dynamics.attitude import quaternion_rate, rotate
from space_robot_model.dynamics.kinematics import forward_kinematics, rotor_row, spatial_velocities
from space_robot_model.dynamics.model import MOST_JOINTS, MOST_MOVING, Data, Model
from space_robot_model.orbit.propagation import gravity
from space_robot_msgs_py.compiled.kernels import kernel, subroutine
from space_robot_msgs_py.compiled.lanes import uniform, whole
from space_robot_msgs_py.compiled.records import Record, nested, shaped
from space_robot_msgs_py.samples import MOST_WHEELS

from ..environment.disturbance import disturbance_torque
from ..environment.environment import Environment
from ..environment.friction import friction_torque
from ..environment.gravity_gradient import add_gravity_gradient
from ..environment.loads import add_loads
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
    The force and torque contain the user's own wrench, if there is one."""
    force: Array = shaped(lambda n: (6 + MOST_MOVING,))
    """Generalised force, base part on inertial axes."""
    of_field: Array = shaped(lambda n: (3,))
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
def disturb(environment: Environment, time: float, disturbance: Array, stages: Stages) -> None:
    """Write f_d at ``time`` (s); a user's wrench on the base is added to ``stages.actuation``."""
    disturbance_torque(environment.disturbance, time, disturbance)
    if uniform(environment.loads.is_on) != 0.0:
        add_loads(environment.loads, time, stages.actuation[:6], disturbance)


@kernel
def state_derivative(
    model: Model, environment: Environment, x: Array, disturbance: Array, stages: Stages, out: Array
) -> None:
    """Write xdot into ``out``: (27).

    Args:
        model: the plant's robot.
        environment: its friction.
        x: the state, see `Stages`.
        disturbance: (n+3,) f_d, N m, about inertial axes, then on the actuated joints.
        stages: ``actuation``, and which joints and wheels slide in which sense and which stand;
            scratch.
        out: as ``x``.
    """
    n, friction, data = whole(model.joint_count), environment.friction, stages.data
    quaternion, theta = x[3:7], x[7 : 7 + n]
    v0, w0, velocities = x[7 + n : 10 + n], x[10 + n : 13 + n], x[13 + n :]
    force, actuation, resisting = stages.force, stages.actuation, stages.friction
    forward_kinematics(model, quaternion, theta, data)
    spatial_velocities(model, w0, velocities, data)
    rotate(data.rotation, actuation[:3], force[:3])
    rotate(data.rotation, actuation[3:6], force[3:6])
    for k in range(3):
        force[3 + k] -= disturbance[k]
    friction_torque(friction, velocities, stages.directions, resisting)
    motors = first_motor_angle(model) - 1
    for i in range(n):
        j = whole(model.row[i])
        if i < whole(model.actuated_count) and uniform(model.rotor[j]) != 0.0:
            row, motor = rotor_row(model, j), motors + whole(model.rotor[j])
            of_gear = model.stiffness[j] * (x[motor] - theta[j])
            of_gear += model.damping[j] * (velocities[row] - velocities[j])
            force[6 + j] = of_gear - disturbance[3 + i]
            force[6 + row] = actuation[6 + i] - of_gear - resisting[row]
            out[motor] = velocities[row]
        elif i < whole(model.actuated_count):
            force[6 + j] = actuation[6 + i] - disturbance[3 + i] - resisting[j]
        else:
            spring = model.stiffness[j] * (theta[j] - model.rest[j])
            force[6 + j] = -spring - model.damping[j] * velocities[j] - resisting[j]
    for k in range(n, n + whole(model.wheel_count)):
        force[6 + k] = actuation[6 + k] - resisting[k]
    for k in range(3):
        out[k] = v0[k]
    if uniform(environment.orbit.is_on) != 0.0:
        _fall(model, environment, x, stages, out)
    quaternion_rate(quaternion, w0, out[3:7])
    for i in range(n):
        out[7 + i] = velocities[i]
    aba(model, w0, velocities, force, data, out[7 + n :])


@subroutine
def _fall(model: Model, environment: Environment, x: Array, stages: Stages, out: Array) -> None:
    """Add what acts in orbit to bias forces and force, and write the origin's rates."""
    orbit, at = environment.orbit, first_orbit_number(model)
    for k in range(3):
        out[at + k] = x[at + 3 + k]
    gravity(x[at : at + 3], orbit.has_j2, out[at + 3 : at + 6])
    if uniform(orbit.has_gradient) != 0.0:
        add_gravity_gradient(model, x[at : at + 3], x[:3], orbit.has_j2, stages.data)
    if uniform(environment.surfaces.count) > 0.0:
        add_surface_wrenches(environment.surfaces, model, stages.data)
    rotate(stages.data.rotation, orbit.magnetic_torque, stages.of_field)
    for k in range(3):
        stages.force[3 + k] += stages.of_field[k]


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
            disturb(environment, time + step, disturbance, stages)
        for i in range(size):
            stage[i] = x[i] + step * slope[k - 1, i]
        state_derivative(model, environment, stage, disturbance, stages, slope[k])
    for i in range(size):
        slopes = slope[0, i] + 2.0 * (slope[1, i] + slope[2, i]) + slope[3, i]
        end[i] = x[i] + period / 6.0 * slopes
    norm = np.sqrt(end[3] * end[3] + end[4] * end[4] + end[5] * end[5] + end[6] * end[6])
    for i in range(3, 7):
        end[i] /= norm
