"""Joint positions that bring a tool along a path, with zero momentum.

While the base's attitude is led the tool's pose is a function of attitude and joints, so that
inverse kinematics is a problem of positions: Newton's method with the Jacobian ``J_held`` of
`.tool_kinematics`, from the solution at the point before. Where joints are more than the path
asks for, each step is the smallest one, or the one with the least angular momentum.

Without a torque on the base ``w0 = A(q0, theta) thetadot``, where A is `ToolKinematics.turn`. It
has no integral: the attitude at the end depends on the path of the joints (Vafa & Dubowsky 1990).
So attitude, and joints that lead a tool, are integrated by Runge and Kutta's method of fourth
order; joints by the generalised Jacobian, ``xdot = J_g thetadot``.
"""

from __future__ import annotations

import numpy as np

from space_robot_msgs_py.compiled.kernels import kernel, subroutine
from space_robot_msgs_py.compiled.records import Record, nested, shaped

from ..elementary.linear_algebra import least_squares_into, weighted_least_squares_into
from ..elementary.matrices import Array
from .attitude import quaternion_rate
from .model import Model
from .tool_kinematics import ToolKinematics, tool_kinematics_into

MOST_STEPS = 50
TOLERANCE = 1e-12
"""Remaining error of a pose, m and rad."""
GAIN = 50.0
"""Rate at which an error of the tool's pose is reduced, 1/s."""


@kernel
def rotation_error(wanted: Array, actual: Array, out: Array) -> None:
    """Write into ``out`` (3,) the vector part of the turn from ``actual`` to ``wanted``.

    It is ``sin(angle)`` about the turn's axis, on the outer axes; up to 90 degrees it grows with
    the angle.
    """
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        out[i] = 0.0
        for c in range(3):
            out[i] += 0.5 * (actual[j, c] * wanted[k, c] - actual[k, c] * wanted[j, c])


@kernel
def follow_path_into(
    model: Model,
    quaternions: Array,
    positions: Array,
    rotations: Array,
    from_base: bool,
    body: int,
    mounting: Array,
    point: Array,
    momentum_weight: float,
    start: Array,
    work: ToolKinematics,
    out: Array,
) -> int:
    """Fill ``out`` (K, N) with joint positions, until a pose cannot be reached.

    Args:
        model: the robot.
        quaternions: (K, 4) attitude of the base, unit.
        positions: (K, 3) of the tool on inertial axes, m.
        rotations: (K, 3, 3) of the tool; (0, 3, 3): its orientation is free.
        from_base: whether positions are from the base's centre of mass; else from the robot's.
        body: see `tool_kinematics_into`, as ``mounting`` and ``point``.
        mounting: rotation of the tool on the body.
        point: position of the tool on the body.
        momentum_weight: of the squared angular momentum beside that of the squared joint
            velocities, in the steps where joints are more than the path asks for, 1/(N m s)^2.
        start: (N,) joint positions near the first pose.
        work: scratch.
        out: solutions, in the order of ``model``.

    Returns:
        K, or the number of the first pose that was not reached; its row has the nearest posture.
    """
    rows = 6 if len(rotations) else 3
    error, scratch = np.zeros(rows), np.zeros((6, 7))
    n = len(start)
    step, posture, weight, scaled = np.zeros(n), start.copy(), np.zeros((n, n)), np.zeros((rows, n))
    for k in range(len(positions)):
        is_reached = False
        for _ in range(MOST_STEPS):
            tool_kinematics_into(model, quaternions[k], posture, body, mounting, point, work)
            for i in range(3):
                error[i] = positions[k, i] - work.position[i]
                if from_base:
                    error[i] -= work.centre_of_mass[i]
            if rows == 6:
                rotation_error(rotations[k], work.rotation, error[3:])
            largest = 0.0
            for i in range(rows):
                largest = max(largest, abs(error[i]))
            if largest <= TOLERANCE:
                is_reached = True
                break
            # v0 = 0 for positions from the base; P = 0 for those from the robot's centre of mass
            jacobian = work.joints if from_base else work.held
            if momentum_weight == 0.0:
                least_squares_into(jacobian[:rows], error, scratch, step)
            else:
                _momentum_metric(work.coupling, momentum_weight, weight)
                weighted_least_squares_into(jacobian[:rows], error, weight, scaled, scratch, step)
            for j in range(len(step)):
                posture[j] += step[j]
        out[k] = posture
        if not is_reached:
            return k
    return len(positions)


@subroutine
def _momentum_metric(coupling: Array, momentum_weight: float, out: Array) -> None:
    n = coupling.shape[1]
    for i in range(n):
        for j in range(n):
            total = 0.0
            for k in range(3):
                total += coupling[k, i] * coupling[k, j]
            out[i, j] = momentum_weight * total
        # W = E + weight A^T A, positive definite for any posture
        out[i, i] += 1.0


class FreeBase(Record):
    """Scratch of the integration for N joints."""

    joints: Array = shaped(lambda n: (n,))
    quaternion: Array = shaped(lambda n: (4,))
    rates: Array = shaped(lambda n: (4, n), "Joint velocities of the four stages")
    turns: Array = shaped(lambda n: (4, 4), "Rates of the quaternion of the four stages")
    omega: Array = shaped(lambda n: (3,))
    tool: ToolKinematics = nested(ToolKinematics)


@subroutine
def half_steps(stage: int) -> int:
    """Return how many half steps a stage of Runge and Kutta's method is ahead."""
    return (stage + 1) // 2


@kernel
def free_attitude_into(
    model: Model, positions: Array, rates: Array, spacing: float, work: FreeBase, out: Array
) -> None:
    """Fill ``out`` (K, 4) with the attitude of a free base during a motion of the joints.

    Args:
        model: the robot.
        positions: (2 K - 1, N) of the joints, at the K times and halfway between.
        rates: (2 K - 1, N) at the same times.
        spacing: of the K times, s.
        work: scratch.
        out: unit quaternions; the first row is given.
    """
    axes, origin = np.eye(3), np.zeros(3)
    for k in range(1, len(out)):
        for stage in range(4):
            row = 2 * (k - 1) + half_steps(stage)
            _begin_stage(stage, spacing, out[k - 1], work)
            tool_kinematics_into(model, work.quaternion, positions[row], 0, axes, origin, work.tool)
            for j in range(rates.shape[1]):
                work.rates[stage, j] = rates[row, j]
            _fill_attitude_rate(stage, work)
        _end_step(spacing, out[k - 1], out[k], work)


@kernel
def follow_free_path_into(
    model: Model,
    poses: Array,
    rotations: Array,
    twists: Array,
    spacing: float,
    body: int,
    mounting: Array,
    point: Array,
    work: FreeBase,
    joints: Array,
    attitudes: Array,
) -> float:
    """Fill the joint positions and attitudes with which a tool follows a path on a free base.

    Args:
        model: the robot.
        poses: (2 K - 1, 3) positions of the tool from the robot's centre of mass, inertial axes, m,
            at the K times and halfway between.
        rotations: (2 K - 1, 3, 3) of the tool; (0, 3, 3): its orientation is free.
        twists: (2 K - 1, 6) its velocity, m/s, and angular velocity, rad/s, inertial axes.
        spacing: of the K times, s.
        body: see `tool_kinematics_into`, as ``mounting`` and ``point``.
        mounting: rotation of the tool on the body.
        point: position of the tool on the body.
        work: scratch.
        joints: (K, N), in the order of ``model``; the first row is given.
        attitudes: (K, 4) unit quaternions; the first row is given.

    Returns:
        Largest error of a pose on the way, m or rad (of a sine); not a number where J_g is
        singular.
    """
    n, rows = joints.shape[1], 6 if len(rotations) else 3
    wanted, scratch, largest = np.zeros(rows), np.zeros((6, 7)), 0.0
    for k in range(1, len(joints)):
        for stage in range(4):
            row = 2 * (k - 1) + half_steps(stage)
            part = 0.5 * spacing * half_steps(stage)
            for j in range(n):
                work.joints[j] = joints[k - 1, j]
                if stage:
                    work.joints[j] += part * work.rates[stage - 1, j]
            _begin_stage(stage, spacing, attitudes[k - 1], work)
            tool = work.tool
            tool_kinematics_into(model, work.quaternion, work.joints, body, mounting, point, tool)
            for i in range(3):
                wanted[i] = poses[row, i] - tool.position[i]
            if rows == 6:
                rotation_error(rotations[row], tool.rotation, wanted[3:])
            for i in range(rows):
                # written so that NaN, of a singular J_g, counts as the largest
                if stage == 0 and not abs(wanted[i]) <= largest:
                    largest = abs(wanted[i])
                # the error is fed back, so that those of the steps do not add up
                wanted[i] = twists[row, i] + GAIN * wanted[i]
            least_squares_into(tool.free[:rows], wanted, scratch, work.rates[stage])
            _fill_attitude_rate(stage, work)
        for j in range(n):
            total = work.rates[0, j] + 2.0 * work.rates[1, j]
            total += 2.0 * work.rates[2, j] + work.rates[3, j]
            joints[k, j] = joints[k - 1, j] + spacing / 6.0 * total
        _end_step(spacing, attitudes[k - 1], attitudes[k], work)
    return largest


@subroutine
def _begin_stage(stage: int, spacing: float, before: Array, work: FreeBase) -> None:
    part = 0.5 * spacing * half_steps(stage)
    for i in range(4):
        work.quaternion[i] = before[i]
        if stage:
            work.quaternion[i] += part * work.turns[stage - 1, i]
    _normalise(work.quaternion)


@subroutine
def _fill_attitude_rate(stage: int, work: FreeBase) -> None:
    for i in range(3):
        work.omega[i] = 0.0
        for j in range(work.rates.shape[1]):
            work.omega[i] += work.tool.turn[i, j] * work.rates[stage, j]
    quaternion_rate(work.quaternion, work.omega, work.turns[stage])


@subroutine
def _end_step(spacing: float, before: Array, after: Array, work: FreeBase) -> None:
    for i in range(4):
        total = work.turns[0, i] + 2.0 * work.turns[1, i] + 2.0 * work.turns[2, i]
        after[i] = before[i] + spacing / 6.0 * (total + work.turns[3, i])
    _normalise(after)


@subroutine
def _normalise(quaternion: Array) -> None:
    total = 0.0
    for i in range(4):
        total += quaternion[i] * quaternion[i]
    length = np.sqrt(total)
    for i in range(4):
        quaternion[i] /= length
