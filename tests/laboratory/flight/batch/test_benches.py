"""Benches stepped together: each has the states of the bench alone, tick by tick."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import space_robot as sr
from space_robot.flight.batch.benches import Benches
from space_robot_msgs_py.errors import InputError

Array = NDArray[np.float64]
COMMON: dict[str, Any] = {"controller": None, "duration": 0.05}


def scenarios() -> list[sr.Scenario]:
    """Two batches; faults that begin and end, another length, a divergence."""
    return [
        *(sr.Scenario(**COMMON, sensors="fine", seed=seed) for seed in range(3)),
        sr.Scenario(**COMMON, sensors="fine", case="3", faults=["encoder_stuck@0.01-0.02:2"]),
        sr.Scenario(**COMMON, seed=4),
        sr.Scenario(**{**COMMON, "duration": 0.03}, sensors="fine"),
        *(sr.Scenario(**COMMON, sensors="fine", faults=["noise_gyro@0.02:0.1"]) for _ in range(8)),
    ]


def torques_of(states: Array, tick: int) -> Array:
    """Some torques, of which the first flight's make it diverge."""
    torques = np.sin(np.arange(states.shape[0] * 9).reshape(-1, 9) + tick)
    torques[0] *= 1e9 if tick > 20 else 1.0
    return torques - states["joint_velocities"].sum(axis=1)[:, np.newaxis]


def numbers(block: Any) -> list[bytes]:
    return [row.tobytes() for row in np.asarray(block)]


def test_each_bench_has_the_states_of_the_bench_alone() -> None:
    many, alone = sr.bench_many(scenarios()), [scenario.bench() for scenario in scenarios()]
    for seed in (None, 7):
        states = many.reset(seed)
        for k, bench in enumerate(alone):
            bench.reset(None if seed is None else seed + k)
        tick = 0
        while not many.done.all():
            torques = torques_of(states, tick)
            states = many.step(torques)
            for k, bench in enumerate(alone):
                if not bench.done:
                    bench.step(torques[k])
            assert numbers(states) == [bench.state.block.tobytes() for bench in alone]
            assert numbers(many.truths) == [bench.truth.block.tobytes() for bench in alone]
            assert many.ticks.tolist() == [bench.tick for bench in alone]
            assert many.done.tolist() == [bench.done for bench in alone]
            tick += 1
        for ending, bench in zip(many.endings, alone, strict=True):
            assert ending is not None
            assert (ending.outcome, ending.reason) == (bench.outcome, bench.reason)
        assert many.endings[0].outcome == "diverged"  # type: ignore[union-attr]
    with pytest.raises(InputError, match="all flights are over"):
        many.step(torques)


def test_wheels_share_the_torque_out_or_take_their_own() -> None:
    options = {**COMMON, "actuators": "wheels", "duration": 0.005}
    many = sr.bench_many(sr.Scenario(**options, seed=seed) for seed in range(2))
    one = sr.Scenario(**options, seed=1).bench()
    for axes in (9, len(many.names.commanded)):
        many.reset()
        one.reset()
        for tick in range(10):
            torques = 0.1 * np.sin(np.arange(2 * axes).reshape(2, axes) + tick)
            many.step(torques)
            one.step(torques[1])
        assert numbers(many.states)[1] == one.state.block.tobytes()


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ([], "at least one flight"),
        ([3], "scenario 0: a Scenario was expected, got 3"),
        (
            [sr.Scenario(**COMMON), sr.Scenario(**COMMON, robot="dual_arm")],
            "flight 1: 8 joints and actuators",
        ),
        ([sr.Scenario(**COMMON, faults=["drop_state@0:0.5"])], "flight 0: on the bench are no"),
    ],
)
def test_what_cannot_be_benched_is_named(given: Any, said: str) -> None:
    with pytest.raises(InputError, match=said):
        sr.bench_many(given)


def test_wrong_numbers_are_errors() -> None:
    many = sr.bench_many([sr.Scenario(**COMMON)] * 2)
    assert isinstance(many, Benches)
    with pytest.raises(InputError, match=r"shape \(2, 9\) was expected, got one of \(9,\)"):
        many.step(np.zeros(9))
    with pytest.raises(InputError, match="seed: 2 numbers were expected, got 1"):
        many.reset([3])
    with pytest.raises(InputError, match=r"seed\[1\]"):
        many.reset([3, -1])
    with pytest.raises(InputError, match="seed"):
        many.reset(2**31 - 1)
