"""Stability with gears: springs against formulas and Pinocchio, growth against flights."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
import scipy.linalg
from hypothesis import given, settings
from hypothesis import strategies as st
from oracles.rotors import (
    order_of,
    pinocchio_motion,
    pinocchio_with_rotors,
    random_motor_rotors,
    turns,
)
from robots import REFLECTED
from strategies import State, random_gears, random_robot, with_gears

from space_robot.flight.plan import Flight, Scenario, resolve
from space_robot.flight.simulate import simulate
from space_robot.tuning.flexible import (
    FlexibleCheck,
    FlexibleMotions,
    check_flexible,
    joint_frequencies,
)
from space_robot_control.laws import ControlLaw, find_law
from space_robot_model.elementary.matrices import Array
from space_robot_model.robot import Robot
from space_robot_model.robot.find import find_robot
from space_robot_model.robot.gears import geared_joints
from space_robot_model.robot.parts import Encoder, Gear
from space_robot_sim.plant.tick import update_true_state

PERIOD = 5e-4
UPRIGHT = np.array([1.0, 0.0, 0.0, 0.0])
TURNED = np.array([0.6, 0.48, -0.4, 0.4964])
HALF_A_TURN = np.array([0.0, 0.8, 0.0, -0.6])
POSTURE_DEG = [0.0, 120.0, 220.0, 0.0, -10.0, 0.0]
H_BAR = [50.0] * 3 + [5.0] * 3 + [0.5] * 3
NOTHING = 1e-12
"""A switching gain, N m, that does nothing beside oscillations of 1e-9 rad."""
FEW = settings(max_examples=25, deadline=None)


@FEW
@given(st.integers(0, 2**32 - 1), st.integers(1, 6))
def test_springs_swing_as_pinocchios_rotors_do(seed: int, joints: int) -> None:
    """Of arms of any shape: each spring by itself, the other motors bound to their joints."""
    rng = np.random.default_rng(seed)
    robot = random_gears(rng, random_robot(rng, joints))
    positions = rng.uniform(-3.0, 3.0, (2, robot.joint_count))
    found = joint_frequencies(robot, positions)
    geared, rotors = geared_joints(robot), random_motor_rotors(rng, robot)
    assert found.shape == (2, len(geared))
    model, order, scale = pinocchio_with_rotors(robot, rotors), order_of(robot), turns(robot)
    for row, theta in enumerate(positions):
        state = State(UPRIGHT, theta, np.zeros(3), np.zeros(3), np.zeros(len(theta)))
        configuration, _ = pinocchio_motion(robot, state, np.zeros(len(rotors)))
        # by rnea: crba needs joints that are numbered branch by branch
        rest, data = np.zeros(model.nv), model.createData()
        columns = [pin.rnea(model, data, configuration, rest, unit) for unit in np.eye(model.nv)]
        whole = np.column_stack([column.copy() for column in columns])
        inertia = np.zeros_like(whole)
        inertia[np.ix_(order, order)] = whole
        inertia *= np.outer(scale, scale)
        for k, joint in enumerate(geared):
            free = [*range(6 + robot.joint_count), 6 + robot.joint_count + k]
            bound = np.eye(len(inertia))[:, free]
            for other, moved in enumerate(geared):
                if other != k:
                    bound[6 + robot.joint_count + other, 6 + moved] = 1.0
            gear, spring = robot.gears[joint], np.zeros(len(free))
            assert gear
            spring[6 + joint], spring[-1] = 1.0, -1.0
            squares = scipy.linalg.eigh(
                gear.stiffness * np.outer(spring, spring),
                bound.T @ inertia @ bound,
                eigvals_only=True,
            )
            expected = np.sqrt(squares[-1]) / (2.0 * np.pi)
            assert found[row, k] == pytest.approx(expected, rel=1e-6)


def flexible_arm(
    paper_robot: Robot, stiffness: float, encoder: Encoder, damping: float = 0.0
) -> Robot:
    """Return the paper's robot with gears, a fifth as stiff in the wrist."""
    shares = (1.0, 1.0, 1.0, 0.2, 0.2, 0.2)
    gears = [
        Gear(reflected / 1e4, 100.0, stiffness * share, damping * share, encoder)
        for reflected, share in zip(REFLECTED, shares, strict=True)
    ]
    return with_gears(paper_robot, gears)


def held_flight(
    paper_robot: Robot,
    robot: Robot,
    law: str,
    gains: Mapping[str, Any],
    quaternion: Array = UPRIGHT,
    base_rate: float = 0.0,
    **options: Any,
) -> Flight:
    """Return a flight that holds a posture, begun with motors that move by some 1e-9 rad/s.

    ``base_rate``: of the base at the start about each axis, rad/s.
    """
    mission = {"joints_deg": POSTURE_DEG, "base_quaternion": quaternion.tolist()}
    plan = Scenario(
        controller=law,
        gains=dict(gains),
        robot=paper_robot,
        plant_robot=robot,
        friction=False,
        mission=mission,
        **options,
    )
    flight = Flight(resolve(plan))
    plant, n = flight.plant, robot.joint_count
    plant.memory.x[10 + n : 13 + n] += base_rate
    plant.memory.x[13 + 2 * n : 13 + 2 * n + 6] += 1e-9 * np.random.default_rng(4).normal(size=6)
    update_true_state(plant.block, 0, plant.period)
    plant.begin_tick(0)
    return flight


def check_stability(
    law: ControlLaw, robot: Robot, positions: Array, corner_hz: float, controls_base: bool
) -> FlexibleCheck:
    """Check a law on a robot's motions about some positions (K, n)."""
    motions = FlexibleMotions(robot, positions, law.period, controls_base)
    return check_flexible(law, motions, corner_hz)


def checked(flight: Flight) -> FlexibleCheck:
    corner = flight.controller_settings.acceleration_filter_hz
    robot, positions = flight.plant.robot, np.radians([POSTURE_DEG])
    return check_stability(flight.law, robot, positions, corner, flight.controls_base)


def growth(signals: Array, skipped: int = 1) -> float:
    """Return the largest factor by which signals (N, c) go on from tick to tick.

    By the modes of the second half: ``x_k+1 = A x_k`` of every ``skipped``-th row and those behind
    it, in the space that they span to 1e-7.
    """
    rows = signals[len(signals) // 2 :: skipped]
    rows = rows / np.abs(rows).max()
    delays = 6
    states = np.hstack([rows[k : len(rows) - delays + k] for k in range(delays)]).T
    left, sizes, right = np.linalg.svd(states[:, :-1], full_matrices=False)
    count = int((sizes > 1e-7 * sizes[0]).sum())
    step = (left[:, :count].T @ states[:, 1:] @ right[:count].T) / sizes[:count]
    return float(np.abs(np.linalg.eigvals(step)).max() ** (1.0 / skipped))


CTC = {"k_p": [400.0], "k_d": [40.0]}
SMC = {"lambda": [1.0], "g": [NOTHING]}

GROWING: dict[str, tuple[Encoder, str, dict[str, Any], dict[str, Any]]] = {
    "computed torque, links seen": ("link", "ctc", CTC, {"duration": 1.2}),
    "the same on a free base": ("link", "ctc", CTC, {"duration": 1.2, "actuators": "none"}),
    "time delay, links seen": ("link", "tde_smc", {**SMC, "h_bar": H_BAR}, {"duration": 0.12}),
    "with a low-pass": (
        "link",
        "tde_smc",
        {**SMC, "h_bar": H_BAR},
        {"duration": 2.0, "parameters": {"controller": {"acceleration_filter_hz": 3.0}}},
    ),
    "boundary layer": (
        "link",
        "ctc_smc",
        {"lambda": [20.0], "g": [50.0], "delta": [0.5]},
        {"duration": 0.36},
    ),
}


@pytest.mark.parametrize("case", GROWING.values(), ids=GROWING)
def test_small_oscillations_grow_in_flight_as_predicted(
    paper_robot: Robot, case: tuple[Encoder, str, dict[str, Any], dict[str, Any]]
) -> None:
    """Of the real plant under the real law: the growth's logarithm to 1e-4."""
    encoder, law, gains, options = case
    robot = flexible_arm(paper_robot, 2e4, encoder)
    flight = held_flight(paper_robot, robot, law, gains, **options)
    check = checked(flight)
    assert not check.is_stable
    log = simulate(flight)
    deflection = log.motor_positions - log.joint_positions
    assert 1e-8 < np.abs(deflection[-1]).max() < 1e-3
    measured = growth(deflection, 2)
    assert np.log(measured) == pytest.approx(np.log(check.radius), rel=1e-4)


@pytest.mark.parametrize("quaternion", [UPRIGHT, TURNED, HALF_A_TURN])
def test_a_base_whose_h_bar_is_too_large_grows_as_predicted(
    paper_robot: Robot, quaternion: Array
) -> None:
    """However it is turned, in the coordinates from its desired attitude."""
    unit = quaternion / np.linalg.norm(quaternion)
    robot = flexible_arm(paper_robot, 2e4, "motor")
    gains = {**SMC, "h_bar": [6500.0, 700.0, 500.0, *H_BAR[3:]]}
    flight = held_flight(
        paper_robot, robot, "tde_smc", gains, duration=0.04, quaternion=unit, base_rate=1e-9
    )
    check = checked(flight)
    assert not check.is_stable
    assert growth(simulate(flight).omega_base) == pytest.approx(check.radius, rel=1e-4)


def test_at_its_limits_a_law_turns_from_stable_to_unstable(paper_robot: Robot) -> None:
    robot = flexible_arm(paper_robot, 1e5, "link", 20.0)
    values = {"h_bar": np.array(H_BAR), "lambda": np.ones(9), "g": np.full(9, 0.1)}
    law, positions = find_law("tde_smc")(values, PERIOD), np.radians([POSTURE_DEG])

    def check(law: ControlLaw, corner_hz: float) -> FlexibleCheck:
        return check_stability(law, robot, positions, corner_hz, True)

    first = check(law, 0.0)
    assert not first.is_stable
    corner, scale = first.largest_corner_hz, first.largest_h_bar_scale
    assert corner is not None
    assert scale is not None
    assert 0.01 < corner < 100.0
    assert 0.0 < scale < 1.0
    assert check(law, 0.999 * corner).is_stable
    assert not check(law, 1.01 * corner).is_stable
    for factor, stable in ((0.999, True), (1.01, False)):
        scaled = {**values, "h_bar": factor * scale * values["h_bar"]}
        other = check(find_law("tde_smc")(scaled, PERIOD), 0.0)
        assert other.is_stable is stable
        assert other.largest_h_bar_scale == pytest.approx(1.0 / factor, rel=2e-3)


def test_stiff_passive_joints_are_none(paper_robot: Robot) -> None:
    """Their motion is part of the loop; the stiffer they are, the less it changes."""
    panels = find_robot("flexible_panels")
    gears = [Gear(reflected / 1e4, 100.0, 2e4, 0.0, "link") for reflected in REFLECTED]
    robot = with_gears(panels, gears[: panels.n])
    gains = {"k_p": np.full(panels.n + 3, 400.0), "k_d": np.full(panels.n + 3, 40.0)}
    law, positions = find_law("ctc")(gains, PERIOD), np.full((1, panels.n), 0.3)

    def radius(robot: Robot) -> float:
        return check_stability(law, robot, positions, 0.0, True).radius

    locked = radius(with_gears(panels.nominal, gears[: panels.n]))
    assert locked > 1.0
    differences = [
        abs(
            radius(
                replace(robot, springs=[s._replace(stiffness=stiffness) for s in panels.springs])
            )
            - locked
        )
        for stiffness in (1e4, 1e6, 1e8)
    ]
    assert differences[0] > 10.0 * differences[1] > 100.0 * differences[2]
