"""Coulomb friction as a set: joints that stand, slide, come to rest, break away; and gears."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from oracles.friction import solutions
from oracles.momenta import kinetic_energy, momentum
from robots import PERIOD, GearedFlight, oscillator
from scipy.integrate import quad
from strategies import State, random_quaternion, random_robot, rotor_room, with_gears

from space_robot_model.dynamics.model import Data
from space_robot_model.elementary.matrices import Array
from space_robot_model.robot import Robot
from space_robot_model.robot.parts import Gear
from space_robot_msgs_py.errors import InputError
from space_robot_msgs_py.samples import Command
from space_robot_sim.environment.disturbance import DisturbanceSettings
from space_robot_sim.environment.friction import FrictionSettings
from space_robot_sim.plant.integrator import MOST_CUTS, Stages, integrate, slip_or_stick
from space_robot_sim.plant.mounting import STABLE, check_rotors, check_springs
from space_robot_sim.plant.plant import Plant
from space_robot_sim.plant.settings import PlantSettings

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


# Gears: friction of the motor, and what is too stiff or too heavy

SUBSTEPS = 8
ROTOR, RATIO, STIFFNESS, LINK, BASE = 2e-5, 100.0, 150.0, 0.5, 3.0
"""kg m2; the base's with the rotor, locked."""
MOTOR = RATIO**2 * ROTOR
"""B = N^2 J, kg m2 or kg."""
GEAR = Gear(ROTOR, RATIO, STIFFNESS)


@pytest.mark.parametrize("sense", [-1.0, 1.0])
def test_a_motor_breaks_away_where_torque_less_spring_exceeds_its_friction(sense: float) -> None:
    coulomb, stretched = 5.0, 0.02
    for excess in (-1e-9, 1e-9):
        flight = GearedFlight(oscillator(GEAR, LINK), SUBSTEPS, coulomb)
        flight.positions[0] = -sense * stretched  # the spring pulls the motor back
        memory = flight.plant.memory
        pulled = coulomb + STIFFNESS * stretched
        memory.stages.actuation[6] = sense * pulled * (1.0 + excess)
        slip_or_stick(memory.model, memory.environment, memory.x, 0.0, memory.stages)
        acceleration = memory.stages.slope[0, 14 + 1]
        assert np.sign(acceleration) == (sense if excess > 0.0 else 0.0)


def test_a_stuck_joint_is_a_stuck_motor() -> None:
    """The fault raises the motor's friction: it stops at once, and the link swings about it."""
    flight = GearedFlight(oscillator(GEAR, LINK), SUBSTEPS, faults=["stuck_joint@0.05:joint=1000"])
    torque = [0.0, 0.0, 0.0, 4.0]
    stopped = flight.fly(torque, 102).motor_positions[0]
    swings = []
    for _ in range(400):
        truth = flight.fly(torque)
        assert truth.motor_positions[0] == stopped > 0.0
        swings.append(truth.joint_positions[0] - stopped)
    assert min(swings) < -1e-3
    assert max(swings) > 1e-3


def lighter() -> float:
    """``S^T M^-1 S`` of the deflection S: the square of the pulsation by stiffness."""
    own, stretch = RATIO * ROTOR, np.array([0.0, -1.0, 1.0])
    mass = np.array([[BASE + LINK, LINK, own], [LINK, LINK, 0.0], [own, 0.0, MOTOR]])
    return float(stretch @ np.linalg.solve(mass, stretch))


def swinging(angle: float, substeps: int = 1) -> Gear:
    """The gear whose spring turns by ``angle`` rad in an integrator's step."""
    return Gear(ROTOR, RATIO, (angle * substeps / PERIOD) ** 2 / lighter())


def damped(angle: float) -> Gear:
    """A gear without spring to speak of, whose damper's rate is ``angle`` by step."""
    return Gear(ROTOR, RATIO, 1e-3, angle / PERIOD / lighter())


@pytest.mark.parametrize(("excess", "substeps"), [(1.5, 1), (4.1, 1), (1.2, 3)])
def test_a_spring_above_the_limit_is_refused_with_the_substeps_that_do(
    excess: float, substeps: int
) -> None:
    """They are as few as would, and it flies stably with them, or with the shorter period."""
    robot = oscillator(swinging(STABLE * excess, substeps), LINK, BASE)
    with pytest.raises(InputError) as refused:
        GearedFlight(robot, substeps)
    message, pulsation = str(refused.value), STABLE * excess * substeps / PERIOD
    assert "\n" not in message
    steps = f"steps of {PERIOD / substeps:.6g} s"
    for part in ("drive.stiffness of 'joint'", steps, f"{pulsation:.4g} rad/s"):
        assert part in message
    advice = re.search(r"substeps: (\d+) or a period of (\S+) s would do", message)
    assert advice
    least, period = int(advice[1]), float(advice[2])
    assert least == int(excess * substeps) + 1
    check_springs(robot, np.zeros(1), period / substeps, substeps)
    flight = GearedFlight(robot, least)
    flight.motor_positions[0], deflections = 1e-3, []
    for _ in range(100):
        truth = flight.rest(40)
        deflections.append(truth.motor_positions[0] - truth.joint_positions[0])
    assert np.abs(deflections).max() <= 1e-3


def test_a_damper_may_be_what_is_too_strong_and_the_stiffest_joint_is_named() -> None:
    assert STABLE < 2.785, "a decay is stable up to there in a step of this method"
    with pytest.raises(InputError, match=r"drive\.damping of 'joint'"):
        GearedFlight(oscillator(damped(STABLE * 1.01), LINK, BASE))
    GearedFlight(oscillator(damped(STABLE * 0.99), LINK, BASE))
    robot = random_robot(np.random.default_rng(1), 3)
    rooms = [0.01 * rotor_room(robot, joint) for joint in range(3)]
    gears = [Gear(room, 10.0, k) for room, k in zip(rooms, (1e3, 1e8, 1e4), strict=True)]
    with pytest.raises(InputError, match=r"drive\.stiffness of 'joint2'"):
        GearedFlight(with_gears(robot, gears))
    GearedFlight(with_gears(robot, [gears[0], None, gears[2]]))


def carried(*shares: float, alpha_deg: float = 0.0) -> Robot:
    """Joints that are all on the base, with rotors of shares of its inertia."""
    base = {"mass": 10.0, "inertia": [2.0, 2.0, 2.0, 0.0, 0.0, 0.0]}
    link = {"mass": 1.0, "inertia": [1.0] * 3 + [0.0] * 3, "com": [0.0] * 3, "parent": "base"}
    links = [
        {"name": f"joint{k + 1}", "alpha_deg": alpha_deg * k, **link} for k in range(len(shares))
    ]
    robot = Robot.from_dict({"robot": {"name": "carrier", "base": base, "links": links}})
    return with_gears(robot, [Gear(2.0 * s, 1.0, 10.0) if s else None for s in shares])


def test_rotors_must_have_less_inertia_than_their_carriers() -> None:
    check_rotors(carried(0.999))
    check_rotors(carried(0.5, 0.0, 0.499))
    check_rotors(carried(0.95, 0.95, alpha_deg=90.0))  # across one another they do not add up
    for shares, names in (((1.0,), "joint1"), ((0.6, 0.0, 0.5), "joint1, joint3")):
        with pytest.raises(InputError) as refused:
            GearedFlight(carried(*shares))
        message, least = str(refused.value), 2.0 * (1.0 - sum(shares))
        assert f"drive.rotor_inertia of {names}: the inertia of 'base'" in message
        assert message.endswith(f"smallest principal moment is {least:g} kg m2")
        assert "\n" not in message
