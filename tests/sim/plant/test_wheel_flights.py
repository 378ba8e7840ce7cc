"""Flights of a base with wheels: friction by its formulas, momentum by Pinocchio."""

from __future__ import annotations

import numpy as np
import pytest
from benches import WHEEL_AXES
from numpy.typing import NDArray
from oracles.momenta import kinetic_energy
from oracles.rotors import random_rotors, settings_of
from paths import DATA
from robots import LOCKED, rigid_robot

from space_robot_model.robot import Robot
from space_robot_msgs_py.samples import Command
from space_robot_sim.environment.friction import FrictionSettings
from space_robot_sim.environment.target import Target
from space_robot_sim.plant.plant import Plant, PlantSettings

Array = NDArray[np.float64]
PERIOD = 5e-4
SMOOTH = FrictionSettings(coulomb=0.0, viscous=0.0)


def test_wheels_go_through_rest_and_come_to_rest_as_the_formulas_say() -> None:
    """One is driven through zero speed, one stops and sticks, one breaks away, one stays.

    The base is too heavy to be turned by them.
    """
    spin, coulomb, ticks = 0.02, 0.02, 800
    speeds, motors = np.array([1.0, -0.4, 0.0, 0.0]), np.array([-0.07, 0.01, 0.05, -0.015])
    wheels = {"axes": WHEEL_AXES, "rotor_inertia": [spin], "coulomb": [coulomb]}
    settings = {
        "initial_joints_deg": [0.0] * 6,
        "friction": LOCKED,
        "base_actuation": "hardware",
        "wheels": {**wheels, "initial_speed": speeds.tolist()},
    }
    plant = Plant(rigid_robot(1e9, [1e12] * 3), PlantSettings.model_validate(settings), PERIOD)
    rates = (motors - coulomb * np.array([-1.0, -1.0, 1.0, 0.0])) / spin
    rates[0] = (motors[0] - coulomb) / spin
    through = (motors[0] + coulomb) / spin
    stops = -speeds[:2] / rates[:2]
    for tick in range(ticks):
        plant.step(Command(tick, np.concatenate([np.zeros(9), motors])))
        time = plant.tick * PERIOD
        first = speeds[0] + rates[0] * time if time < stops[0] else through * (time - stops[0])
        second = min(speeds[1] + rates[1] * time, 0.0)
        expected = [first, second, rates[2] * time, 0.0]
        np.testing.assert_allclose(plant.truth.wheel_velocities[:4], expected, atol=1e-10)
    assert stops.max() < time
    assert plant.truth.wheel_velocities[1] == plant.truth.wheel_velocities[3] == 0.0


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
