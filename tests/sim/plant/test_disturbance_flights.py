"""Flights under a disturbance of the user's own, against integrals by hand and SciPy."""

from __future__ import annotations

import pickle
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from numpy.typing import NDArray
from oracles import rotation_of
from scipy.integrate import solve_ivp
from tree_flight import PERIOD, SEEDS, TORQUE, TreeFlight, tree

from space_robot_model.robot import Robot
from space_robot_msgs_py.samples import Command
from space_robot_sim.environment.disturbance import DisturbanceSettings
from space_robot_sim.environment.disturbance_table import DisturbanceTable
from space_robot_sim.environment.friction import FrictionSettings
from space_robot_sim.plant.plant import Plant, PlantSettings

Array = NDArray[np.float64]
MASS, SPIN = 100.0, 8.0


def table(**columns: Any) -> DisturbanceSettings:
    numbers = {name: np.asarray(values).tolist() for name, values in columns.items()}
    return DisturbanceSettings(table=DisturbanceTable.of(numbers, "here").text)


def top(disturbance: DisturbanceSettings) -> Plant:
    """A base that carries a top about its z axis through its centre; neither moves the other."""
    base = {"mass": MASS, "inertia": [SPIN] * 3 + [0.0] * 3}
    ball = {"name": "ball", "mass": 1.0, "inertia": [2.0] * 3 + [0.0] * 3, "com": [0.0] * 3}
    robot = Robot.from_dict({"robot": {"name": "top", "base": base, "links": [ball]}})
    settings = PlantSettings(
        initial_joints_deg=[0.0],
        friction=FrictionSettings(coulomb=0.0, viscous=0.0),
        disturbance=disturbance,
    )
    return Plant(robot, settings, PERIOD)


def flown(plant: Plant, ticks: int) -> Plant:
    for _ in range(ticks):
        plant.step(Command(plant.tick, np.zeros(4)))
    return plant


TIMES = [0.05, 0.06, 0.1, 0.3, 0.31]
VALUES = np.array([2.0, -1.0, 4.0, 4.0, -0.5])


def test_momentum_is_the_integral_of_the_force() -> None:
    """It begins and ends with a jump; the base drifts on, to rounding."""
    plant = flown(top(table(time=TIMES, base_force_x=VALUES, base_force_z=-VALUES)), 1_000)
    momentum = (MASS + 1.0) * plant.truth.base_velocity
    impulse = np.trapezoid(VALUES, TIMES)
    np.testing.assert_allclose(momentum, [impulse, 0.0, -impulse], rtol=1e-12, atol=1e-13)
    assert not plant.truth.omega_base.any()


def test_angular_momentum_is_the_integral_of_the_torque() -> None:
    """About z, with the top free to stay behind."""
    plant = flown(top(table(time=TIMES, base_torque_z=VALUES)), 1_000)
    truth = plant.truth
    impulse = np.trapezoid(VALUES, TIMES)
    assert SPIN * truth.omega_base[2] == pytest.approx(impulse, rel=1e-12)
    assert truth.joint_velocities[0] == pytest.approx(-truth.omega_base[2], rel=1e-12)
    assert not truth.base_velocity.any()


def test_a_torque_on_a_joint_turns_both_sides_and_keeps_momentum() -> None:
    plant = flown(top(table(time=TIMES, ball=VALUES)), 1_000)
    omega, rate = plant.truth.omega_base[2], plant.truth.joint_velocities[0]
    impulse = np.trapezoid(VALUES, TIMES)
    assert 2.0 * (omega + rate) == pytest.approx(impulse, rel=1e-12)
    assert SPIN * omega == pytest.approx(-impulse, rel=1e-12)


@pytest.mark.parametrize("seed", SEEDS)
def test_a_tumbling_tree_agrees_with_an_adaptive_integrator(seed: int) -> None:
    """Force, torque and a joint, each by its own line, on a base that turns; springs in it."""
    columns: dict[str, Any] = {"time": np.array([0.0, 0.1])}
    own = TreeFlight(tree(seed), viscous=0.2)
    joint = own.robot.joint_names[1]
    rng = np.random.default_rng(seed)
    names = [f"base_{kind}_{axis}" for kind in ("force", "torque") for axis in "xyz"]
    wrench = rng.normal(size=(2, 6)) * [80.0, 80.0, 80.0, 30.0, 30.0, 30.0]
    push = np.array([3.0, -2.0])
    columns |= dict(zip(names, wrench.T, strict=True)) | {joint: push}
    flight = TreeFlight(tree(seed), viscous=0.2, disturbance=table(**columns))
    x, nq = np.concatenate(flight.configuration()), flight.model.nq

    def derivative(t: float, x: Array) -> Array:
        share = t / 0.1
        disturbed = np.zeros(flight.robot.n + 3)
        disturbed[4] = -((1.0 - share) * push[0] + share * push[1])
        acting = (1.0 - share) * wrench[0] + share * wrench[1]
        return flight.derivative(TORQUE, x[:nq], x[nq:], disturbed, acting)

    solved = solve_ivp(derivative, (0.0, 0.1), x, method="DOP853", rtol=1e-12, atol=1e-12)
    x = solved.y[:, -1]
    flight.fly(TORQUE, 200)
    actual = np.concatenate(flight.configuration())
    actual[3:7] *= np.sign(actual[3:7] @ x[3:7])
    np.testing.assert_allclose(actual, x, rtol=0.0, atol=1e-9 * np.abs(x).max())
    undisturbed = own.fly(TORQUE, 200).joint_positions
    assert np.abs(undisturbed - flight.plant.state.joint_positions).max() > 1e-4


def test_a_sine_gives_the_momentum_of_its_rows() -> None:
    """The robot tumbles: its momentum is what the force has given along the attitudes flown."""
    time = np.arange(0.0, 0.5001, 0.01)
    force = 5.0 * np.sin(9.0 * time)
    own = table(time=time, base_force_y=force, base_torque_x=np.cos(time))
    flight = TreeFlight(tree(0, lossless=True), viscous=0.0, disturbance=own)
    rows, impulse = np.interp(np.arange(1001) * PERIOD, time, force), np.zeros(3)
    before = rotation_of(flight.plant.truth.quaternion).apply([0.0, rows[0], 0.0])
    for tick in range(1000):
        flight.fly(np.zeros(6), 1)
        after = rotation_of(flight.plant.truth.quaternion).apply([0.0, rows[tick + 1], 0.0])
        impulse += 0.5 * PERIOD * (before + after)
        before = after
    pin.computeCentroidalMomentum(flight.model, flight.data, *flight.configuration())
    np.testing.assert_allclose(flight.data.hg.linear, impulse, rtol=0.0, atol=1e-6)
    assert np.linalg.norm(impulse) > 0.1


def test_a_copy_and_a_saved_plant_fly_on_to_the_same_bits() -> None:
    """Also where the next part of a long table is due later."""
    time = np.arange(0.0, 0.5, 0.001)
    disturbance = table(time=time, base_force_x=np.sin(50.0 * time), ball=np.cos(40.0 * time))
    plant = flown(top(disturbance), 400)
    copied, saved = pickle.loads(pickle.dumps(plant)), plant.save()
    end = flown(plant, 700).memory.x.copy()
    np.testing.assert_array_equal(flown(copied, 700).memory.x, end)
    plant.restore(saved)
    np.testing.assert_array_equal(flown(plant, 700).memory.x, end)
    assert not np.array_equal(flown(top(DisturbanceSettings()), 1_100).memory.x, end)


def test_a_table_of_another_robot_is_refused() -> None:
    with pytest.raises(ValueError, match="unknown column 'joint2': choose one of"):
        top(table(time=TIMES, joint2=VALUES))
