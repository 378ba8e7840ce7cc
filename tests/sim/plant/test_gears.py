"""Joints with gears: SciPy on Pinocchio's bodies, two masses' frequency, friction, limits.

Runge and Kutta's method of fourth order turns a swing of pulsation w by ``w h (1 - (w h)^4 / 120)``
in a step h. With steps of 62.5 us that is below 1e-10 for all oscillators flown here.
"""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from oracles.rotors import RotorEquations, random_motor_rotors
from robots import PERIOD, GearedFlight, oscillator
from strategies import State, random_bodies, random_gears, random_robot, rotor_room, with_gears

from space_robot_model.robot import Robot
from space_robot_model.robot.tree import Body, Gear, JointFriction
from space_robot_msgs_py.errors import InputError
from space_robot_sim.environment.target import Target
from space_robot_sim.plant.gear_mounting import STABLE, check_rotors, check_springs
from space_robot_sim.plant.stick_slip import slip_or_stick

Array = NDArray[np.float64]
SUBSTEPS = 8
ROTOR, RATIO, STIFFNESS, LINK, BASE = 2e-5, 100.0, 150.0, 0.5, 3.0
"""kg m2; the base's with the rotor, locked."""
MOTOR = RATIO**2 * ROTOR
"""B = N^2 J, kg m2 or kg."""
GEAR = Gear(ROTOR, RATIO, STIFFNESS)
KINDS = ("revolute", "passive revolute", "prismatic", "revolute", "revolute", "passive prismatic")


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


def state_of(flight: GearedFlight) -> State:
    """The state with the joints in the robot's order."""
    truth, robot, x = flight.plant.truth, flight.robot, flight.x.copy()
    p, n = len(robot.springs), robot.joint_count
    return State(
        x[3:7],
        np.concatenate([truth.joint_positions, truth.passive_positions[:p]]),
        x[7 + n : 10 + n],
        x[10 + n : 13 + n],
        np.concatenate([truth.joint_velocities, truth.passive_velocities[:p]]),
    )


def tree(rng: np.random.Generator) -> Robot:
    """Gears on some joints that turn and slide, rigid and passive ones; no friction of its own."""

    def smooth(body: Body) -> Body:
        return replace(body, joint=body.joint and replace(body.joint, friction=JointFriction()))

    robot = Robot.of_tree("tree", [smooth(body) for body in random_bodies(rng, KINDS)])
    robot = random_gears(rng, robot)
    return with_gears(robot, [gear and gear._replace(ratio=10.0) for gear in robot.gears])


def test_a_capture_gives_a_rotor_no_spin_of_its_own() -> None:
    """``J (N thetadot_m + z . w_p)`` is as in the flight without it, though all else is struck."""
    rng = np.random.default_rng(1)
    robot = tree(rng)
    equations, ticks = RotorEquations(robot, random_motor_rotors(rng, robot)), 200
    motion = {"velocity": [0.3, -0.2, 0.1], "angular_velocity": [0.2, 0.4, -0.3]}
    content = {"mass": 20.0, "inertia": [2.0, 3.0, 4.0, 0.0, 0.0, 0.0], "motion": motion}
    target, torque = Target.from_dict({"target": content}), 20.0 * rng.normal(size=3 + robot.n)
    spins, speeds = [], []
    for events in ([], [f"capture@{ticks * PERIOD}:{target.inline}"]):
        flight = GearedFlight(robot, 2, events=events)
        flight.fly(torque, ticks)
        state = state_of(flight)
        speeds.append(np.concatenate([state.velocity, flight.motor_velocities]))
        mass, _ = equations.matrices(state.quaternion, state.theta, np.zeros(equations.size))
        spins.append((mass @ speeds[-1])[6 + robot.joint_count :])
    assert np.abs(speeds[1] - speeds[0])[[*range(6), -1]].max() > 1e-3
    np.testing.assert_allclose(spins[1], spins[0], rtol=0.0, atol=1e-12 * np.abs(spins[0]).max())


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
