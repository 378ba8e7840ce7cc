"""Flights of a base with wheels: gyrostat by SciPy, friction by MuJoCo, momentum by Pinocchio."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np
import pinocchio as pin
import pytest
from numpy.typing import NDArray
from oracles import pinocchio_mass_matrix, pinocchio_state
from oracles.momenta import kinetic_energy
from oracles.rotors import Rotor, mujoco_with_wheels, random_rotors, settings_of
from paths import DATA
from scipy.integrate import solve_ivp
from strategies import State, random_robot

from space_robot_model.dynamics.attitude import quaternion_rate
from space_robot_model.robot import Robot
from space_robot_msgs_py.samples import Command
from space_robot_sim.environment.friction import FrictionSettings
from space_robot_sim.environment.target import Target
from space_robot_sim.plant.plant import Plant, PlantSettings
from space_robot_sim.plant.stick_slip import integrate

Array = NDArray[np.float64]
PERIOD = 5e-4
N = 6
"""Joints; for so many the kernels are there."""
STUCK = FrictionSettings(coulomb=1e4, viscous=0.0)
"""The arm is a part of the base."""
SMOOTH = FrictionSettings(coulomb=0.0, viscous=0.0)


class Flight:
    """A plant's own integration under torques given by the test."""

    def __init__(
        self, robot: Robot, rotors: list[Rotor], friction: FrictionSettings, **wheels: Any
    ) -> None:
        settings = PlantSettings(
            initial_joints_deg=[10.0 * (i + 1) for i in range(robot.n)],
            friction=friction,
            base_actuation="hardware",
            wheels=settings_of(rotors, **wheels),
        )
        self._plant = Plant(robot, settings, PERIOD)
        memory = self._plant.memory
        self.n, self.count, self.x = robot.n, len(rotors), memory.x
        self._model, self._environment, self._stages = (
            memory.model,
            memory.environment,
            memory.stages,
        )
        self._actuation = self._stages.actuation
        self._tick = 0

    def step(self, base: Array, joints: Array, motors: Array) -> None:
        """Fly a tick under torques (N m) on the base's axes, the joints and the wheels."""
        n, actuation = self.n, self._actuation
        actuation[3:6], actuation[6 : 6 + n] = base, joints
        actuation[6 + n : 6 + n + self.count] = motors
        time = self._tick * PERIOD
        integrate(self._model, self._environment, self.x, time, PERIOD, self._stages)
        self._tick += 1

    @property
    def omega(self) -> Array:
        """The base's, on its own axes, rad/s."""
        state = self.state
        return pinocchio_state(state)[1][3:6]

    @property
    def speeds(self) -> Array:
        """Of the wheels, rad/s."""
        return self.x[13 + 2 * self.n :][: self.count].copy()

    @property
    def state(self) -> State:
        """With the wheels behind the joints, at angle 0."""
        n, x = self.n, self.x.copy()
        angles = np.concatenate([x[7 : 7 + n], np.zeros(self.count)])
        rates = x[13 + n : 13 + 2 * n + self.count]
        return State(x[3:7], angles, x[7 + n : 10 + n], x[10 + n : 13 + n], rates)


def locked_inertia(robot: Robot, theta: Array) -> Array:
    """Of the whole robot about its centre of mass, base frame, kg m2."""
    zero = np.zeros(3)
    still = State(np.array([1.0, 0.0, 0.0, 0.0]), theta, zero, zero, 0.0 * theta)
    inertia = pinocchio_mass_matrix(robot, still)[:6, :6]
    coupling = inertia[:3, 3:]
    reduced: Array = inertia[3:, 3:] - coupling.T @ np.linalg.solve(inertia[:3, :3], coupling)
    return reduced


@pytest.mark.parametrize("seed", range(4))
def test_with_its_arm_locked_it_is_a_gyrostat(seed: int) -> None:
    """Hughes' equations of motion by DOP853, about the centre of mass of the whole."""
    rng = np.random.default_rng(seed)
    robot = random_robot(rng, N)
    rotors = random_rotors(rng, robot, 4)
    viscous = 1e-4
    speeds = 100.0 * rng.normal(size=4)
    flight = Flight(robot, rotors, STUCK, initial_speed=speeds.tolist(), viscous=[viscous])
    flight.x[10 + N : 13 + N] = 0.1 * rng.normal(size=3)
    base, motors = rng.normal(size=3), 0.2 * rng.normal(size=4)
    axes, spins = np.array([rotor.axis for rotor in rotors]).T, np.array([r.spin for r in rotors])
    whole = locked_inertia(robot, flight.x[7 : 7 + N])
    without = np.linalg.inv(whole - (axes * spins) @ axes.T)

    def derivative(_: float, y: Array) -> Array:
        quaternion, omega, speed = y[:4], y[4:7], y[7:]
        torque, rate = motors - viscous * speed, np.empty(4)
        momentum = whole @ omega + axes @ (spins * speed)
        turn = without @ (base - axes @ torque - np.cross(omega, momentum))
        state = State(quaternion / np.linalg.norm(quaternion), *[np.zeros(3)] * 4)
        inertial = pin.Quaternion(np.roll(state.quaternion, -1)).toRotationMatrix() @ omega
        quaternion_rate(quaternion, inertial, rate)
        return np.concatenate([rate, turn, torque / spins - axes.T @ turn])

    start = np.concatenate([flight.x[3:7], flight.omega, speeds])
    exact = solve_ivp(derivative, (0.0, 2.0), start, "DOP853", rtol=1e-13, atol=1e-13)
    for _ in range(round(2.0 / PERIOD)):
        flight.step(base, np.zeros(N), motors)
    end = exact.y[:, -1]
    assert np.abs(end[:7] - start[:7]).max() > 1e-2
    np.testing.assert_allclose(flight.x[3:7], end[:4], rtol=0.0, atol=1e-11)
    np.testing.assert_allclose(flight.omega, end[4:7], rtol=0.0, atol=1e-11)
    np.testing.assert_allclose(flight.speeds, end[7:], rtol=1e-11)


def test_wheels_go_through_rest_and_come_to_rest_as_in_mujoco() -> None:
    """One is driven through zero speed, one stops and sticks, one breaks away, one stays."""
    rng = np.random.default_rng(3)
    robot = random_robot(rng, N)
    rotors = [rotor._replace(spin=0.02, transverse=0.015) for rotor in random_rotors(rng, robot, 4)]
    coulomb = 0.02
    speeds, motors = np.array([1.0, -0.4, 0.0, 0.0]), np.array([-0.07, 0.01, 0.05, -0.015])
    flight = Flight(robot, rotors, SMOOTH, initial_speed=speeds.tolist(), coulomb=[coulomb])

    model = mujoco_with_wheels(robot, rotors)
    model.opt.timestep = 1e-5
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT
    model.dof_frictionloss[6 + N :] = coulomb
    model.dof_solimp[6 + N :, :2] = 0.9999  # as stiff as its constraints can be
    model.dof_solref[6 + N :, 0] = 2.1e-5
    data = mujoco.MjData(model)
    data.qpos[7 : 7 + N], data.qvel[6 + N :] = flight.x[7 : 7 + N], speeds
    data.qfrc_applied[6 + N :] = motors

    stood = []
    for _ in range(8):
        for _ in range(100):
            flight.step(np.zeros(3), np.zeros(N), motors)
        mujoco.mj_step(model, data, 5000)
        np.testing.assert_allclose(flight.speeds, data.qvel[6 + N :], rtol=0.0, atol=1e-4)
        np.testing.assert_allclose(flight.omega, data.qvel[3:6], rtol=0.0, atol=1e-6)
        stood.append(flight.speeds == 0.0)
    assert flight.speeds[0] < -0.4
    assert flight.speeds[2] > 0.2
    assert [bool(all(when)) for when in np.array(stood).T] == [False, False, False, True]
    assert stood[-1].tolist() == [False, True, False, True]


def test_wheels_of_a_robot_with_passive_joints_get_what_is_asked_of_them() -> None:
    """Each one's own momentum grows by its motor's torque alone, whatever else moves.

    Also over a capture, which gives it none: ``J (Omega + a . w0)`` stays as the base is struck.
    """
    robot, rng = Robot.from_yaml(DATA / "passive_robot" / "robot.yaml"), np.random.default_rng(5)
    rotors = [rotor._replace(spin=0.05) for rotor in random_rotors(rng, robot, 4)]
    wheels = settings_of(rotors, initial_speed=[20.0, -30.0, 40.0, 10.0])
    axes, spins = np.array([rotor.axis for rotor in rotors]), np.array([r.spin for r in rotors])
    target = Target.from_dict(
        {
            "target": {
                "mass": 20.0,
                "inertia": [2.0, 3.0, 4.0, 0.0, 0.0, 0.0],
                "motion": {"velocity": [0.3, -0.2, 0.1], "angular_velocity": [0.2, 0.4, -0.3]},
            }
        }
    )
    settings = PlantSettings(
        initial_joints_deg=[10.0, 0.3, 20.0, 0.0, 30.0, 0.0],
        friction=SMOOTH,
        wheels=wheels,
        base_actuation="hardware",
        initial_quaternion=[0.5, -0.5, 0.1, 0.7],
        events=[f"capture@{100 * PERIOD}:{target.inline}"],
    )
    plant = Plant(robot, settings, PERIOD)

    def own() -> Array:
        truth = plant.truth
        return spins * (truth.wheel_velocities[:4] + axes @ truth.omega_base)

    torque = np.concatenate([np.zeros(3), 5.0 * rng.normal(size=6), 0.3 * rng.normal(size=4)])
    before, energy = own(), kinetic_energy(robot, plant.truth, wheels)
    assert energy == pytest.approx(0.5 * spins @ np.square(wheels.initial_speed))
    turned = 0.0
    for tick in range(200):
        omega = plant.truth.omega_base.copy()
        plant.step(Command(tick, torque))
        if plant.tick == 100:
            turned = float(np.abs(plant.truth.omega_base - omega).max())
        expected = before + torque[9:] * plant.tick * PERIOD
        np.testing.assert_allclose(own(), expected, rtol=0.0, atol=1e-11)
    assert turned > 1e-3, "the base must be struck"
    assert np.abs(plant.truth.passive_positions[:2]).max() > 1e-4
