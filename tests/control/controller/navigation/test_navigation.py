"""From measured to estimated states: gaps, jumps in time, bad states, swaps; and the controller."""

from __future__ import annotations

import numpy as np
import pytest
from attitude_sensors import attitude_error, exponential
from closed_loop import NAVIGATION, PERIOD, Loop, law_of
from numpy.typing import NDArray

from space_robot_control.controller.navigation.navigation import (
    LONGEST_BRIDGE,
    Navigation,
    navigate,
)
from space_robot_control.controller.navigation.settings import NavigationFilterSettings
from space_robot_msgs_py.errors import InputError, UnusableStateError
from space_robot_msgs_py.samples import RobotState
from space_robot_sim import Robot

Array = NDArray[np.float64]

OMEGA = np.array([0.02, -0.03, 0.01])
N = 6
SETTINGS = NAVIGATION.model_copy(update={"tracker_delay": 0.01, "rate_filter_hz": 0.0})


def state_at(tick: int) -> RobotState:
    """Of a robot that turns at `OMEGA` with a tracker of 100 Hz, 10 ms late, without noise."""
    state = RobotState.allocate(N)
    t = tick * PERIOD
    taken = max(0, (tick - 20) // 20 * 20) * PERIOD
    state.tick = tick
    state.quaternion[:] = exponential(OMEGA * taken)
    state.omega_base[:] = OMEGA
    state.joint_positions[:] = 0.1 * np.sin(t) + np.arange(N)
    state.joint_velocities[:] = 0.1 * np.cos(t)
    state.applied_torque[:] = 0.0
    return state


def estimates(navigation: Navigation, ticks: list[int]) -> Array:
    """Quaternion, rates and angles after each tick."""
    rows = []
    for tick in ticks:
        navigate(navigation, tick, state_at(tick).block[0], PERIOD)
        e = navigation.estimate
        rows.append(np.r_[e.quaternion, e.omega_base, e.joint_positions, e.joint_velocities])
    return np.array(rows)


def built(**changes: float) -> Navigation:
    return Navigation.build(N, SETTINGS.model_copy(update=changes), PERIOD)


def test_the_estimate_is_of_now_though_the_tracker_is_late() -> None:
    found = estimates(built(), list(range(400)))
    truth = exponential(OMEGA * PERIOD * np.arange(400)[:, None])
    assert np.abs(attitude_error(found[:, :4], truth))[41:].max() < 1e-7
    np.testing.assert_allclose(found[:, 4:7], np.tile(OMEGA, (400, 1)), atol=1e-6)


def test_lost_states_are_bridged() -> None:
    """Up to `LONGEST_BRIDGE` ticks; a tracker's measurement from between is not used."""
    for lost in (1, LONGEST_BRIDGE - 1):
        navigation = built()
        ticks = [k for k in range(600) if not 301 <= k < 301 + lost]
        found = estimates(navigation, ticks)
        truth = exponential(OMEGA * PERIOD * np.array(ticks)[:, None])
        assert np.abs(attitude_error(found[:, :4], truth))[41:].max() < 1e-7
        assert navigation.attitude.updates == (27 if lost == 1 else 26)


def test_after_a_long_gap_the_attitude_begins_anew_and_the_bias_stays() -> None:
    navigation = built()
    estimates(navigation, list(range(400)))
    bias = np.array([1e-4, -2e-4, 3e-4])
    navigation.attitude.bias[:] = bias
    before = navigation.attitude.covariance[3, 3]
    tick = 400 + LONGEST_BRIDGE
    estimates(navigation, [tick])
    np.testing.assert_array_equal(navigation.attitude.bias, bias)
    assert navigation.attitude.covariance[3, 3] > before
    assert navigation.attitude.covariance[0, 3] == 0.0
    late = navigation.estimate.quaternion
    assert np.abs(attitude_error(late, exponential(OMEGA * PERIOD * tick))).max() < 1e-3


@pytest.mark.parametrize("again", [100, 399])
def test_after_a_jump_back_in_time_everything_begins_anew(again: int) -> None:
    """As a filter that has seen nothing, to the last bit."""
    used, fresh = built(), built()
    estimates(used, list(range(400)))
    ticks = list(range(again, again + 100))
    np.testing.assert_array_equal(estimates(used, ticks), estimates(fresh, ticks))


def test_the_torque_of_an_estimate_lags_as_its_rates_do() -> None:
    navigation = built(rate_filter_hz=20.0)
    state = state_at(0)
    for tick in range(3):
        state.applied_torque[:] = float(tick)
        navigate(navigation, tick, state.block[0], PERIOD)
    torque = navigation.estimate.applied_torque
    assert ((torque > 0.0) & (torque < 1.5)).all()
    assert (torque[:3] == torque[0]).all()
    assert (torque[3:] == torque[3]).all()


@pytest.mark.parametrize(
    ("key", "value", "why"),
    [
        ("tracker_delay", 2.0, r"tracker_delay must be at most 4094 ticks, 0.4094 s, got 2 s"),
        ("tracker_boresight", [0.0, 1e-5, 0.0], r"tracker_boresight must have a norm near 1"),
    ],
)
def test_what_does_not_fit_is_refused(key: str, value: object, why: str) -> None:
    with pytest.raises(InputError, match=why):
        Navigation.build(N, NAVIGATION.model_copy(update={key: value}), 1e-4)


# In the controller


def filtered_loop(robot: Robot) -> Loop:
    return Loop(robot, law_of("tde_stc"), navigation=SETTINGS)


@pytest.mark.parametrize("angle", [5e-324, 1e-200, 1e3])
@pytest.mark.parametrize("rate", [0.0, 5e-324, 1e3])
def test_noises_whose_squares_vanish_give_a_filter(angle: float, rate: float) -> None:
    """They count as the least that there is."""
    given = NAVIGATION.model_dump() | {"joint_angle_noise": angle, "joint_rate_noise": rate}
    joints = Navigation.build(6, NavigationFilterSettings(**given), PERIOD).joints
    assert np.isfinite(joints.angle_gain).all()
    assert np.isfinite(joints.rate_gain).all()


@pytest.mark.parametrize(("field", "value"), [("quaternion", 1.1), ("omega_base", np.nan)])
def test_an_unusable_state_leaves_the_filter_as_it_is(
    paper_robot: Robot, field: str, value: float
) -> None:
    shown, spared = filtered_loop(paper_robot), filtered_loop(paper_robot)
    for loop in (shown, spared):
        loop.fly(50)
    state = shown.plant.state.copy()
    getattr(state, field)[0] = value
    with pytest.raises(UnusableStateError):
        shown.controller.update(state, shown.references.at(50))
    assert shown.controller.block["navigation"].tobytes() == (
        spared.controller.block["navigation"].tobytes()
    )
    np.testing.assert_array_equal(shown.fly(20)[1], spared.fly(20)[1])


def test_a_law_that_takes_over_finds_the_filter_as_it_is(paper_robot: Robot) -> None:
    loop, other = filtered_loop(paper_robot), filtered_loop(paper_robot)
    for one in (loop, other):
        one.fly(200)
    before = loop.controller.block["navigation"].copy()
    loop.controller.law = law_of("ctc")
    assert loop.controller.block["navigation"].tobytes() == before.tobytes()


def test_with_perfect_sensors_the_filter_hardly_matters(paper_robot: Robot) -> None:
    """A tracker in every tick, without delay: errors stay below 1e-6."""
    perfect = NAVIGATION.model_copy(update={"tracker_delay": 0.0})
    loop = Loop(paper_robot, law_of("tde_stc"), navigation=perfect)
    errors, _ = loop.fly(2000)
    truth = loop.plant.state.copy()
    loop.fly(1)
    estimate = loop.controller.block[0].navigation.estimate
    assert np.abs(errors).max() < 1e-5
    assert np.abs(attitude_error(estimate.quaternion, truth.quaternion)).max() < 1e-7
    np.testing.assert_allclose(estimate.joint_positions, truth.joint_positions, atol=1e-7)
