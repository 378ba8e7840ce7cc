"""The bench: tick by tick the bits of a whole flight; saved, restored, pickled, reset."""

from __future__ import annotations

import copy
import pickle

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from space_robot import Bench, Scenario
from space_robot_msgs_py.errors import InputError

Array = NDArray[np.float64]

PLAIN = Scenario(controller=None, duration=0.5)
RICH = Scenario(
    controller="tde_stc",
    case="3",
    sensors="fine",
    actuators="wheels",
    command_latency_ticks=2,
    swaps=["0.05:tde_smc"],
    navigation="filtered",
    duration=0.12,
    faults=["noise_gyro@0.02-0.06:1e-5", "torque_scale@0.03:base=0.9", "encoder_stuck@0.04-0.05:2"],
    events=["capture@0.02:small_satellite", "release@0.035:0.1"],
)
"""All that has a memory: sensors, wheels, delayed commands, faults, events, a filter, a swap."""


@pytest.fixture(scope="module")
def plain() -> Bench:
    return PLAIN.bench()


@pytest.fixture(scope="module")
def rich() -> Bench:
    return RICH.bench()


def seen(bench: Bench) -> bytes:
    return bench.state.block.tobytes() + bench.truth.block.tobytes()


def fly_on(bench: Bench, ticks: int, torque: Array | None = None) -> list[bytes]:
    found = []
    for _ in range(ticks):
        bench.step(torque)
        found.append(seen(bench))
    return found


def test_the_issue_of_a_law_under_development() -> None:
    """The twenty lines: reset, step until done, save, restore."""
    bench = Scenario(controller=None, duration=0.01).bench()
    state = bench.reset(seed=1)
    while not bench.done:
        state = bench.step(np.zeros(9))
    assert (state.tick, bench.tick, bench.outcome, bench.reason) == (20, 20, "complete", "")
    snapshot = bench.save()
    bench.reset()
    assert not bench.done
    bench.restore(snapshot)
    assert bench.done
    with pytest.raises(InputError, match="the flight is over \\(complete\\)"):
        bench.step(np.zeros(9))


def test_its_own_law_flies_the_bits_of_the_whole_flight(rich: Bench) -> None:
    log = RICH.fly().log
    assert log.measured
    rich.reset()
    for tick in range(log.ticks):
        assert rich.truth.joint_positions.tobytes() == log.joint_positions[tick].tobytes()
        assert rich.state.quaternion.tobytes() == log.measured.quaternion[tick].tobytes()
        command = rich.command()
        assert rich.command() is command
        assert log.commanded_torque is not None
        assert command.torque[:9].tobytes() == log.commanded_torque[tick].tobytes()
        assert rich.controller.law.name == ("tde_stc" if tick < 100 else "tde_smc")
        rich.step()
    assert rich.done


@settings(max_examples=10)
@given(
    st.integers(0, 100),
    st.integers(1, 60),
    st.integers(0, 100),
    st.integers(0, 2**31 - 1),
    st.booleans(),
)
def test_a_restored_flight_goes_on_to_the_same_bits(
    rich: Bench, before: int, after: int, elsewhere: int, seed: int, pickled: bool
) -> None:
    """Whatever was flown in between, with whatever seed; on this bench and on another."""
    rich.reset(seed)
    fly_on(rich, before)
    snapshot = rich.save()
    here = seen(rich)
    expected = fly_on(rich, after)
    rich.reset(seed ^ 1)
    fly_on(rich, elsewhere)
    rich.restore(pickle.loads(pickle.dumps(snapshot)) if pickled else snapshot)
    assert (seen(rich), rich.tick) == (here, before)
    assert fly_on(rich, after) == expected


def test_a_snapshot_outlives_its_bench() -> None:
    bench, other = RICH.bench(), RICH.bench()
    bench.reset(5)
    fly_on(bench, 30)
    other.restore(bench.save())
    assert fly_on(other, 50) == fly_on(bench, 50)
    with pytest.raises(InputError, match=r"of another scenario: seed is \d+ there, 77 here"):
        RICH.replace(seed=77).bench().restore(bench.save())
    for option in ({"robot": "seven_joint"}, {"case": "1"}, {"duration": 1.0}):
        with pytest.raises(InputError, match="of another scenario: "):
            RICH.replace(**option).bench().restore(bench.save())


@settings(max_examples=20)
@given(st.integers(0, 2**32 - 1))
def test_the_same_torques_give_the_same_bits(plain: Bench, seed: int) -> None:
    """Restored in the middle, too; with states that are kept by copying them."""
    torques = np.random.default_rng(seed).normal(size=(40, 9))
    plain.reset()
    first = [plain.step(torque).copy() for torque in torques[:20]]
    snapshot = plain.save()
    second = [plain.step(torque).block.tobytes() for torque in torques[20:]]
    plain.restore(snapshot)
    assert [plain.step(torque).block.tobytes() for torque in torques[20:]] == second
    plain.reset()
    assert all(
        plain.step(torque).block.tobytes() == kept.block.tobytes()
        for torque, kept in zip(torques, first, strict=False)
    )


@pytest.mark.parametrize("unanswered", [1, 2, 7])
@pytest.mark.parametrize("law", ["tde_stc", "ctc_smc"])
def test_after_ticks_without_it_the_law_takes_over(law: str, unanswered: int) -> None:
    """Against a controller that takes over there; one that goes on commands something else."""
    bench = Scenario(controller=law, case="3", duration=0.05).bench()
    fly_on(bench, 20)
    fly_on(bench, unanswered, np.zeros(9))
    goes_on, takes_over = copy.deepcopy(bench.controller), copy.deepcopy(bench.controller)
    takes_over.engage()
    for tick in range(20 + unanswered, 60):
        reference = bench.flight.mission.chunk(tick, 1).references()
        expected = takes_over.update(bench.state, reference).torque.tobytes()
        if tick == 20 + unanswered:
            assert goes_on.update(bench.state, reference).torque.tobytes() != expected
        assert bench.command().torque.tobytes() == expected
        bench.step()


def test_a_seed_is_that_of_a_scenario(rich: Bench) -> None:
    rich.reset(seed=11)
    theirs = RICH.replace(seed=11).bench()
    assert fly_on(rich, 20) == fly_on(theirs, 20)
    rich.reset()
    assert seen(rich) != seen(theirs)


def test_torques_are_shared_out_over_the_wheels() -> None:
    bench = Scenario(controller=None, actuators="wheels", duration=0.1).bench()
    assert bench.axes == 9
    for _ in range(20):
        bench.step([0.5, 0, 0, *np.zeros(6)])
    np.testing.assert_allclose(bench.truth.applied_torque[:3], [0.5, 0.0, 0.0], atol=0.02)
    each = np.zeros(len(bench.names.commanded))
    bench.step(each)
    with pytest.raises(InputError, match="torque: 9 or 13 numbers were expected, got an array"):
        bench.step(np.zeros(4))


def test_a_diverged_flight_is_done(plain: Bench) -> None:
    plain.reset()
    while not plain.done:
        plain.step(np.full(9, 1e7))
    assert plain.outcome == "diverged"
    assert plain.reason.startswith("the flight diverged at tick 2")
    assert "diverged" in repr(plain)


def test_without_a_law_every_step_needs_a_torque(plain: Bench) -> None:
    plain.reset()
    with pytest.raises(InputError, match="controller is None: give every step a torque"):
        plain.step()


def test_faults_of_messages_are_refused() -> None:
    with pytest.raises(InputError, match="on the bench are no messages"):
        Scenario(faults=["drop_state@1-2:0.5"]).bench()


def test_the_reference_is_the_missions(plain: Bench) -> None:
    log = Scenario(controller="ctc", duration=0.5).fly().log
    plain.reset()
    for _ in range(999):
        plain.step(np.zeros(9))
    reference = plain.reference
    assert log.reference_joints is not None
    np.testing.assert_array_equal(reference.joint_positions, log.reference_joints[999, 0])
