"""Motors of wheels: limits of torque and momentum, what the base gets, and motors that die."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from actuator_bench import PERIOD, Bench, N
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

Array = NDArray[np.float64]

PYRAMID = [1.0, 1.0, 1.0, -1.0, 1.0, 1.0, -1.0, -1.0, 1.0, 1.0, -1.0, 1.0]
WHEELS: dict[str, Any] = {
    "axes": PYRAMID,
    "rotor_inertia": [0.1],
    "max_torque": [0.4],
    "max_momentum": [8.0],
}
SEEDS = st.integers(0, 2**31 - 1)


def bench(*faults: str, more: Any = None, **wheels: Any) -> Bench:
    return Bench(*faults, base_actuation="hardware", wheels={**WHEELS, **wheels}, **(more or {}))


def axes(found: Bench) -> Array:
    wheels: Array = found.settings.wheels.unit_axes
    return wheels


@given(SEEDS)
def test_the_base_gets_what_the_wheels_lose(seed: int) -> None:
    found, rng = bench(), np.random.default_rng(seed)
    for _ in range(20):
        found.truth.wheel_velocities[:4] = rng.uniform(-90, 90, 4)
        asked = rng.normal(size=4)
        reported, torque = found.act(np.array([*rng.normal(size=N + 3), *asked]))
        given_torques = found.truth.wheel_torques[:4]
        momentum = 0.1 * found.truth.wheel_velocities[:4]
        upper = np.minimum(0.4, np.maximum(0.0, 8.0 - momentum) / PERIOD)
        lower = -np.minimum(0.4, np.maximum(0.0, 8.0 + momentum) / PERIOD)
        np.testing.assert_array_equal(given_torques, np.clip(asked, lower, upper))
        np.testing.assert_allclose(torque[:3], -given_torques @ axes(found), atol=1e-15)
        np.testing.assert_array_equal(reported, torque)
        np.testing.assert_array_equal(found.record.base_wrench, np.zeros(6))
        np.testing.assert_array_equal(found.measured.wheel_torques, found.truth.wheel_torques)


@given(SEEDS)
def test_a_wheel_is_pushed_up_to_its_momentum_and_no_further(seed: int) -> None:
    """Held there against its friction, too; and it can always be slowed down."""
    found, rng, speed = bench(), np.random.default_rng(seed), np.zeros(4)
    period, inertia, friction = found.period, 0.1, 0.01
    asked = rng.choice([-1.0, 1.0], 4) * rng.uniform(0.1, 1.0, 4)
    found.truth.wheel_velocities[:4] = speed = -np.sign(asked) * rng.uniform(79.0, 80.5, 4)
    found.ask(*asked)
    assert (np.sign(found.truth.wheel_torques[:4]) == np.sign(asked)).all()
    found.truth.wheel_velocities[:4] = speed = np.sign(asked) * rng.uniform(79.999, 80.0, 4)
    for _ in range(50):
        found.truth.wheel_velocities[:4] = speed
        found.ask(*asked)
        torque = found.truth.wheel_torques[:4] - friction * np.sign(speed)
        speed = speed + period * torque / inertia
        assert (inertia * np.abs(speed) <= 8.0 + 1e-12).all()
    np.testing.assert_allclose(found.truth.wheel_torques[:4], 0.01 * np.sign(asked), atol=1e-9)
    assert (found.record.wheels.saturated[:4] == 1.0).all()


def test_saturation_is_counted_wheel_by_wheel_and_a_tick_once() -> None:
    found = bench(more={"joint_torque_limit": 1.0})
    found.ask(0.5, 0.399, -0.4, 0.0)
    found.act(np.array([*np.zeros(3), *np.full(N, 2.0), 0.5, 0.0, 0.0, 0.0]))
    found.ask(0.0, 0.0, 0.0, 0.0)
    assert found.record.wheels.saturated_ticks[:5].tolist() == [2.0, 0.0, 1.0, 0.0, 0.0]
    assert found.record.wheels.saturated[:4].tolist() == [0.0, 0.0, 0.0, 0.0]
    assert found.record.saturated_ticks == 2.0


def test_a_full_wheel_is_saturated_if_it_is_asked_for_more() -> None:
    found = bench()
    found.truth.wheel_velocities[:4] = [80.0, 80.0, 80.0, -80.0]
    found.ask(0.0, -0.1, 0.1, -0.1)
    assert found.record.wheels.saturated[:4].tolist() == [0.0, 0.0, 1.0, 1.0]
    assert found.truth.wheel_torques[:4].tolist() == [0.0, -0.1, 0.0, 0.0]


def test_without_limits_a_wheel_gives_what_it_is_asked() -> None:
    found = bench(max_torque=[0.0], max_momentum=[0.0])
    found.truth.wheel_velocities[:4] = 1e9
    found.ask(1e6, -1e6, 3.0, 0.0)
    assert found.truth.wheel_torques[:4].tolist() == [1e6, -1e6, 3.0, 0.0]


def test_a_dead_motor_gives_nothing_for_its_time() -> None:
    found = bench("wheel_fail@0.001-0.002:2", "wheel_fail@0.0015:wheel_3")
    given_torques = []
    for _ in range(6):
        found.ask(0.1, 0.2, 0.3, 0.9)
        given_torques.append(found.truth.wheel_torques[:4].tolist())
    full = [0.1, 0.2, 0.3, 0.4]
    assert given_torques == [
        full,
        full,
        [0.1, 0.0, 0.3, 0.4],
        [0.1, 0.0, 0.0, 0.4],
        [0.1, 0.2, 0.0, 0.4],
        [0.1, 0.2, 0.0, 0.4],
    ]


def test_commands_to_wheels_are_late_as_all_others() -> None:
    found = bench(more={"command_latency_ticks": 3})
    for tick in range(6):
        found.act(np.array([*np.zeros(3), *np.full(N, tick + 1.0), 0.01 * (tick + 1), 0, 0, 0]))
        late = max(0, tick - 2)
        assert found.truth.wheel_torques[0] == 0.01 * late
        assert found.truth.applied_torque[3] == late


def test_the_echo_of_a_base_with_wheels_is_of_what_they_gave() -> None:
    """Drives of base axes have nothing to act on; joints keep theirs."""
    more = {"drive_scale": [0.5], "drive_bias": [0.1], "echo_scale": [2.0], "echo_bias": [0.25]}
    found = bench(more=more)
    reported, torque = found.act(np.array([9.0, 9.0, 9.0, *np.full(N, 4.0), 0.3, 0, 0, 0]))
    np.testing.assert_allclose(torque[:3], -0.3 / np.sqrt(3.0), rtol=1e-15)
    np.testing.assert_allclose(torque[3:], 2.1)
    np.testing.assert_allclose(reported[:3], 2.0 * torque[:3] + 0.25)
    np.testing.assert_allclose(reported[3:], 8.25)
    assert found.record.saturated_ticks == 0.0


def test_a_base_without_actuators_gets_nothing() -> None:
    found = Bench(base_actuation="none", drive_bias=[1.0])
    reported, torque = found.act(np.full(N + 3, 3.0))
    assert torque.tolist() == [0.0, 0.0, 0.0, 4.0, 4.0, 4.0, 4.0, 4.0, 4.0]
    assert reported.tolist() == [0.0, 0.0, 0.0, *np.full(N, 3.0)]
    assert not found.record.base_wrench.any()


@pytest.mark.parametrize("actuation", ["ideal", "hardware"])
def test_the_wrench_on_an_ideal_base_is_its_torque(actuation: str) -> None:
    found = Bench() if actuation == "ideal" else bench()
    _, torque = found.act(np.array([1.0, 2.0, 3.0, *np.zeros(N)]))
    expected = [0.0, 0.0, 0.0, 1.0, 2.0, 3.0] if actuation == "ideal" else np.zeros(6).tolist()
    assert found.record.base_wrench.tolist() == expected
    assert torque[:3].tolist() == expected[3:]
