"""Wheels, thrusters and magnetic torquers: limits, what the base gets, what fails, and the tank."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from benches import PERIOD, N
from benches import WHEEL_AXES as PYRAMID
from benches import ActuatorBench as Bench
from hypothesis import given
from hypothesis import strategies as st
from strategies import SEEDS

from space_robot_model.elementary.matrices import Array
from space_robot_msgs_py.samples import MOST_TORQUERS

WHEELS: dict[str, Any] = {
    "axes": PYRAMID,
    "rotor_inertia": [0.1],
    "max_torque": [0.4],
    "max_momentum": [8.0],
}


def wheels(*faults: str, more: Any = None, **wheels: Any) -> Bench:
    return Bench(*faults, base_actuation="hardware", wheels={**WHEELS, **wheels}, **(more or {}))


@given(SEEDS)
def test_the_base_gets_what_the_wheels_lose(seed: int) -> None:
    found, rng = wheels(), np.random.default_rng(seed)
    axes = found.settings.wheels.unit_axes
    for _ in range(20):
        found.truth.wheel_velocities[:4] = rng.uniform(-90, 90, 4)
        asked = rng.normal(size=4)
        reported, torque = found.act(np.array([*rng.normal(size=N + 3), *asked]))
        given_torques = found.truth.wheel_torques[:4]
        momentum = 0.1 * found.truth.wheel_velocities[:4]
        upper = np.minimum(0.4, np.maximum(0.0, 8.0 - momentum) / PERIOD)
        lower = -np.minimum(0.4, np.maximum(0.0, 8.0 + momentum) / PERIOD)
        np.testing.assert_array_equal(given_torques, np.clip(asked, lower, upper))
        np.testing.assert_allclose(torque[:3], -given_torques @ axes, atol=1e-15)
        np.testing.assert_array_equal(reported, torque)
        np.testing.assert_array_equal(found.record.base_wrench, np.zeros(6))
        np.testing.assert_array_equal(found.measured.wheel_torques, found.truth.wheel_torques)


@given(SEEDS)
def test_a_wheel_is_pushed_up_to_its_momentum_and_no_further(seed: int) -> None:
    """Held there against its friction, too; and it can always be slowed down."""
    found, rng, speed = wheels(), np.random.default_rng(seed), np.zeros(4)
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
    found = wheels(more={"joint_torque_limit": 1.0})
    found.ask(0.5, 0.399, -0.4, 0.0)
    found.act(np.array([*np.zeros(3), *np.full(N, 2.0), 0.5, 0.0, 0.0, 0.0]))
    found.ask(0.0, 0.0, 0.0, 0.0)
    assert found.record.wheels.saturated_ticks[:5].tolist() == [2.0, 0.0, 1.0, 0.0, 0.0]
    assert found.record.wheels.saturated[:4].tolist() == [0.0, 0.0, 0.0, 0.0]
    assert found.record.saturated_ticks == 2.0


def test_a_dead_motor_gives_nothing_for_its_time() -> None:
    found = wheels("wheel_fail@0.001-0.002:2", "wheel_fail@0.0015:wheel_3")
    for second, third in ((0.2, 0.3), (0.2, 0.3), (0.0, 0.3), (0.0, 0.0), (0.2, 0.0)):
        found.ask(0.1, 0.2, 0.3, 0.9)
        assert found.truth.wheel_torques[:4].tolist() == [0.1, second, third, 0.4]


def test_commands_to_wheels_are_late_as_all_others() -> None:
    found = wheels(more={"command_latency_ticks": 3})
    for tick in range(6):
        found.act(np.array([*np.zeros(3), *np.full(N, tick + 1.0), 0.01 * (tick + 1), 0, 0, 0]))
        late = max(0, tick - 2)
        assert found.truth.wheel_torques[0] == 0.01 * late
        assert found.truth.applied_torque[3] == late


def test_the_echo_of_a_base_with_wheels_is_of_what_they_gave() -> None:
    """Drives of base axes have nothing to act on; joints keep theirs."""
    more = {"drive_scale": [0.5], "drive_bias": [0.1], "echo_scale": [2.0], "echo_bias": [0.25]}
    found = wheels(more=more)
    reported, torque = found.act(np.array([9.0, 9.0, 9.0, *np.full(N, 4.0), 0.3, 0, 0, 0]))
    np.testing.assert_allclose(torque[:3], -0.3 / np.sqrt(3.0), rtol=1e-15)
    np.testing.assert_allclose(torque[3:], 2.1)
    np.testing.assert_allclose(reported[:3], 2.0 * torque[:3] + 0.25)
    np.testing.assert_allclose(reported[3:], 8.25)
    assert found.record.saturated_ticks == 0.0


@pytest.mark.parametrize("actuation", ["none", "ideal"])
def test_a_base_without_actuators_gets_nothing_and_an_ideal_one_its_torque(actuation: str) -> None:
    found = Bench(base_actuation=actuation, drive_bias=[1.0])
    reported, torque = found.act(np.full(N + 3, 3.0))
    of_base = [0.0] * 3 if actuation == "none" else [4.0] * 3
    assert torque.tolist() == [*of_base, *[4.0] * N]
    assert reported.tolist() == [0.0 if actuation == "none" else 3.0] * 3 + [3.0] * N
    assert found.record.base_wrench.tolist() == [0.0, 0.0, 0.0, *of_base]


PAIR: dict[str, Any] = {
    "positions": [0.0, 1.0, 0.0, 0.0, -1.0, 0.0],
    "directions": [0.0, 0.0, 2.0, 1.0, 0.0, -1.0],
    "force": [10.0, 20.0],
}


def thrusters(*faults: str, more: Any = None, period: float = PERIOD, **thrusters: Any) -> Bench:
    settings = {"base_actuation": "hardware", "thrusters": {**PAIR, **thrusters}, **(more or {})}
    return Bench(*faults, period=period, **settings)


def opened(found: Bench, asked: list[float], k: int = 0) -> list[int]:
    """Ticks in which thruster ``k`` was open."""
    ticks = []
    for tick, force in enumerate(asked):
        found.ask(*(force if j == k else 0.0 for j in range(2)))
        ticks += [tick] if found.truth.thrusts[k] else []
    return ticks


def valve(
    wants: list[bool], shortest: int, delay: int, on: range = range(0), off: range = range(0)
) -> list[int]:
    """The ticks in which a valve is open, written down from the words of the manual.

    It is stuck over the ticks ``on`` and ``off``.
    """
    due = [False] * delay + wants
    is_open, found, begun = False, [], 0
    for tick in range(len(wants)):
        wanted = due[tick] or tick in on or (is_open and tick - begun < shortest)
        if tick in off:
            is_open = False
        elif wanted and not is_open:
            is_open, begun = True, tick
        elif not wanted:
            is_open = False
        found += [tick] if is_open else []
    return found


SPANS = st.just(range(0)) | st.builds(
    lambda start, length: range(start, start + length), st.integers(0, 30), st.integers(1, 20)
)


@given(
    st.lists(st.booleans(), min_size=40, max_size=40),
    st.integers(0, 12),
    st.integers(0, 5),
    st.integers(0, 3),
    SPANS,
    SPANS,
    st.integers(0, 1),
)
def test_valves_open_late_for_their_pulse_and_stick(
    wants: list[bool], shortest: int, delay: int, latency: int, on: range, off: range, k: int
) -> None:
    """Stuck off wins, and ends the pulse; stuck on begins one, which has its shortest time."""
    faults = [
        f"thruster_stuck_{name}@{span.start * PERIOD!r}-{span.stop * PERIOD!r}:{k + 1}"
        for name, span in (("on", on), ("off", off))
        if span.stop
    ]
    times = {"shortest_pulse": [shortest * PERIOD], "delay": [delay * PERIOD]}
    found = thrusters(*faults, more={"command_latency_ticks": latency}, **times)
    asked = [20.0 if want else 0.0 for want in wants]
    expected = valve(wants, max(1, shortest), delay + latency, on, off)
    assert opened(found, asked, k) == expected
    begins = [tick for tick in expected if tick - 1 not in expected]
    assert found.record.thrusters.pulses[k] == len(begins)
    assert found.record.thrusters.pulses.sum() == len(begins)


def test_more_than_half_of_the_force_is_open() -> None:
    assert opened(thrusters(), [5.0, 5.000001, 10.0, 1e9, 4.9, -10.0]) == [1, 2, 3]


def test_force_and_torque_on_the_base() -> None:
    found, half = thrusters(), np.sqrt(0.5)
    found.ask(10.0, 20.0)
    forces = np.array([[0.0, 0.0, 10.0], [20.0 * half, 0.0, -20.0 * half]])
    torque = np.cross([[0.0, 1.0, 0.0], [0.0, -1.0, 0.0]], forces).sum(axis=0)
    np.testing.assert_allclose(found.record.base_wrench, [*forces.sum(axis=0), *torque], rtol=1e-15)
    np.testing.assert_array_equal(found.truth.applied_torque[:3], found.record.base_wrench[3:])
    np.testing.assert_array_equal(found.measured.applied_torque, found.truth.applied_torque)
    assert found.truth.thrusts[:3].tolist() == [10.0, 20.0, 0.0]
    np.testing.assert_array_equal(found.measured.thrusts, found.truth.thrusts)
    found.ask(0.0, 0.0)
    assert not found.record.base_wrench.any()
    assert not found.truth.thrusts.any()


@pytest.mark.parametrize("period", [PERIOD, 0.01])
def test_propellant_is_the_impulse_over_the_exhausts_speed(period: float) -> None:
    """And when it ends, the last tick has the rest of it."""
    found = thrusters(specific_impulse=[290.0, 220.0], propellant=0.02, period=period)
    impulse = np.zeros(2)
    for _ in range(int(3.0 / period)):
        found.ask(10.0, 20.0)
        impulse += period * found.truth.thrusts[:2]
    burnt = impulse / (np.array([290.0, 220.0]) * 9.80665)
    assert found.record.thrusters.burnt == pytest.approx(0.02, rel=1e-12)
    assert burnt.sum() == pytest.approx(0.02, rel=1e-12)
    assert found.record.thrusters.propellant == pytest.approx(0.0, abs=1e-15)
    assert not found.truth.thrusts.any()
    assert found.record.thrusters.pulses[:2].tolist() == [1.0, 1.0]


FOUR_WHEELS = {"axes": PYRAMID, "rotor_inertia": [0.03], "initial_speed": [50.0, -20.0, 30.0, 90.0]}


def torquers(axes: Array, most: Array, **more: Any) -> Bench:
    return Bench(
        base_actuation="hardware",
        wheels=FOUR_WHEELS,
        magnetic_torquers={"axes": axes.ravel().tolist(), "max_dipole": most.tolist()},
        **more,
    )


@given(SEEDS, st.integers(1, MOST_TORQUERS))
def test_the_base_gets_m_cross_b_of_dipoles_up_to_the_largest(seed: int, count: int) -> None:
    """Added to what its wheels give; the wheels' command is not mixed up with theirs."""
    rng = np.random.default_rng(seed)
    axes, most = rng.normal(size=(count, 3)), rng.uniform(1.0, 400.0, count)
    actuators = torquers(axes, most)
    for _ in range(5):
        field = 3e-5 * rng.normal(size=3)
        motors, asked = rng.normal(size=4), 2.0 * most * rng.normal(size=count)
        actuators.truth.magnetic_field[:] = field
        reported, torque = actuators.act(np.concatenate([rng.normal(size=N + 3), motors, asked]))
        unit = axes / np.linalg.norm(axes, axis=1, keepdims=True)
        expected = np.cross(np.clip(asked, -most, most) @ unit, field)
        np.testing.assert_allclose(
            actuators.record.base_wrench[3:], expected, rtol=0.0, atol=1e-14 * most.sum()
        )
        np.testing.assert_array_equal(actuators.record.base_wrench[:3], 0.0)
        expected = expected - motors @ actuators.settings.wheels.unit_axes
        np.testing.assert_allclose(torque[:3], expected, rtol=0.0, atol=1e-13)
        np.testing.assert_array_equal(reported, torque)


@pytest.mark.parametrize(
    ("asked", "given_dipole"),
    [(np.nan, 0.0), (np.inf, 20.0), (-20.000001, -20.0), (5e-324, 5e-324), (-20.0, -20.0)],
)
def test_a_dipole_is_bounded_and_that_of_no_number_is_zero(
    asked: float, given_dipole: float
) -> None:
    """The other torquer is not touched by it."""
    field, actuators = np.array([0.0, 0.0, 2e-5]), torquers(np.eye(3)[:2], np.array([20.0, 7.0]))
    actuators.truth.magnetic_field[:] = field
    actuators.ask(0.0, 0.0, 0.0, 0.0, asked, 7.5)
    expected = np.cross([given_dipole, 7.0, 0.0], field)
    np.testing.assert_allclose(actuators.truth.applied_torque[:3], expected, rtol=1e-15)
