"""Gears that are ever stiffer: a rigid joint that carries its rotor's inertia.

With theta_m = theta the robot has ``N^2 J`` more on the joint's own diagonal of its inertia matrix,
and ``N J z`` between the joint and all that turns its parent.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from geared_robots import PERIOD, GearedFlight, random_gears, with_gears
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from oracles import pinocchio_mass_matrix, rotation_of
from random_robots import State, random_quaternion, random_robot
from rotor_equations import RotorEquations
from rotor_oracles import gear_of, random_motor_rotors
from scipy.integrate import solve_ivp

from space_robot_model.robot import Robot
from space_robot_sim.plant.stick_slip import slip_or_stick

Array = NDArray[np.float64]


class RigidGears:
    """The equations of motion with every motor fast to its link, by ``[v0, w0, thetadot]``."""

    def __init__(self, equations: RotorEquations) -> None:
        self.equations, self.n = equations, equations.n
        self.followers = np.zeros((equations.size, 6 + self.n))
        """(N+6+G, N+6) all velocities by those of base and joints."""
        self.followers[: 6 + self.n] = np.eye(6 + self.n)
        for k, joint in enumerate(equations.joints):
            self.followers[6 + self.n + k, 6 + joint] = 1.0

    def acceleration(self, x: Array, force: Array) -> Array:
        """Return the acceleration (N+6+G,) of everything under a force (N+6+G,)."""
        z, equations = self.followers, self.equations
        mass, bias = equations.matrices(x[3:7], x[7 : 7 + self.n], equations.velocity(x))
        reduced: Array = np.linalg.solve(z.T @ mass @ z, z.T @ (force - bias))
        return z @ reduced

    def gear_torques(self, x: Array, force: Array) -> Array:
        """Return the torques (G,) of the gears on their links that hold the motors there."""
        equations = self.equations
        mass, bias = equations.matrices(x[3:7], x[7 : 7 + self.n], equations.velocity(x))
        needed = mass @ self.acceleration(x, force) + bias - force
        return -needed[6 + self.n :]


def thrown(robot: Robot, rng: np.random.Generator, substeps: int = 1) -> GearedFlight:
    """Return a flight whose base and joints move, each motor as its link."""
    attitude = random_quaternion(rng).tolist()
    flight = GearedFlight(robot, substeps, initial_quaternion=attitude)
    flight.positions[:] = rng.uniform(-1.0, 1.0, robot.n)
    flight.base_velocities[:] = 0.3 * rng.normal(size=6)
    flight.velocities[:] = rng.normal(size=robot.n)
    flight.motor_velocities[:] = flight.velocities[flight.joints]
    flight.motor_positions[:] = flight.positions[flight.joints]
    return flight


def generalised(flight: GearedFlight, torque: Array, quaternion: Array) -> Array:
    """Return the force (N+6+G,) of a torque (n+3,): that of a joint with a gear is on its motor."""
    n, force = flight.robot.n, np.zeros(6 + flight.robot.n + len(flight.joints))
    force[3:6] = rotation_of(quaternion).apply(torque[:3])
    force[6 : 6 + n] = torque[3:]
    force[6 + n :] = torque[3:][flight.joints]
    force[6:][flight.joints] = 0.0
    return force


def arm(seed: int, n: int) -> tuple[RotorEquations, np.random.Generator]:
    rng = np.random.default_rng(seed)
    robot = replace(random_robot(rng, n), is_prismatic=rng.random(n) < 0.3)
    robot = random_gears(rng, robot)
    return RotorEquations(robot, random_motor_rotors(rng, robot)), rng


@given(st.sampled_from([1, 2, 3, 6]), st.integers(0, 2**32 - 1))
@settings(max_examples=30)
def test_the_rotors_add_to_the_diagonal_and_between_joint_and_parent(n: int, seed: int) -> None:
    """``H + B`` on the joint's own diagonal, and ``N J z^T J_w``, of Pinocchio's H without gears.

    J_w, the Jacobian of the parent's turning, is measured on a robot whose joints turn alone.
    """
    equations, rng = arm(seed, n)
    robot = equations.robot
    state = State(random_quaternion(rng), rng.uniform(-3.0, 3.0, n), *np.zeros((2, 3)), np.zeros(n))
    expected = pinocchio_mass_matrix(robot, state)
    axes = [rotation_of(state.quaternion).as_matrix()]
    for j in range(n):
        turn = 0.0 if robot.is_prismatic[j] else state.theta[j]
        about = rotation_of([np.cos(0.5 * turn), 0.0, 0.0, np.sin(0.5 * turn)]).as_matrix()
        axes.append(axes[-1] @ robot.rotation[j] @ about)
    for joint in equations.joints:
        gear, z = gear_of(robot, joint), axes[joint + 1][:, 2]
        row = np.zeros(6 + n)
        row[3:6] = z
        for inner in range(joint):  # of a chain
            row[6 + inner] = 0.0 if robot.is_prismatic[inner] else z @ axes[inner + 1][:, 2]
        expected[6 + joint] += gear.ratio * gear.rotor_inertia * row
        expected[:, 6 + joint] += gear.ratio * gear.rotor_inertia * row
        expected[6 + joint, 6 + joint] += gear.ratio**2 * gear.rotor_inertia
    z = RigidGears(equations).followers
    mass, _ = equations.matrices(state.quaternion, state.theta, np.zeros(equations.size))
    np.testing.assert_allclose(
        z.T @ mass @ z, expected, rtol=0.0, atol=1e-12 * np.abs(expected).max()
    )


@given(st.sampled_from([1, 2, 3, 6]), st.integers(0, 2**32 - 1))
@settings(max_examples=40)
def test_a_motor_that_is_stretched_by_its_torque_accelerates_as_the_rigid_joint(
    n: int, seed: int
) -> None:
    """At a deflection of the gear's torque divided by K, whatever K, link and motor keep step.

    Of a soft spring, as K times the rounding of the deflection accelerates the lightest motors.
    """
    equations, rng = arm(seed, n)
    robot, rigid, stiffness = equations.robot, RigidGears(equations), 1.0
    gears = [gear and gear._replace(stiffness=stiffness, damping=0.0) for gear in robot.gears]
    flight = thrown(with_gears(robot, gears), rng)
    torque, memory = rng.normal(size=3 + n), flight.plant.memory
    force = generalised(flight, torque, flight.x[3:7])
    expected = rigid.acceleration(flight.x, force)
    flight.motor_positions[:] += rigid.gear_torques(flight.x, force) / stiffness
    memory.stages.actuation[3 : 6 + n] = torque
    slip_or_stick(memory.model, memory.environment, memory.x, 0.0, memory.stages)
    actual = memory.stages.slope[0, 7 + n : 7 + n + equations.size]
    np.testing.assert_allclose(actual, expected, rtol=0.0, atol=1e-11 * np.abs(expected).max())


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_flights_come_near_the_rigid_robots_as_gears_get_stiffer(seed: int) -> None:
    """As ``1/K``, as the static deflection at the end; what swings falls as ``K^-1.5``."""
    n, ticks = 2, 300
    rng = np.random.default_rng(seed)
    robot = random_robot(rng, n)
    while len([gear for gear in robot.gears if gear]) < n:
        robot = random_gears(rng, robot)
    robot = with_gears(robot, [g and g._replace(ratio=5.0, damping=0.0) for g in robot.gears])
    equations = RotorEquations(robot, random_motor_rotors(rng, robot))
    rigid, torque = RigidGears(equations), 20.0 * rng.normal(size=3 + n)
    posture = int(rng.integers(2**32))
    stiffnesses, distances = (4e4, 64e4), list[float]()
    for stiffness in stiffnesses:
        gears = [gear and gear._replace(stiffness=stiffness) for gear in robot.gears]
        flight = thrown(with_gears(robot, gears), np.random.default_rng(posture), 8)
        if not distances:
            end = _flown_rigidly(rigid, flight, torque, ticks)
        force = generalised(flight, torque, flight.x[3:7])
        flight.motor_positions[:] += rigid.gear_torques(flight.x, force) / stiffness
        flight.fly(torque, ticks)
        distances.append(float(np.linalg.norm(flight.x[: 7 + n] - end[: 7 + n])))
    order = -np.log(distances[1] / distances[0]) / np.log(stiffnesses[1] / stiffnesses[0])
    assert order == pytest.approx(1.0, abs=0.1)
    assert distances[1] < 1e-4
    at_the_end = rigid.gear_torques(end, generalised(flight, torque, end[3:7]))
    deflection = flight.motor_positions - flight.positions
    swing = 0.05 * np.abs(at_the_end).max()  # of the torque, which falls as K^-0.5
    np.testing.assert_allclose(stiffness * deflection, at_the_end, rtol=0.0, atol=swing)


def _flown_rigidly(rigid: RigidGears, flight: GearedFlight, torque: Array, ticks: int) -> Array:
    """Return the state of the rigid robot after some ticks, by DOP853."""
    equations = rigid.equations

    def derivative(_: float, y: Array) -> Array:
        force = generalised(flight, torque, y[3:7])
        return equations.rate(y, rigid.acceleration(y, force))

    solution = solve_ivp(
        derivative, (0.0, ticks * PERIOD), flight.x.copy(), "DOP853", rtol=1e-11, atol=1e-12
    )
    end: Array = solution.y[:, -1]
    return end
