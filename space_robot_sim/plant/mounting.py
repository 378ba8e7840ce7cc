"""Wheels and gears of a plant, put into its model, its friction and its state."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from space_robot_model.dynamics.model import Model
from space_robot_model.hardware.base_actuators import WheelSettings
from space_robot_model.robot import Robot
from space_robot_model.robot.gears import flexible_model, geared_joints
from space_robot_msgs_py.compiled.records import assign
from space_robot_msgs_py.config.settings import SHORTEST_PERIOD
from space_robot_msgs_py.errors import InputError

from ..environment.friction import Friction

Array = NDArray[np.float64]


def mount_wheels(
    wheels: WheelSettings, model: Model, friction: Friction, velocities: Array
) -> None:
    """Mount ``wheels`` on a plant's base, with friction, and their ``velocities`` at tick 0."""
    count = wheels.count
    assign(model, wheel_count=count)
    model.wheel_axis[:count] = wheels.unit_axes
    model.wheel_inertia[:count] = wheels.values("rotor_inertia")
    rows = slice(int(friction.count), int(friction.count) + count)
    assign(friction, count=rows.stop)
    friction.coulomb[rows] = wheels.values("coulomb")
    friction.viscous[rows] = wheels.values("viscous")
    velocities[:count] = wheels.values("initial_speed")


STABLE = 2.61
"""Largest product of step and eigenvalue at which Runge and Kutta's method of fourth order is
stable in the whole left half-plane: 2.78 on the real axis, 2.82 on the imaginary one, and least in
between, at a damping ratio of 0.53."""
MOST_SUBSTEPS = 1000
"""Largest number of substeps, as in the plant's settings."""


def mount_gears(robot: Robot, model: Model, friction: Friction, x: Array) -> None:
    """Mount the gears of ``robot`` after the wheels, with motors at rest where their joints are.

    Friction of a joint with a gear acts on the motor's side, seen through the gear. ``x`` is the
    state at tick 0, see `space_robot_sim.plant.integrator.Stages`.
    """
    joints, n = geared_joints(robot), robot.joint_count
    check_rotors(robot)
    first = n + int(model.wheel_count)
    assign(model, rotor_count=len(joints))
    assign(friction, count=first + len(joints))
    for k, joint in enumerate(joints):
        gear, row = robot.gears[joint], int(model.row[joint])
        assert gear
        model.rotor[row] = k + 1
        model.rotor_inertia[row], model.gear_ratio[row] = gear.rotor_inertia, gear.ratio
        model.stiffness[row], model.damping[row] = gear.stiffness, gear.damping
        # a gear's friction acts on its motor: it moves from the joint's row to the rotor's
        for coefficients in (friction.coulomb, friction.viscous):
            coefficients[first + k], coefficients[row] = coefficients[row], 0.0
        friction.row[joint] = first + k
        x[13 + n + first + len(joints) + k] = x[7 + row]


def check_rotors(robot: Robot) -> None:
    """Check that bodies have more inertia than the rotors that are part of them."""
    for body, name in enumerate(robot.body_names):
        carried = [
            (joint, gear)
            for joint, gear in enumerate(robot.gears)
            if gear and robot.parent[joint] == body
        ]
        # a body's sheet includes its rotors, the dynamics have them apart
        inertia = robot.inertia[body].copy()
        for joint, gear in carried:
            axis = robot.rotation[joint][:, 2]
            inertia -= gear.rotor_inertia * np.outer(axis, axis)
        least = float(np.linalg.eigvalsh(inertia)[0])
        if carried and not least > 0.0:
            names = ", ".join(robot.joint_names[joint] for joint, _ in carried)
            raise InputError(
                f"{robot.where}: drive.rotor_inertia of {names}: the inertia of {name!r} must be "
                "larger than that of the rotors on it, which are part of it: without them its "
                f"smallest principal moment is {least:g} kg m2"
            )


def measured_motors(robot: Robot) -> list[int]:
    """Return for each joint the number from 1 of the motor that its encoder measures; 0: none."""
    motors = {joint: k + 1 for k, joint in enumerate(geared_joints(robot))}
    return [
        motors[joint] if gear and gear.encoder == "motor" else 0
        for joint, gear in enumerate(robot.gears)
    ]


def check_springs(robot: Robot, joint_positions: Array, step: float, substeps: int) -> None:
    """Check that the integrator's steps of ``step`` s resolve the springs of the gears.

    ``joint_positions`` (N,) are those at tick 0; ``substeps`` make a tick.
    """
    joints = geared_joints(robot)
    fastest = flexible_model(robot, joint_positions).fastest
    if step * fastest < STABLE:
        return

    def alone(joint: int, damping: float) -> float:
        only = tuple(
            gear._replace(damping=damping * gear.damping) if gear and j == joint else None
            for j, gear in enumerate(robot.gears)
        )
        return flexible_model(replace(robot, gears=only), joint_positions).fastest

    joint = max(joints, key=lambda joint: alone(joint, 1.0))
    # without its damper the joint would be nearly as fast: then the spring is to blame
    key = "stiffness" if alone(joint, 0.0) > 0.8 * alone(joint, 1.0) else "damping"
    needed = math.ceil(step * substeps * fastest / STABLE * (1.0 + 1e-9))
    period = _rounded_down(substeps * STABLE / fastest * (1.0 - 1e-9))
    advice = [
        *([f"substeps: {needed}"] if needed <= MOST_SUBSTEPS else []),
        *([f"a period of {period:g} s"] if period >= SHORTEST_PERIOD else []),
    ]
    raise InputError(
        f"{robot.where}: drive.{key} of {robot.joint_names[joint]!r} is too large for steps of "
        f"{step:g} s: its fastest rate is {fastest:.4g} rad/s, and Runge and Kutta's method is "
        f"stable up to {STABLE:g} rad in a step; "
        f"{' or '.join(advice) or f'not even substeps: {MOST_SUBSTEPS}'} would do"
    )


def _rounded_down(value: float) -> float:
    """Return the largest number of three digits that is not above ``value``."""
    unit = 10.0 ** (math.floor(math.log10(value)) - 2)
    return math.floor(value / unit) * unit
