"""The recursive Newton-Euler algorithm, (11)-(20): bias force, and torque of a desired motion."""

from __future__ import annotations

from typing import Any

from numpy.typing import NDArray

from space_robot_msgs_py.compiled.kernels import kernel, subroutine
from space_robot_msgs_py.compiled.lanes import WIDTH, lane_of, uniform, whole
from space_robot_msgs_py.compiled.records import Record, nested, shaped
from space_robot_msgs_py.samples import Reference

from ..elementary.matrices import Array
from .algebra import (
    Vector,
    accumulate_wrench,
    add,
    collect_wrench,
    cross,
    dot,
    load_motion,
    scale,
    store,
    store_motion,
    symmetric,
    transform_symmetric,
    vector,
)
from .attitude import rotate, rotate_back
from .kinematics import forward_kinematics, spatial_velocities
from .model import Data, Model

Block = NDArray[Any]


class AlongScratch(Record):
    """Scratch of `inverse_dynamics_along`, in lanes."""

    reference: Reference = nested(Reference)
    data: Data = nested(Data)
    vectors: Array = shaped(lambda n: (2, 3))
    torque: Array = shaped(lambda n: (n + 3,))


@kernel
def rnea_bias(model: Model, data: Data, out: Array) -> None:
    """Write ``c = f_NE(qdd = 0)`` (N+6,) into ``out``.

    Call it after `forward_kinematics` and `spatial_velocities`. The outward recursion computes
    accelerations (13), (14), the inward one forces (17), (18), with the sign of the child's moment
    corrected, and (19). The base's part of c is in inertial axes, N and N m, about the base CoM.
    """
    angular = (0.0, 0.0, 0.0)
    linear = (0.0, 0.0, 0.0)
    if uniform(model.branches[0]) != 0.0:
        store_motion(angular, linear, data.outwards[0])
    for j in range(whole(model.joint_count)):
        i = j + 1
        if uniform(model.continues[j]) == 0.0:
            angular, linear = load_motion(data.outwards[whole(model.parent[j])])
        # (13), (14) with qdd = 0
        angular = add(angular, vector(data.coriolis[i], 0))
        linear = add(linear, vector(data.coriolis[i], 3))
        _add_force_of_body(model, i, angular, linear, data)
        if uniform(model.branches[i]) != 0.0:
            store_motion(angular, linear, data.outwards[i])
    # inwards: (17), (18)
    moment = (0.0, 0.0, 0.0)
    force = (0.0, 0.0, 0.0)
    for j in range(whole(model.joint_count) - 1, -1, -1):
        i = j + 1
        if uniform(model.branches[i]) != 0.0:
            moment, force = collect_wrench(data.inwards[i], moment, force)
        moment = add(moment, vector(data.bias[i], 0))
        force = add(force, vector(data.bias[i], 3))
        angular, linear = vector(data.motion[i], 0), vector(data.motion[i], 3)
        # (19); for a prismatic joint the product takes the force
        out[6 + j] = dot(angular, moment) + dot(linear, force)
        if uniform(model.continues[j]) == 0.0:
            accumulate_wrench(data.inwards[whole(model.parent[j])], moment, force)
            moment = force = (0.0, 0.0, 0.0)
    if uniform(model.branches[0]) != 0.0:
        moment, force = collect_wrench(data.inwards[0], moment, force)
    store(add(force, vector(data.bias[0], 3)), out, 0)
    store(add(moment, vector(data.bias[0], 0)), out, 3)


@kernel
def inverse_dynamics_along(
    model: Model, references: Array, scratch: Block, numbers: Array, out: Array
) -> None:
    """Write the torque for each of N references into ``out`` (N, n+3), N m.

    Eight of them are computed at once.

    Args:
        model: the robot.
        references: (N, numbers) of a `Reference` each, with unit quaternions.
        scratch: (1,) block of `AlongScratch` in lanes.
        numbers: (numbers, 8), the memory of its ``reference``.
        out: in base axes, then the joints.
    """
    count, size = references.shape
    work = scratch[0]
    for first in range(0, count, WIDTH):
        for lane in range(WIDTH):
            # lanes beyond the last reference repeat it
            row = min(first + lane, count - 1)
            for i in range(size):
                numbers[i, lane] = references[row, i]
        inverse_dynamics(model, work.reference, work.data, work.vectors, work.torque)
        for i in range(out.shape[1]):
            torque = work.torque[i]
            for lane in range(min(WIDTH, count - first)):
                out[first + lane, i] = lane_of(torque, lane)


@kernel
def inverse_dynamics(
    model: Model, reference: Reference, data: Data, vectors: Array, out: Array
) -> None:
    """Write the torque of one reference, see `inverse_dynamics_along`, into ``out`` (n+3,).

    The base floats freely (``f0 = 0``), so its CoM accelerates with ``v0dot = -f / M``, where f is
    the force of (17) for ``v0dot = 0``.
    """
    forward_kinematics(model, reference.quaternion, reference.joint_positions, data)
    rotate(data.rotation, reference.omega_base, vectors[0])
    spatial_velocities(model, vectors[0], reference.joint_velocities, data)
    rotate(data.rotation, reference.alpha_base, vectors[1])
    angular = vector(vectors[1], 0)
    linear = (0.0, 0.0, 0.0)
    _add_force_of_body(model, 0, angular, linear, data)
    if uniform(model.branches[0]) != 0.0:
        store_motion(angular, linear, data.outwards[0])
    count = whole(model.joint_count)
    for j in range(count):
        if uniform(model.continues[j]) == 0.0:
            angular, linear = load_motion(data.outwards[whole(model.parent[j])])
        coriolis, motion = data.coriolis[j + 1], data.motion[j + 1]
        acceleration = reference.joint_accelerations[j]
        # (13), (14)
        angular = add(add(angular, vector(coriolis, 0)), scale(vector(motion, 0), acceleration))
        linear = add(add(linear, vector(coriolis, 3)), scale(vector(motion, 3), acceleration))
        _add_force_of_body(model, j + 1, angular, linear, data)
        if uniform(model.branches[j + 1]) != 0.0:
            store_motion(angular, linear, data.outwards[j + 1])
    # all forces sum to f0 = 0 of (29): the whole drifts with v0dot
    mass, force = model.mass[0], vector(data.bias[0], 3)
    for i in range(1, count + 1):
        mass, force = mass + model.mass[i], add(force, vector(data.bias[i], 3))
    drift = scale(force, -1.0 / mass)  # v0dot
    moment = force = (0.0, 0.0, 0.0)
    for j in range(count - 1, -1, -1):
        if uniform(model.branches[j + 1]) != 0.0:
            moment, force = collect_wrench(data.inwards[j + 1], moment, force)
        moment, force = _add_moved_body(model, j + 1, drift, moment, force, data)
        angular, linear = vector(data.motion[j + 1], 0), vector(data.motion[j + 1], 3)
        out[3 + j] = dot(angular, moment) + dot(linear, force)
        if uniform(model.continues[j]) == 0.0:
            accumulate_wrench(data.inwards[whole(model.parent[j])], moment, force)
            moment = force = (0.0, 0.0, 0.0)
    if uniform(model.branches[0]) != 0.0:
        moment, force = collect_wrench(data.inwards[0], moment, force)
    moment, force = _add_moved_body(model, 0, drift, moment, force, data)
    store(moment, vectors[0], 0)
    rotate_back(data.rotation, vectors[0], out[:3])


@subroutine
def _add_moved_body(
    model: Model, i: int, drift: Vector, moment: Vector, force: Vector, data: Data
) -> tuple[Vector, Vector]:
    moment = add(moment, vector(data.bias[i], 0))
    moment = add(moment, cross(vector(data.first_moment[i], 0), drift))
    return moment, add(force, add(vector(data.bias[i], 3), scale(drift, model.mass[i])))


@subroutine
def _add_force_of_body(model: Model, i: int, angular: Vector, linear: Vector, data: Data) -> None:
    first_moment = vector(data.first_moment[i], 0)
    force = add(scale(linear, model.mass[i]), cross(angular, first_moment))
    moment = add(
        transform_symmetric(symmetric(data.inertia[i]), angular), cross(first_moment, linear)
    )
    store(add(vector(data.bias[i], 0), moment), data.bias[i], 0)
    store(add(vector(data.bias[i], 3), force), data.bias[i], 3)
