"""Momentum and energy of robot and wheels by Pinocchio, from a state: what a flight must conserve.

Of a robot with passive joints kinetic and spring energy together are kept, but for what the dampers
take.
"""

from __future__ import annotations

import numpy as np
import pinocchio as pin
from strategies import State

from oracles import pinocchio_model, pinocchio_state, rotation_of, visited
from space_robot_model.elementary.matrices import Array
from space_robot_model.hardware.base_actuators import WheelSettings
from space_robot_model.robot import Robot
from space_robot_msgs_py.samples import RobotState

NO_WHEELS = WheelSettings()


def state_of(robot: Robot, state: RobotState) -> State:
    """Return all joints, those without motors behind; velocities on inertial axes."""
    passive = len(robot.passive_names)
    return State(
        np.array(state.quaternion),
        np.concatenate([state.joint_positions, state.passive_positions[:passive]]),
        np.array(state.base_velocity),
        rotation_of(state.quaternion).apply(state.omega_base),
        np.concatenate([state.joint_velocities, state.passive_velocities[:passive]]),
    )


def momentum(
    robot: Robot, state: RobotState, wheels: WheelSettings = NO_WHEELS
) -> tuple[Array, Array]:
    """Return linear (N s) and angular momentum (N m s) about the inertial origin, inertial axes."""
    model = pinocchio_model(robot)
    data, moving = model.createData(), visited(robot, state_of(robot, state))
    of_robot = pin.computeCentroidalMomentum(
        model, data, *pinocchio_state(moving, state.base_position)
    )
    spin = wheels.unit_axes.T @ wheels.spin_momenta(state.wheel_velocities[: wheels.count])
    angular = of_robot.angular + np.cross(data.com[0], of_robot.linear)
    return of_robot.linear.copy(), angular + rotation_of(state.quaternion).apply(spin)


def kinetic_energy(robot: Robot, state: RobotState, wheels: WheelSettings = NO_WHEELS) -> float:
    """Return the kinetic energy T of (4) and of the wheels' spin, J."""
    model, moving = pinocchio_model(robot), visited(robot, state_of(robot, state))
    of_robot = pin.computeKineticEnergy(model, model.createData(), *pinocchio_state(moving))
    speeds = state.wheel_velocities[: wheels.count]
    of_base = wheels.unit_axes @ state.omega_base
    return float(of_robot + wheels.spin_momenta(speeds) @ (of_base + 0.5 * speeds))
