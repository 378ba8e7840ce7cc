"""Motors, gears and friction are inside a robot: they leave its momentum as it is.

Springs without dampers keep its energy, too, and what strikes it gives its rotors no spin.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from geared_robots import PERIOD, GearedFlight, geared_paper_arm, random_gears, with_gears
from numpy.typing import NDArray
from random_robots import State
from random_trees import random_bodies
from rotor_equations import RotorEquations
from rotor_oracles import gear_of, pinocchio_kinetic_energy, pinocchio_momentum, random_motor_rotors

from space_robot_model.robot import Robot
from space_robot_model.robot.gears import motor_momentum
from space_robot_model.robot.tree import Body, JointFriction
from space_robot_sim.environment.target import Target

Array = NDArray[np.float64]

KINDS = ("revolute", "passive revolute", "prismatic", "revolute", "revolute", "passive prismatic")
VISCOUS = 0.2


def state_of(flight: GearedFlight) -> State:
    """Return the state with the joints in the robot's order."""
    truth, robot = flight.plant.truth, flight.robot
    p, x = len(robot.springs), flight.x.copy()
    n = robot.joint_count
    return State(
        x[3:7],
        np.concatenate([truth.joint_positions, truth.passive_positions[:p]]),
        x[7 + n : 10 + n],
        x[10 + n : 13 + n],
        np.concatenate([truth.joint_velocities, truth.passive_velocities[:p]]),
    )


def of_tree(rng: np.random.Generator) -> Robot:
    """Return a tree with gears on some joints that turn and slide, rigid and passive ones."""

    def without_friction(body: Body) -> Body:
        joint = body.joint and replace(body.joint, friction=JointFriction())
        return replace(body, joint=joint)

    bodies = [without_friction(body) for body in random_bodies(rng, KINDS)]
    robot = random_gears(rng, Robot.of_tree("tree", bodies))
    return with_gears(robot, [g and g._replace(ratio=10.0) for g in robot.gears])


@pytest.mark.parametrize(("name", "coulomb"), [("paper", 0.3), ("tree", 1.5), ("tree", 0.0)])
def test_rotors_spin_up_and_the_momentum_of_the_whole_stays(
    name: str, coulomb: float, paper_robot: Robot
) -> None:
    """On a free base, with set-valued friction, by Pinocchio: to 1e-12 of what is exchanged.

    That is the largest momentum of the base, or of the rotors' spin; the whole has none.
    """
    rng = np.random.default_rng(4)
    robot = geared_paper_arm(paper_robot) if name == "paper" else of_tree(rng)
    rotors = random_motor_rotors(rng, robot)
    flight = GearedFlight(robot, 2, coulomb, VISCOUS)
    amplitudes, phases = rng.uniform(2.0, 6.0, robot.n), rng.uniform(0.0, 2.0 * np.pi, robot.n)
    ratios = np.array([gear_of(robot, joint).ratio for joint in flight.joints])
    exchanged, spun, drift, stood, slid = 0.0, 0.0, [0.0, 0.0], 0, 0
    for tick in range(4000):
        torque = amplitudes * np.sin(4.0 * tick * PERIOD + phases)
        truth = flight.fly(np.concatenate([np.zeros(3), torque]))
        speeds = truth.motor_velocities[: len(rotors)]
        stood += int((speeds == 0.0).any())
        slid += int((speeds != 0.0).any())
        spun = max(spun, float(np.abs(ratios * speeds).max()))
        if tick % 50 == 49:
            state = state_of(flight)
            spin = motor_momentum(
                robot, state.quaternion[None], state.theta[None], speeds[None].copy()
            )
            of_base = robot.inertia[0] @ truth.omega_base
            exchanged = max(exchanged, *(float(np.linalg.norm(h)) for h in (spin, of_base)))
            linear, angular = pinocchio_momentum(robot, rotors, state, speeds)
            drift = [
                max(size, float(np.abs(part).max()))
                for size, part in zip(drift, (linear, angular), strict=True)
            ]
    assert bool(stood) == bool(coulomb), "friction must hold motors at rest for a while"
    assert slid > 3000
    assert exchanged > 0.1
    assert max(drift) < 1e-12 * exchanged
    assert spun > 0.1


def test_springs_without_dampers_keep_the_energy(paper_robot: Robot) -> None:
    """Kinetic energy by Pinocchio and that of the springs, after a push; it goes to and fro."""
    rng = np.random.default_rng(2)
    robot = geared_paper_arm(paper_robot, damping=0.0)
    rotors, flight = random_motor_rotors(rng, robot), GearedFlight(robot, 4)
    stiffness = np.array([gear_of(robot, joint).stiffness for joint in flight.joints])
    flight.fly(np.concatenate([50.0 * rng.normal(size=3), 20.0 * rng.normal(size=6)]), 100)
    stored = []

    def energy() -> float:
        truth = flight.plant.truth
        deflection = truth.motor_positions - truth.joint_positions
        stored.append(0.5 * float(stiffness @ deflection**2))
        speeds = truth.motor_velocities.copy()
        return stored[-1] + pinocchio_kinetic_energy(robot, rotors, state_of(flight), speeds)

    before = energy()
    for _ in range(20):
        flight.rest(50)
        assert energy() == pytest.approx(before, rel=1e-8)
    assert np.ptp(stored) > 1e-3 * before


@pytest.mark.parametrize("seed", [0, 1])
def test_a_capture_gives_a_rotor_no_spin_of_its_own(seed: int) -> None:
    """``J (N thetadot_m + z . w_p)`` is as in the flight without it, though all else is struck."""
    rng = np.random.default_rng(seed)
    robot = of_tree(rng)
    equations = RotorEquations(robot, random_motor_rotors(rng, robot))
    motion = {"velocity": [0.3, -0.2, 0.1], "angular_velocity": [0.2, 0.4, -0.3]}
    content = {"mass": 20.0, "inertia": [2.0, 3.0, 4.0, 0.0, 0.0, 0.0], "motion": motion}
    target, ticks = Target.from_dict({"target": content}), 200
    torque = 20.0 * rng.normal(size=3 + robot.n)
    spins, flights = [], []
    for events in ([], [f"capture@{ticks * PERIOD}:{target.inline}"]):
        flight = GearedFlight(robot, 2, events=events)
        flight.fly(torque, ticks)
        state, velocities = state_of(flight), flight.motor_velocities.copy()
        mass, _ = equations.matrices(state.quaternion, state.theta, np.zeros(equations.size))
        momentum = mass @ np.concatenate([state.velocity, velocities])
        spins.append(momentum[6 + robot.joint_count :])
        flights.append(flight)
    struck = np.abs(flights[1].motor_velocities - flights[0].motor_velocities)
    assert np.abs(flights[1].base_velocities - flights[0].base_velocities).max() > 1e-3
    assert struck.max() > 1e-5
    size = np.abs(spins[0]).max()
    np.testing.assert_allclose(spins[1], spins[0], rtol=0.0, atol=1e-12 * size)
    flights[1].fly(torque, 20)
    assert np.abs(flights[1].motor_velocities).max() > 1e-3
