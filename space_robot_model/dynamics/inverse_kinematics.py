"""Joint positions that bring a tool along a path while the base's attitude is led.

With zero momentum and a led attitude the tool's pose is a function of attitude and joints, so that
inverse kinematics is a problem of positions: Newton's method with the Jacobian ``J_held`` of
`.tool_kinematics`, from the solution at the point before. Where joints are more than the path
asks for, each step is the smallest one, or the one with the least angular momentum.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.compiled.kernels import kernel, subroutine

from ..elementary.least_squares import least_squares_into, weighted_least_squares_into
from .model import Model
from .tool_kinematics import ToolKinematics, tool_kinematics_into

Array = NDArray[np.float64]

MOST_STEPS = 50
TOLERANCE = 1e-12
"""Remaining error of a pose, m and rad."""


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
    """Write ``E + w H~^T H~``."""
    n = coupling.shape[1]
    for i in range(n):
        for j in range(n):
            total = 0.0
            for k in range(3):
                total += coupling[k, i] * coupling[k, j]
            out[i, j] = momentum_weight * total
        out[i, i] += 1.0
