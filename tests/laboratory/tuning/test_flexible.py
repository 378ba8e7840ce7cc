"""Stability with gears: springs against formulas and Pinocchio, growth against flights."""

from __future__ import annotations

import copy
import itertools
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
import scipy.linalg
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from oracles.rotors import (
    order_of,
    pinocchio_motion,
    pinocchio_with_rotors,
    random_motor_rotors,
    turns,
)
from robots import HEAVY, REFLECTED, oscillator
from strategies import State, random_gears, random_robot, with_gears

from space_robot.flight.plan import Flight, FlightPlan, resolve
from space_robot.flight.simulate import simulate
from space_robot.tuning.flexible import (
    FlexibleCheck,
    FlexibleMotions,
    check_flexible,
    joint_frequencies,
)
from space_robot_control.laws import ControlLaw, find_law
from space_robot_control.navigation.low_pass import low_pass_weight
from space_robot_model.robot import Robot
from space_robot_model.robot.find import find_robot
from space_robot_model.robot.gears import geared_joints
from space_robot_model.robot.tree import Encoder, Gear
from space_robot_sim.plant.tick import update_true_state

Array = NDArray[np.float64]

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
@given(
    st.floats(1e-5, 1e-2),
    st.floats(1.0, 200.0),
    st.floats(1.0, 1e6),
    st.floats(1e-2, 1e3),
    st.sampled_from(["revolute", "prismatic"]),
)
def test_on_a_heavy_base_a_spring_has_the_frequency_of_two_masses(
    rotor: float, ratio: float, stiffness: float, link: float, joint: str
) -> None:
    """``sqrt(K (1 / B + 1 / I)) / 2 pi``."""
    robot = oscillator(Gear(rotor, ratio, stiffness, 0.7), link, joint=joint)
    expected = np.sqrt(stiffness * (1.0 / (ratio**2 * rotor) + 1.0 / link)) / (2.0 * np.pi)
    found = joint_frequencies(robot, np.array([[0.3], [-2.0]]))
    np.testing.assert_allclose(found, np.full((2, 1), expected), rtol=1e-9)


def test_on_a_light_base_it_is_that_of_three_masses() -> None:
    """Of base, rotor and link about one axis, by hand: the base's inertia holds the rotor's.

    Angles a of the base, b of the link and m of the motor against it have the energy
    ``(I_0 a'^2 + I (a' + b')^2) / 2 + N J a' m' + B m'^2 / 2``.
    """
    ratio, rotor, link, base, stiffness = 50.0, 2e-3, 4.0, 7.0, 900.0
    robot = oscillator(Gear(rotor, ratio, stiffness, 0.0), link, base)
    coupling, reflected = ratio * rotor, ratio**2 * rotor
    mass = np.array([[base + link, link, coupling], [link, link, 0.0], [coupling, 0.0, reflected]])
    spring = np.array([0.0, 1.0, -1.0])
    squares = scipy.linalg.eigh(stiffness * np.outer(spring, spring), mass, eigvals_only=True)
    found = joint_frequencies(robot, np.zeros((1, 1)))
    np.testing.assert_allclose(found, np.sqrt(squares[-1]) / (2.0 * np.pi), rtol=1e-12)


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
    mission = {
        "waypoint_times": [0.0],
        "waypoints_deg": POSTURE_DEG,
        "base_quaternion": quaternion.tolist(),
    }
    plan = FlightPlan(
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
    positions = np.radians([POSTURE_DEG])
    return check_stability(flight.law, flight.plant.robot, positions, corner, flight.controls_base)


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


def small_law(h_bar: float, **gains: float) -> ControlLaw:
    """Return a law of one joint on a base that is not asked for much."""
    values = {"h_bar": h_bar, "lambda": 1e-3, "g": NOTHING, **gains}
    return find_law("tde_smc")({k: np.full(4, v) for k, v in values.items()}, PERIOD)


B = 2.0
"""N^2 J, kg m2."""


def heavy_link(encoder: Encoder = "motor", stiffness: float = 2e3, damping: float = 1.0) -> Robot:
    """Return a motor of B on a spring, with a link that it does not move."""
    gear = Gear(B / 1e4, 100.0, stiffness, damping, encoder)
    return oscillator(gear, 1e4, HEAVY)


@pytest.mark.parametrize("h_bar", [0.5, 3.0])
@pytest.mark.parametrize("controls_base", [True, False])
def test_on_the_motor_h_bar_may_be_twice_the_rotors_inertia(
    h_bar: float, controls_base: bool
) -> None:
    """``B a_k = F_k``, ``F_k = F_k-1 - h_bar a_k-1`` alternates, and grows above h_bar = 2 B."""
    check = check_stability(small_law(h_bar), heavy_link(), np.zeros((1, 1)), 0.0, controls_base)
    assert check.largest_h_bar_scale is not None
    assert check.largest_h_bar_scale * h_bar == pytest.approx(2.0 * B, rel=0.01)
    assert check.is_stable
    assert check.largest_corner_hz is None


@pytest.mark.parametrize("corner_hz", [20.0, 100.0, 400.0])
def test_a_low_pass_of_weight_w_lets_it_be_as_much_larger(corner_hz: float) -> None:
    weight = 1.0 - np.exp(-2.0 * np.pi * corner_hz * PERIOD)
    positions = np.zeros((1, 1))
    check = check_stability(small_law(0.5), heavy_link(), positions, corner_hz, True)
    assert check.largest_h_bar_scale is not None
    assert check.largest_h_bar_scale * 0.5 == pytest.approx(2.0 * B / weight, rel=0.01)


@pytest.mark.parametrize("factor", [3.0, 8.0])
def test_the_largest_bandwidth_is_that_at_which_w_h_bar_is_2_b(factor: float) -> None:
    law, positions = small_law(factor * B), np.zeros((1, 1))
    check = check_stability(law, heavy_link(), positions, 0.0, True)
    assert not check.is_stable
    assert check.radius == pytest.approx(factor - 1.0, rel=0.01)
    assert check.largest_corner_hz is not None
    weight = low_pass_weight(check.largest_corner_hz, PERIOD)
    assert weight * factor == pytest.approx(2.0, rel=0.01)


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


def test_what_no_low_pass_and_no_h_bar_helps_has_limits_of_0(paper_robot: Robot) -> None:
    """Links seen through springs without damping."""
    robot = flexible_arm(paper_robot, 1e4, "link")
    values = {"h_bar": np.array(H_BAR), "lambda": np.full(9, 50.0), "g": np.full(9, 0.1)}
    law = find_law("tde_smc")(values, PERIOD)
    check = check_stability(law, robot, np.radians([POSTURE_DEG]), 0.0, True)
    assert (check.is_stable, check.largest_corner_hz, check.largest_h_bar_scale) == (
        False,
        0.0,
        0.0,
    )


@pytest.mark.parametrize(("k_d", "is_stable"), [(2.0, True), (40.0, False)])
def test_a_law_without_an_estimate_has_no_limits(
    paper_robot: Robot, k_d: float, is_stable: bool
) -> None:
    """Slow computed torque leaves a damped spring alone."""
    robot = flexible_arm(paper_robot, 2e4, "link", 200.0)
    gains = {"k_p": np.full(9, k_d**2 / 4.0), "k_d": np.full(9, k_d)}
    check = check_stability(
        find_law("ctc")(gains, PERIOD), robot, np.radians([POSTURE_DEG]), 0.0, True
    )
    assert check.is_stable is is_stable
    assert (check.largest_corner_hz, check.largest_h_bar_scale) == (None, None)


def test_the_worst_configuration_counts(paper_robot: Robot) -> None:
    robot, law = flexible_arm(paper_robot, 2e4, "link"), find_law("ctc")
    gains = {"k_p": np.full(9, 400.0), "k_d": np.full(9, 40.0)}
    positions = np.radians([POSTURE_DEG, [30.0, 100.0, 150.0, 90.0, 30.0, -50.0], [0.0] * 6])
    radii = [
        check_stability(law(gains, PERIOD), robot, some, 0.0, True).radius
        for some in (positions[:1], positions[1:2], positions[2:], positions)
    ]
    assert len(set(radii[:3])) == 3
    assert radii[3] == max(radii[:3])


def test_both_encoders_let_the_law_see_the_link(paper_robot: Robot) -> None:
    gains = {"k_p": np.full(9, 400.0), "k_d": np.full(9, 40.0)}
    radii = [
        check_stability(
            find_law("ctc")(gains, PERIOD),
            flexible_arm(paper_robot, 2e4, encoder),
            np.radians([POSTURE_DEG]),
            0.0,
            True,
        ).radius
        for encoder in ("link", "both", "motor")
    ]
    assert radii[0] == radii[1] != radii[2]


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


@settings(max_examples=5, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_checks_change_nothing_and_are_repeated_to_the_bit(seed: int) -> None:
    rng = np.random.default_rng(seed)
    robot = random_gears(rng, random_robot(rng, 3))
    values = {"h_bar": rng.uniform(0.1, 10.0, 6), "lambda": np.ones(6), "g": np.full(6, 0.1)}
    law, positions = find_law("tde_smc")(values, PERIOD), rng.uniform(-2.0, 2.0, (2, 3))
    before = copy.deepcopy(law.gain_values)
    one, other = (
        check_stability(law, replace(robot), positions, corner, base)
        for corner, base in itertools.repeat((5.0, True), 2)
    )
    assert one == other
    for name, value in law.gain_values.items():
        np.testing.assert_array_equal(value, before[name])
