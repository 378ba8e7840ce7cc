"""Thrusters: valves against a slow model of them, forces, the tank, and valves that stick."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from actuator_bench import PERIOD, Bench, N
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

Array = NDArray[np.float64]

PAIR: dict[str, Any] = {
    "positions": [0.0, 1.0, 0.0, 0.0, -1.0, 0.0],
    "directions": [0.0, 0.0, 2.0, 1.0, 0.0, -1.0],
    "force": [10.0, 20.0],
}


def bench(*faults: str, more: Any = None, period: float = PERIOD, **thrusters: Any) -> Bench:
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


@given(
    st.lists(st.booleans(), max_size=40), st.integers(0, 6), st.integers(0, 5), st.integers(0, 3)
)
def test_valves_open_late_and_not_for_less_than_their_pulse(
    wants: list[bool], shortest: int, delay: int, latency: int
) -> None:
    found = bench(
        shortest_pulse=[shortest * PERIOD],
        delay=[delay * PERIOD],
        more={"command_latency_ticks": latency},
    )
    asked = [10.0 if want else 0.0 for want in wants]
    expected = valve(wants, max(1, shortest), delay + latency)
    assert opened(found, asked) == expected
    begins = [tick for tick in expected if tick - 1 not in expected]
    assert found.record.thrusters.pulses.tolist() == [len(begins), *np.zeros(23)]


SPANS = st.tuples(st.integers(0, 30), st.integers(1, 20)).map(lambda s: range(s[0], s[0] + s[1]))


@given(
    st.lists(st.booleans(), min_size=40, max_size=40),
    st.integers(0, 12),
    SPANS,
    SPANS,
    st.integers(0, 1),
)
def test_valves_that_stick_and_are_free_again(
    wants: list[bool], shortest: int, on: range, off: range, k: int
) -> None:
    """Stuck off wins, and ends the pulse; stuck on begins one, which has its shortest time."""
    faults = [
        f"thruster_stuck_{name}@{span.start * PERIOD!r}-{span.stop * PERIOD!r}:{k + 1}"
        for name, span in (("on", on), ("off", off))
    ]
    found = bench(*faults, shortest_pulse=[shortest * PERIOD])
    asked = [20.0 if want else 0.0 for want in wants]
    expected = valve(wants, max(1, shortest), 0, on, off)
    assert opened(found, asked, k) == expected
    begins = [tick for tick in expected if tick - 1 not in expected]
    assert found.record.thrusters.pulses[k] == len(begins)
    assert found.record.thrusters.pulses.sum() == len(begins)


def test_more_than_half_of_the_force_is_open() -> None:
    assert opened(bench(), [5.0, 5.000001, 10.0, 1e9, 4.9, -10.0]) == [1, 2, 3]


def test_force_and_torque_on_the_base() -> None:
    found, half = bench(), np.sqrt(0.5)
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
    found = bench(specific_impulse=[290.0, 220.0], propellant=0.02, period=period)
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


def test_a_tank_of_nothing_said_never_runs_out() -> None:
    found = bench()
    for _ in range(100):
        found.ask(10.0, 0.0)
    assert found.record.thrusters.propellant == np.inf
    used = 100 * PERIOD * 10.0 / (220.0 * 9.80665)
    assert found.record.thrusters.burnt == pytest.approx(used, rel=1e-12)
    assert found.truth.thrusts[0] == 10.0


def test_wheels_and_thrusters_act_together() -> None:
    wheels = {"axes": [1.0, 0.0, 0.0], "max_torque": [2.0]}
    found = bench("wheel_fail@0.0005:1", more={"wheels": wheels})
    found.act(np.array([*np.zeros(N + 3), 1.5, 10.0, 0.0]))
    assert found.truth.applied_torque[:3].tolist() == [8.5, 0.0, 0.0]
    assert found.record.base_wrench.tolist() == [0.0, 0.0, 10.0, 10.0, 0.0, 0.0]
    found.act(np.array([*np.zeros(N + 3), 1.5, 10.0, 0.0]))
    assert found.truth.applied_torque[:3].tolist() == [10.0, 0.0, 0.0]
