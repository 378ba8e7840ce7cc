"""One step of classical Runge-Kutta under zero-order hold of the actuators."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.compiled.kernels import kernel
from space_robot_msgs_py.compiled.records import Record, nested, shaped

from ..dynamics.aba import aba
from ..dynamics.attitude import quaternion_rate, rotate, rotation_matrix
from ..dynamics.model import Data, Model
from ..environment.disturbance import disturbance_torque
from ..environment.environment import Environment
from ..environment.friction import friction_torque

Array = NDArray[np.float64]


class Stages(Record):
    """Scratch of the integrator.

    A state ``x`` (2n+13,) is ``[r0 (3), quaternion (4), theta (n), v0 (3), w0 (3), thetadot (n)]``,
    velocities on inertial axes.
    """

    stage: Array = shaped(lambda n: (2 * n + 13,))
    """State at which the current stage is evaluated."""
    slope: Array = shaped(lambda n: (4, 2 * n + 13))
    """Time derivatives."""
    end: Array = shaped(lambda n: (2 * n + 13,))
    """State at the end of a step."""
    force: Array = shaped(lambda n: (n + 6,))
    """Generalised force, base part on inertial axes."""
    disturbance: Array = shaped(lambda n: (n + 3,))
    """f_d of (61), N m."""
    friction: Array = shaped(lambda n: (n,))
    """f_f of each joint, N m."""
    directions: Array = shaped(lambda n: (n,))
    """The sense in which each joint slides over the step, see `friction_torque`."""
    held: Array = shaped(lambda n: (n,))
    """1 for joints that came back to rest within the step in which they broke away."""
    data: Data = nested(Data)
    """Its ``locked`` joints stand over the step."""


@kernel
def state_derivative(
    model: Model, environment: Environment, x: Array, torque: Array, disturbance: Array,
    stages: Stages, out: Array,
) -> None:  # fmt: skip
    """Write xdot (2n+13,) into ``out``: (27) with f0 = 0.

    Args:
        model: the plant's robot.
        environment: its friction.
        x: (2n+13,) the state, see `Stages`.
        torque: (n+3,) N m, on the base's axes, which turn with it, then on the joints.
        disturbance: (n+3,) f_d, N m, about inertial axes, then on the joints.
        stages: scratch; says which joints slide in which sense and which stand.
        out: (2n+13,).
    """
    n = model.mass.size - 1
    quaternion, theta = x[3:7], x[7 : 7 + n]
    v0, w0, joint_velocities = x[7 + n : 10 + n], x[10 + n : 13 + n], x[13 + n :]
    force, friction = stages.force, stages.friction
    rotation_matrix(quaternion, stages.data.rotation)
    rotate(stages.data.rotation, torque[:3], force[3:6])
    for k in range(3):
        force[k] = 0.0
        force[3 + k] -= disturbance[k]
    friction_torque(environment.friction, joint_velocities, stages.directions, friction)
    for i in range(n):
        force[6 + i] = torque[3 + i] - disturbance[3 + i] - friction[i]
    out[0:3] = v0
    quaternion_rate(quaternion, w0, out[3:7])
    out[7 : 7 + n] = joint_velocities
    aba(model, quaternion, theta, w0, joint_velocities, force, stages.data, out[7 + n :])


@kernel
def rk4_step(
    model: Model, environment: Environment, x: Array, torque: Array, time: float, period: float,
    stages: Stages,
) -> None:  # fmt: skip
    """Write into ``stages.end`` the state ``period`` s after ``x`` at ``time``; quaternion unit.

    ``torque`` (n+3,) N m is held, see `state_derivative`; ``stages.slope[0]`` is the derivative
    in ``x``.
    """
    size, end = x.size, stages.end
    slope, stage, disturbance = stages.slope, stages.stage, stages.disturbance
    for k in range(1, 4):
        step = period if k == 3 else 0.5 * period
        if k != 2:  # the two stages in the middle are at one time
            disturbance_torque(environment.disturbance, time + step, disturbance)
        for i in range(size):
            stage[i] = x[i] + step * slope[k - 1, i]
        state_derivative(model, environment, stage, torque, disturbance, stages, slope[k])
    for i in range(size):
        slopes = slope[0, i] + 2.0 * (slope[1, i] + slope[2, i]) + slope[3, i]
        end[i] = x[i] + period / 6.0 * slopes
    norm = np.sqrt(end[3] * end[3] + end[4] * end[4] + end[5] * end[5] + end[6] * end[6])
    for i in range(3, 7):
        end[i] /= norm
