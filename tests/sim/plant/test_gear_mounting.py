"""Springs of gears that a plant's steps can resolve, and rotors that bodies can carry."""

from __future__ import annotations

import re
from collections.abc import Callable

import numpy as np
import pytest
from geared_robots import PERIOD, GearedFlight, oscillator, rotor_room, with_gears
from numpy.typing import NDArray
from random_robots import random_robot

from space_robot_model.robot import Robot
from space_robot_model.robot.tree import Encoder, Gear
from space_robot_msgs_py.errors import DivergedError, InputError
from space_robot_sim.plant.gear_mounting import STABLE, check_rotors, check_springs, measured_motors

Array = NDArray[np.float64]

ROTOR, RATIO, LINK, BASE = 2e-5, 100.0, 0.5, 3.0
MOTOR = RATIO**2 * ROTOR
TWENTY_SECONDS = round(20.0 / PERIOD)


def lighter() -> float:
    """Return ``S^T M^-1 S`` of the deflection S: the square of the pulsation by stiffness."""
    own = RATIO * ROTOR
    mass = np.array([[BASE + LINK, LINK, own], [LINK, LINK, 0.0], [own, 0.0, MOTOR]])
    stretch = np.array([0.0, -1.0, 1.0])
    return float(stretch @ np.linalg.solve(mass, stretch))


def swinging(angle: float, substeps: int = 1) -> Gear:
    """Return the gear whose spring turns by ``angle`` rad in an integrator's step."""
    pulsation = angle / (PERIOD / substeps)
    return Gear(ROTOR, RATIO, pulsation**2 / lighter())


def damped(angle: float) -> Gear:
    """Return a gear without spring to speak of, whose damper's rate is ``angle`` by step."""
    return Gear(ROTOR, RATIO, 1e-3, angle / PERIOD / lighter())


def flown(gear: Gear, substeps: int = 1) -> Array:
    """Return deflections of a flight of 20 s after a stretch of 1e-3 rad, 1000 of them."""
    flight = GearedFlight(oscillator(gear, LINK, BASE), substeps)
    flight.motor_positions[0], deflections = 1e-3, []
    for _ in range(1000):
        truth = flight.rest(TWENTY_SECONDS // 1000)
        deflections.append(truth.motor_positions[0] - truth.joint_positions[0])
    return np.array(deflections)


def test_a_spring_just_below_the_limit_flies_stably() -> None:
    deflections = flown(swinging(STABLE * (1.0 - 1e-6)))
    assert np.abs(deflections).max() <= 1e-3


@pytest.mark.parametrize("excess", [1.0 + 1e-6, 1.5, 4.1, 9.7])
def test_one_just_above_is_refused_with_the_substeps_that_do(excess: float) -> None:
    """They are as few as would, and it flies stably with them, or with the shorter period."""
    gear = swinging(STABLE * excess)
    robot = oscillator(gear, LINK, BASE)
    with pytest.raises(InputError) as refused:
        GearedFlight(robot)
    message, pulsation = str(refused.value), STABLE * excess / PERIOD
    assert "\n" not in message
    for part in ("drive.stiffness of 'joint'", "steps of 0.0005 s", f"{pulsation:.4g} rad/s"):
        assert part in message
    advice = re.search(r"substeps: (\d+) or a period of (\S+) s would do", message)
    assert advice
    substeps, period = int(advice[1]), float(advice[2])
    assert substeps == int(excess) + 1
    assert 0.99 * PERIOD / excess < period <= PERIOD / excess
    check_springs(robot, np.zeros(1), period, 1)
    assert np.abs(flown(gear, substeps)).max() <= 1e-3
    if substeps > 1:
        with pytest.raises(InputError, match=rf"substeps: {substeps} or"):
            GearedFlight(robot, substeps - 1)


def test_the_advice_counts_from_the_substeps_that_there_are() -> None:
    """For a tick that is cut already, the substeps of the whole tick are named."""
    gear = swinging(STABLE * 1.2, substeps=3)
    with pytest.raises(InputError, match=r"steps of 0\.000166667 s.*substeps: 4 or"):
        GearedFlight(oscillator(gear, LINK, BASE), 3)
    GearedFlight(oscillator(gear, LINK, BASE), 4)


def test_a_damper_may_be_what_is_too_strong() -> None:
    with pytest.raises(InputError, match=r"drive\.damping of 'joint'"):
        GearedFlight(oscillator(damped(STABLE * 1.01), LINK, BASE))
    GearedFlight(oscillator(damped(STABLE * 0.99), LINK, BASE))


def both(angle: float) -> Gear:
    """Return a gear whose spring turns by ``angle`` rad by step, at a damping ratio of 0.54."""
    spring = swinging(angle)
    return spring._replace(damping=2.0 * 0.54 * np.sqrt(spring.stiffness / lighter()))


@pytest.mark.parametrize(
    ("make", "edge"), [(swinging, np.sqrt(8.0)), (damped, 2.785294), (both, 2.6156)]
)
def test_the_limit_is_the_methods(make: Callable[[float], Gear], edge: float) -> None:
    """A swing is stable up to ``2 sqrt(2)`` a step, a decay up to 2.785, and less in between."""
    assert edge > STABLE
    for angle, is_stable in ((edge * 0.998, True), (edge * 1.002, False)):
        flight = GearedFlight(oscillator(make(angle), LINK, BASE), 4)
        flight.plant.memory.substeps = 1.0
        flight.motor_positions[0] = flight.motor_velocities[0] = 1e-3
        if is_stable:
            truth = flight.rest(TWENTY_SECONDS)
            assert abs(truth.motor_velocities[0] - truth.joint_velocities[0]) < 0.1
        else:
            with pytest.raises(DivergedError):
                flight.rest(TWENTY_SECONDS)


def test_within_the_limit_every_decaying_motion_is_stable() -> None:
    """``|1 + z + z^2/2 + z^3/6 + z^4/24| <= 1`` for all z of the left half-plane up to it."""
    z = STABLE * np.exp(1j * np.linspace(0.5 * np.pi, np.pi, 10_001))
    growth = np.abs(1.0 + z * (1.0 + z / 2.0 * (1.0 + z / 3.0 * (1.0 + z / 4.0))))
    assert growth.max() <= 1.0


def test_the_stiffest_joint_is_named() -> None:
    robot = random_robot(np.random.default_rng(1), 3)
    gears = [
        Gear(0.01 * rotor_room(robot, joint), 10.0, stiffness)
        for joint, stiffness in enumerate((1e3, 1e8, 1e4))
    ]
    robot = with_gears(robot, gears)
    with pytest.raises(InputError, match=r"drive\.stiffness of 'joint2'"):
        GearedFlight(robot)
    GearedFlight(with_gears(robot, [gears[0], None, gears[2]]))


def carried(*shares: float) -> Robot:
    """Return a robot whose joints are all on the base, with rotors of shares of its inertia."""
    base = {"mass": 10.0, "inertia": [2.0, 2.0, 2.0, 0.0, 0.0, 0.0]}
    link = {"mass": 1.0, "inertia": [1.0] * 3 + [0.0] * 3, "com": [0.0] * 3, "parent": "base"}
    links = [{"name": f"joint{k + 1}", **link} for k in range(len(shares))]
    robot = Robot.from_dict({"robot": {"name": "carrier", "base": base, "links": links}})
    return with_gears(robot, [Gear(2.0 * s, 1.0, 10.0) if s else None for s in shares])


def test_rotors_must_have_less_inertia_than_their_carriers() -> None:
    check_rotors(carried(0.999))
    check_rotors(carried(0.5, 0.0, 0.499))
    for shares, names in (
        ((1.0,), "joint1"),
        ((0.6, 0.6), "joint1, joint2"),
        ((0.6, 0.0, 0.5), "joint1, joint3"),
    ):
        with pytest.raises(InputError) as refused:
            GearedFlight(carried(*shares))
        message, least = str(refused.value), 2.0 * (1.0 - sum(shares))
        assert f"drive.rotor_inertia of {names}: the inertia of 'base'" in message
        assert message.endswith(f"smallest principal moment is {least:g} kg m2")
        assert "\n" not in message


def test_rotors_across_one_another_do_not_add_up() -> None:
    """Of two joints with axes at right angles each rotor may have nearly all that there is."""
    base = {"mass": 10.0, "inertia": [2.0, 2.0, 2.0, 0.0, 0.0, 0.0]}
    link = {"mass": 1.0, "inertia": [1.0] * 3 + [0.0] * 3, "com": [0.0] * 3, "parent": "base"}
    links = [{"name": f"joint{k}", "alpha_deg": 90.0 * k, **link} for k in range(2)]
    robot = Robot.from_dict({"robot": {"name": "carrier", "base": base, "links": links}})
    robot = with_gears(robot, [Gear(1.9, 1.0, 10.0)] * 2)
    check_rotors(robot)
    GearedFlight(robot).fly([0.0, 0.0, 0.0, 1.0, -1.0], 100)


def test_encoders_on_the_motors_side_know_their_motors() -> None:
    robot = carried(0.1, 0.0, 0.1, 0.1)
    kinds: tuple[Encoder, ...] = ("motor", "link", "link", "both")
    gears = [
        gear and gear._replace(encoder=kind) for gear, kind in zip(robot.gears, kinds, strict=True)
    ]
    assert measured_motors(with_gears(robot, gears)) == [1, 0, 0, 0]
    gears[3] = gears[0]
    assert measured_motors(with_gears(robot, gears)) == [1, 0, 0, 3]
    assert not any(measured_motors(with_gears(robot, [None] * 4)))
