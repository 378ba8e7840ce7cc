"""Coulomb friction as a set: joints that stand, slide, come to rest and break away."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from oracles import pinocchio_bias_force, pinocchio_mass_matrix, rotation_of
from oracles.momenta import kinetic_energy, momentum
from scipy.integrate import quad
from strategies import State, random_quaternion, random_robot

from space_robot_model.dynamics.model import Data
from space_robot_model.robot import Robot
from space_robot_msgs_py.samples import Command
from space_robot_sim.environment.disturbance import DisturbanceSettings
from space_robot_sim.environment.friction import FrictionSettings
from space_robot_sim.plant.integrator import Stages
from space_robot_sim.plant.plant import Plant, PlantSettings
from space_robot_sim.plant.stick_slip import MOST_CUTS, integrate, slip_or_stick

Array = NDArray[np.float64]
PERIOD = 5e-4
COULOMB = 0.7
"""N m; large beside the torques below, so that much sticks."""


def plant_of(robot: Robot, coulomb: float, viscous: float = 0.0, **more: Any) -> Plant:
    friction = FrictionSettings(coulomb=coulomb, viscous=viscous)
    given = {"initial_joints_deg": [30.0] * robot.n, "friction": friction, **more}
    return Plant(robot, PlantSettings(**given), PERIOD)


def place(plant: Plant, rng: np.random.Generator, rates: Array) -> State:
    """Put the plant anywhere, its joints turning at ``rates``."""
    n, x = plant.robot.n, plant.memory.x
    x[3:7], x[7 : 7 + n] = random_quaternion(rng), rng.uniform(-3.0, 3.0, n)
    x[7 + n : 13 + n], x[13 + n : 13 + 2 * n] = rng.normal(size=6), rates
    return state_of(plant)


def state_of(plant: Plant) -> State:
    n, x = plant.robot.n, plant.memory.x.copy()
    rates = x[13 + n : 13 + 2 * n]
    return State(x[3:7], x[7 : 7 + n], x[7 + n : 10 + n], x[10 + n : 13 + n], rates)


def stand(plant: Plant, torque: Array) -> Stages:
    """Find under a torque (n+3,) on base and joints which joints stand; the plant's scratch."""
    memory = plant.memory
    memory.stages.actuation[3 : 3 + torque.size] = torque
    slip_or_stick(memory.model, memory.environment, memory.x, 0.0, memory.stages)
    return memory.stages


def data_of(plant: Plant) -> Data:
    """Scratch of the plant's dynamics; as an attribute NumPy gives the memory itself."""
    stages: Any = plant.memory.stages
    data: Data = stages["data"]
    return data


def solutions(robot: Robot, state: State, torque: Array, coulomb: float) -> list[Array]:
    """All friction torques (n,) that obey Coulomb's law, found by trying every combination."""
    n = robot.n
    inverse = np.linalg.inv(pinocchio_mass_matrix(robot, state))
    turned = rotation_of(state.quaternion).apply(torque[:3])
    force = np.concatenate([np.zeros(3), turned, torque[3:]])
    free = inverse @ (force - pinocchio_bias_force(robot, state))
    found = []
    choices = [(np.sign(rate),) if rate else (-1.0, 0.0, 1.0) for rate in state.rate]
    for senses in map(np.array, itertools.product(*choices)):
        friction = coulomb * senses
        stands = senses == 0.0
        joints = inverse[6:, 6:]
        rest = free[6:] - joints[:, ~stands] @ friction[~stands]
        friction[stands] = np.linalg.solve(joints[np.ix_(stands, stands)], rest[stands])
        acceleration = free[6:] - joints @ friction
        leaves = (state.rate == 0.0) & ~stands
        if (np.abs(friction[stands]) <= coulomb + 1e-12).all() and (
            acceleration[leaves] * senses[leaves] >= -1e-12
        ).all():
            found.append(friction)
    assert n == state.rate.size
    return found


@given(st.sampled_from([1, 3, 6]), st.integers(0, 2**32 - 1))
@settings(max_examples=40, deadline=None)
def test_joints_stand_or_break_away_as_coulombs_law_has_it(n: int, seed: int) -> None:
    """The friction of joints at rest and turning is the one solution there is."""
    rng = np.random.default_rng(seed)
    plant = plant_of(random_robot(rng, n), COULOMB)
    rates = rng.normal(size=n) * rng.integers(0, 2, n)
    state = place(plant, rng, 0.3 * rates)
    torque = rng.normal(size=n + 3)
    stages = stand(plant, torque)
    data, directions = data_of(plant), stages.directions[:n]
    locked = data.locked[:n] != 0.0
    friction = np.where(locked, data.holding[:n], COULOMB * directions)
    (expected,) = solutions(plant.robot, state, torque, COULOMB)
    np.testing.assert_allclose(friction, expected, rtol=0.0, atol=1e-9)
    accelerations = stages.slope[0, 13 + n : 13 + 2 * n]
    assert not accelerations[locked].any()


SPIN, STEP = 0.5, 0.01
"""kg m2 of each of six balls, and s, of one long step."""


def balls(count: int = 6, **disturbance: float) -> Plant:
    """Balls turned about their own centres, on a base that none of them moves; it drifts."""
    centred: dict[str, Any] = {"com": [0.0] * 3, "parent": "base"}
    ball = {"mass": 1.0, "inertia": [SPIN] * 3 + [0.0] * 3, **centred}
    base = {"mass": 1e9, "inertia": [1e12] * 3 + [0.0] * 3}
    links = [{"name": f"ball{k}", **ball} for k in range(count)]
    robot = Robot.from_dict({"robot": {"name": "balls", "base": base, "links": links}})
    settings = DisturbanceSettings(
        scale=1.0,
        base_amplitude=0.0,
        outer_amplitude=0.0,
        inner_frequencies=[5.0, 0.0],
        **disturbance,
    )
    plant = plant_of(robot, 0.0, initial_joints_deg=[0.0] * count, disturbance=settings)
    plant.memory.x[7 + count] = 2.0
    return plant


class Course(NamedTuple):
    """Angle and rate after a torque that is a function of time, from a time on."""

    angle: float
    rate: float

    @classmethod
    def under(cls, torque: Callable[[float], float], begin: float, end: float) -> Course:
        """From rest, by quadrature."""
        rate = quad(torque, begin, end, epsabs=1e-13)[0]
        angle = quad(lambda t: (end - t) * torque(t), begin, end, epsabs=1e-14)[0]
        return cls(angle / SPIN, rate / SPIN)


@pytest.mark.parametrize(
    ("motor", "coulomb"), [(0.0, 1.0), (0.5, 0.3)], ids=["stands at first", "comes back at first"]
)
@pytest.mark.parametrize("tick", [0, 20])
def test_where_one_joint_comes_to_rest_others_break_away(
    motor: float, coulomb: float, tick: int
) -> None:
    """All in one step, under a disturbance that grows in it: against the integrals of the torques.

    One joint stands at first, or would break away and come back; where others have come to rest, it
    turns the other way. Three stop one after the other, and stay.
    """
    amplitude, begin = 10.0, tick * STEP

    def disturbance(t: float) -> float:
        return amplitude * np.sin(10.0 * np.pi * t)

    plant, brake = balls(inner_amplitude=amplitude), 20.0
    memory, stops = plant.memory, begin + np.array([0.005, 0.0075])
    # how fast and far they go that are braked to rest at these times
    thrown = [
        Course.under(lambda t: brake + disturbance(t), begin, stop) for stop in stops.tolist()
    ]
    outer = 0.0025 * brake / SPIN
    memory.environment.friction.coulomb[:4] = coulomb, brake, brake, brake
    memory.x[14 + 6 : 17 + 6] = thrown[0].rate, thrown[1].rate, outer
    memory.stages.actuation[6] = motor
    integrate(memory.model, memory.environment, memory.x, begin, STEP, memory.stages)
    rates, angles = memory.x[19:25], memory.x[7:13]
    # slides back from the first stop on, that of the joint without disturbance
    first = begin + 0.0025
    if motor - disturbance(first) >= -coulomb:
        first = float(stops[0])
    slides = Course.under(lambda t: motor + coulomb - disturbance(t), first, begin + STEP)
    assert slides.rate < -1e-3
    np.testing.assert_allclose(rates, [slides.rate, *[0.0] * 5], rtol=0.0, atol=2e-7)
    assert not rates[1:4].any()
    ways = [
        thrown[k].rate * (stop - begin) - thrown[k].angle for k, stop in enumerate(stops.tolist())
    ]
    expected = [slides.angle, *ways, 0.5 * 0.0025 * outer, 0.0, 0.0]
    np.testing.assert_allclose(angles, expected, rtol=0.0, atol=2e-9)
    assert memory.x[0] == pytest.approx(2.0 * STEP, rel=1e-12), "time passes once"


def test_beyond_the_most_cuts_the_rest_of_a_step_is_flown_uncut() -> None:
    """More joints come to rest in one step, one after the other, than it may be cut."""
    count, brake = MOST_CUTS + 4, 20.0
    plant = balls(count)
    memory, stops = plant.memory, np.linspace(0.1, 0.9, count) * STEP
    memory.environment.friction.coulomb[:count] = brake
    memory.x[13 + count :][:count] = brake * stops / SPIN
    integrate(memory.model, memory.environment, memory.x, 0.0, STEP, memory.stages)
    angles, rates = memory.x[7 : 7 + count], memory.x[13 + count :][:count]
    assert memory.x[0] == pytest.approx(2.0 * STEP, rel=1e-12), "time passes once"
    assert not rates[:MOST_CUTS].any()
    assert (rates[MOST_CUTS:] != 0.0).all(), "they have not come to rest"
    expected = 0.5 * brake / SPIN * stops**2
    np.testing.assert_allclose(angles[:MOST_CUTS], expected[:MOST_CUTS], rtol=0.0, atol=1e-9)


@given(st.sampled_from([1, 3, 6]), st.integers(0, 2**32 - 1), st.sampled_from([0.0, 0.2]))
@settings(max_examples=25, deadline=None)
def test_friction_never_adds_energy(n: int, seed: int, viscous: float) -> None:
    """Nobody drives: whatever slides, stops or is dragged on, kinetic energy only falls."""
    rng = np.random.default_rng(seed)
    plant = plant_of(random_robot(rng, n), COULOMB, viscous)
    place(plant, rng, rng.normal(size=n) * rng.choice([0.0, 1e-6, 1e-3, 0.1], n))
    plant.step(Command(0, np.zeros(n + 3)))
    before = kinetic_energy(plant.robot, plant.state)
    linear, angular = momentum(plant.robot, plant.state)
    for tick in range(1, 60):
        plant.step(Command(tick, np.zeros(n + 3)))
        after = kinetic_energy(plant.robot, plant.state)
        assert after <= before * (1.0 + 1e-13)
        before = after
    for was, now in zip((linear, angular), momentum(plant.robot, plant.state), strict=True):
        np.testing.assert_allclose(now, was, rtol=0.0, atol=1e-11 * (1.0 + np.abs(was).max()))
