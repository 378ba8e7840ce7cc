"""Passive joints in flight: the oscillator's closed form, energy, momentum, a robot locked."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from conservation import damping_loss, kinetic_energy, momentum, spring_energy
from numpy.typing import NDArray
from paths import DATA

from space_robot_model.robot import Robot
from space_robot_model.robot.dynamics import mass_matrix
from space_robot_msgs_py.samples import Command
from space_robot_sim.environment.friction import FrictionSettings
from space_robot_sim.plant.plant import Plant, PlantSettings

Array = NDArray[np.float64]
PERIOD = 5e-4
NO_FRICTION = FrictionSettings(coulomb=0.0, viscous=0.0)
MOTORS = 6
"""As many as the paper's robot has, whose compiled kernels serve."""
BASE_MASS, WHEEL_MASS, TANK_MASS = 40.0, 2.0, 8.0
SPRING = {"stiffness": 90.0, "damping": 3.0, "rest_deg": 0.05}
BALL = [0.5, 0.5, 0.5, 0.0, 0.0, 0.0]


def sloshing(joint: str) -> Robot:
    """A base whose motors turn balls about their own centres, and a ball on a spring along z."""
    centred: dict[str, Any] = {"inertia": BALL, "com": [0.0, 0.0, 0.0], "parent": "base"}
    links = [
        *({"name": f"spinner{k}", "mass": WHEEL_MASS, **centred} for k in range(MOTORS)),
        {"name": "tank", "mass": TANK_MASS, "joint": joint, "passive": SPRING, **centred},
    ]
    base = {"mass": BASE_MASS, "inertia": [9.0, 9.0, 9.0, 0.0, 0.0, 0.0]}
    return Robot.from_dict({"robot": {"name": "sloshing", "base": base, "links": links}})


@pytest.mark.parametrize("joint", ["prismatic", "revolute"])
def test_two_bodies_on_a_spring_swing_as_the_formula_says(joint: str) -> None:
    """``m x'' + c x' + k (x - rest) = 0``, m the reduced mass, or moment, of the two bodies."""
    robot = sloshing(joint)
    plant = Plant(
        robot, PlantSettings(initial_joints_deg=[0.0] * MOTORS, friction=NO_FRICTION), PERIOD
    )
    (spring,) = robot.springs
    of_base, of_tank = (
        (BASE_MASS + MOTORS * WHEEL_MASS, TANK_MASS) if joint == "prismatic" else (9.0, 0.5)
    )  # the spinners do not turn with the base: nothing drives them
    mass = of_base * of_tank / (of_base + of_tank)
    stretched = 0.1
    plant.memory.x[7 + MOTORS] = spring.rest + stretched
    decay = 0.5 * spring.damping / mass
    pulsation = np.sqrt(spring.stiffness / mass - decay**2)
    for _ in range(4):
        for _ in range(500):
            plant.step(Command(plant.tick, np.zeros(3 + MOTORS)))
        t = plant.tick * PERIOD
        swing = np.cos(pulsation * t) + decay / pulsation * np.sin(pulsation * t)
        expected = spring.rest + stretched * np.exp(-decay * t) * swing
        assert plant.truth.passive_positions[0] == pytest.approx(expected, abs=1e-9)


def test_dampers_take_what_motion_and_springs_lose() -> None:
    """Of a robot with a bending panel, sloshing fuel, and an arm, pushed and let go."""
    robot = Robot.from_yaml(DATA / "passive_robot" / "robot.yaml")
    n = robot.n
    settings = PlantSettings(
        initial_joints_deg=[10.0, 0.3, 20.0, 0.0, 30.0, 0.0], friction=NO_FRICTION
    )
    plant = Plant(robot, settings, PERIOD)
    for _ in range(400):
        plant.step(
            Command(plant.tick, np.array([60.0, -30.0, 40.0, 6.0, -4.0, 1.0, 0.3, -0.2, 0.1]))
        )

    def energy() -> float:
        return kinetic_energy(robot, plant.truth) + spring_energy(robot, plant.truth)

    linear, angular = momentum(robot, plant.truth)
    assert np.abs(linear).max() < 1e-10
    before, losses = energy(), [damping_loss(robot, plant.truth)]
    for _ in range(1000):
        plant.step(Command(plant.tick, np.zeros(n + 3)))
        losses.append(damping_loss(robot, plant.truth))
    lost = PERIOD * (np.sum(losses) - 0.5 * (losses[0] + losses[-1]))
    assert lost > 1e-4 * before
    assert before - energy() == pytest.approx(lost, rel=1e-4)
    linear, angular_now = momentum(robot, plant.truth)
    assert np.abs(linear).max() < 1e-10
    np.testing.assert_allclose(angular_now, angular, rtol=0.0, atol=1e-9)


def test_the_nominal_robot_is_the_whole_one_with_its_passive_joints_held_at_rest() -> None:
    """Its inertia matrix is that of the whole, without the passive rows.

    But for the moments of the base, whose centre of mass has others' share in it then.
    """
    robot = Robot.from_yaml(DATA / "passive_robot" / "robot.yaml")
    attitude, joints = [0.5, 0.5, -0.5, 0.5], [0.4, 0.7, -1.1, 0.2, 0.8, -0.3]
    rest = [spring.rest for spring in robot.springs]
    whole = mass_matrix(robot, attitude, [*joints, *rest])
    moved = mass_matrix(robot.nominal, attitude, joints)
    assert robot.nominal.joint_names == robot.joint_names
    assert robot.nominal.tool.body == robot.nominal.n
    for columns in (slice(0, 3), slice(6, 6 + robot.n)):
        np.testing.assert_allclose(
            moved[6:, columns], whole[6 : 6 + robot.n, columns], rtol=0.0, atol=1e-12
        )
