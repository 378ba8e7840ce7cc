"""The bench: a flight tick by tick; saved, restored, copied, reset; and its log."""

from __future__ import annotations

import copy
import json
import pickle
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from bags import messages_of
from flights import space_robot_here
from hypothesis import given, settings
from hypothesis import strategies as st

from space_robot import Bench, Scenario, load_bag
from space_robot.flight.replay.choice import ControllerChoice
from space_robot_control.laws.ctc import ComputedTorque
from space_robot_model.elementary.matrices import Array
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.compiled import records
from space_robot_msgs_py.errors import InputError
from space_robot_msgs_py.samples import RobotState

PLAIN = Scenario(controller=None, sensors="fine", duration=0.1)
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
COPIES: dict[str, Callable[[Any], Any]] = {
    "copy": copy.copy,
    "deepcopy": copy.deepcopy,
    "pickle": lambda thing: pickle.loads(pickle.dumps(thing)),
}


@pytest.fixture(scope="module")
def plain() -> Bench:
    return PLAIN.bench()


@pytest.fixture(scope="module")
def rich() -> Bench:
    return RICH.bench()


@pytest.fixture
def midway(rich: Bench) -> Bench:
    """In the middle of a fault, with commands on their way and a target in hand."""
    rich.reset(11)
    fly_on(rich, 45)
    return rich


def seen(bench: Bench) -> bytes:
    return bench.state.block.tobytes() + bench.truth.block.tobytes()


def fly_on(bench: Bench, ticks: int, torque: Array | None = None) -> list[bytes]:
    found = []
    for _ in range(ticks):
        bench.step(torque)
        found.append(seen(bench))
    return found


def bits(log: FlightLog) -> dict[str, bytes]:
    told = {} if log.measured is None else log.measured.columns
    columns = {f"measured {k}": v for k, v in told.items()} | log.columns
    return {name: column.tobytes() for name, column in columns.items()}


def test_its_own_command_reference_and_law_are_those_of_the_flight(rich: Bench) -> None:
    log = RICH.fly().log
    assert log.commanded_torque is not None
    assert log.reference_joints is not None
    rich.reset()
    for tick in range(log.ticks):
        command, reference = rich.command(), rich.reference
        assert rich.command() is command
        assert command.torque[:9].tobytes() == log.commanded_torque[tick].tobytes()
        np.testing.assert_array_equal(reference.joint_positions, log.reference_joints[tick, 0])
        assert rich.controller.law.name == ("tde_stc" if tick < 100 else "tde_smc")
        rich.step()
    assert rich.done


def test_a_snapshot_and_a_seed_are_of_a_scenario(rich: Bench) -> None:
    with pytest.raises(InputError, match=r"of another scenario: seed is \d+ there, 77 here"):
        RICH.replace(seed=77).bench().restore(rich.save())
    rich.reset(seed=11)
    theirs = RICH.replace(seed=11).bench()
    assert fly_on(rich, 20) == fly_on(theirs, 20)
    rich.reset()
    assert seen(rich) != seen(theirs)


@pytest.mark.parametrize(("law", "unanswered"), [("tde_stc", 1), ("ctc_smc", 7)])
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


def test_torques_are_shared_out_over_the_wheels() -> None:
    bench = Scenario(controller=None, actuators="wheels", duration=0.1).bench()
    assert bench.axes == 9
    for _ in range(20):
        bench.step([0.5, 0, 0, *np.zeros(6)])
    np.testing.assert_allclose(bench.truth.applied_torque[:3], [0.5, 0.0, 0.0], atol=0.02)
    bench.step(np.zeros(len(bench.names.commanded)))
    with pytest.raises(InputError, match="torque: 9 or 13 numbers were expected, got an array"):
        bench.step(np.zeros(4))


def test_every_step_needs_a_torque_until_the_flight_is_over(plain: Bench) -> None:
    state = plain.reset(seed=1)
    while not plain.done:
        state = plain.step(np.zeros(9))
    assert (state.tick, plain.tick, plain.outcome, plain.reason) == (200, 200, "complete", "")
    snapshot = plain.save()
    plain.reset()
    assert not plain.done
    plain.restore(snapshot)
    assert plain.done
    with pytest.raises(InputError, match="the flight is over \\(complete\\)"):
        plain.step(np.zeros(9))
    plain.reset()
    with pytest.raises(InputError, match="controller is None: give every step a torque"):
        plain.step()
    while not plain.done:
        plain.step(np.full(9, 1e7))
    assert plain.reason.startswith("the flight diverged at tick 2")
    assert plain.flown().report()["diverged"] == {"tick": 2, "time_s": 0.001}
    with pytest.raises(InputError, match="on the bench are no messages"):
        Scenario(faults=["drop_state@1-2:0.5"]).bench()


@settings(max_examples=8)
@given(st.lists(st.integers(1, 30), min_size=1, max_size=6), st.integers(0, 2**31 - 1))
def test_a_log_is_of_what_was_flown_after_restoring_anything(parts: list[int], seed: int) -> None:
    """The same torques in one go are the flight; wrong turns before are forgotten."""
    rng, bench = np.random.default_rng(seed), PLAIN.bench()
    bench.reset(seed)
    torques = []
    for count in parts:
        snapshot = pickle.loads(pickle.dumps(bench.save()))
        for _ in range(min(7, bench.ticks - bench.tick)):
            bench.step(rng.normal(size=9))
        if seed % 2:
            bench = PLAIN.bench()
        bench.restore(snapshot)
        for _ in range(min(count, bench.ticks - bench.tick)):
            torques.append(rng.normal(size=9))
            bench.step(torques[-1])
    straight = PLAIN.bench()
    straight.reset(seed)
    truths = []
    for torque in torques:
        truths.append(straight.truth.quaternion.tobytes())
        straight.step(torque)
    log = bench.log()
    assert bits(log) == bits(straight.log())
    assert log.commanded_torque is not None
    np.testing.assert_array_equal(log.commanded_torque, torques)
    assert [row.tobytes() for row in log.quaternion] == truths
    assert log.flight["scenario"]["seed"] == seed


def test_by_hand_there_is_no_law(tmp_path: Path) -> None:
    """Although the scenario has one; the bag is one of a flight, and says so."""
    bench = Scenario(controller="tde_stc", swaps=["0.01:ctc"], actuators="wheels").bench()
    for _ in range(400):
        bench.step([0.1, 0.0, 0.0, *np.zeros(6)])
    flight = bench.flown(tmp_path / "bag")
    assert (flight.outcome, flight.ended_at_s, flight.is_complete) == ("stopped", 0.2, False)
    assert repr(flight).startswith("<FlownFlight: torques from outside, case 1")
    assert [law.name for law in flight.log.laws] == ["none"]
    log = load_bag(tmp_path / "bag")
    for name in ("quaternion", "commanded_torque", "actuator_commands"):
        np.testing.assert_array_equal(getattr(log, name), getattr(flight.log, name))
    analyzed = space_robot_here("analyze", str(tmp_path / "bag"), "--json")
    metrics = json.loads(analyzed.stdout)["metrics"]
    assert metrics["attitude.rms"] == pytest.approx(flight.metrics["attitude.rms"])
    with pytest.raises(InputError, match=r"no law flew: .* name the law that shall answer"):
        ControllerChoice({"controller": "none"})
    assert ControllerChoice({"controller": "none"}, "ctc").law_name == "ctc"


def test_a_law_with_a_hand_on_it_keeps_its_telemetry() -> None:
    """A correction added to the law's command, as residual learning does; then none at all."""
    bench = Scenario(controller="ctc", duration=0.1).bench()
    for _ in range(50):
        bench.step(bench.command().torque + 0.01)
    for _ in range(20):
        bench.step(np.zeros(9))
    log = bench.log()
    assert [(law.tick, law.name) for law in log.laws] == [(0, "ctc"), (50, "none")]
    assert log.telemetry is not None
    assert np.isfinite(log.telemetry[:50]).all()
    assert np.isnan(log.telemetry[50:]).all()
    assert log.flight["controller"] == "ctc"


def test_a_saved_flight_has_the_messages_of_a_recorded_one(rich: Bench, tmp_path: Path) -> None:
    RICH.fly(tmp_path / "recorded")
    rich.reset()
    while not rich.done:
        rich.step()
    flight = rich.flown()
    assert flight.save(tmp_path / "saved") == flight.bag
    one, other = (list(messages_of(tmp_path / name)) for name in ("recorded", "saved"))
    assert one == other
    with pytest.raises(InputError, match="exists already"):
        flight.save(tmp_path / "saved")
    failed = Scenario(faults=["drop_state@0.01-0.02:0.5"], duration=0.03).fly()
    with pytest.raises(InputError, match="messages of this flight failed"):
        failed.save(tmp_path / "bag")


def test_what_was_not_recorded_is_told(plain: Bench) -> None:
    silent, other = PLAIN.bench(record=False), PLAIN.replace(case="3").bench()
    plain.reset()
    with pytest.raises(InputError, match="no tick has been flown yet"):
        plain.log()
    silent.step(np.zeros(9))
    with pytest.raises(InputError, match=r"was not recorded \(record=False\)"):
        silent.flown()
    plain.restore(silent.save())
    with pytest.raises(InputError, match="or a snapshot restored that was not"):
        plain.log()
    fly_on(other, 5, np.ones(9))
    plain.restore(other.save()._replace(scenario=plain.save().scenario))
    plain.step(np.ones(9))
    with pytest.raises(InputError, match="lead to another state: the plant was changed"):
        plain.log()


@pytest.mark.parametrize("copied", COPIES.values(), ids=COPIES)
def test_a_copied_bench_flies_on_to_the_same_bits(midway: Bench, copied: Any) -> None:
    """Past a swap of the law and the end of a fault; the original stands still meanwhile."""
    here, other = seen(midway), copied(midway)
    theirs = fly_on(other, 80)
    assert seen(midway) == here
    assert fly_on(midway, 80) == theirs
    assert bits(midway.log()) == bits(other.log())
    assert other.reset().block.tobytes() == RICH.bench().state.block.tobytes()


def test_compiled_code_knows_the_blocks_of_another_process(
    midway: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    pickled = pickle.dumps(midway)
    monkeypatch.setattr(records, "_LAYOUTS", {})
    records.Record.dtype.__func__.cache_clear()
    other = pickle.loads(pickled)
    for block in (other._plant.block, other.controller.block):
        assert records.layout_of(block.dtype) is not None
    records.Record.dtype.__func__.cache_clear()


def test_a_copied_state_is_a_state_and_a_view_of_a_record_is_refused(midway: Bench) -> None:
    """Also one that a law under development keeps; a silent copy would look at the old memory."""

    class Kept(ComputedTorque):
        def __init__(self, *arguments: Any) -> None:
            super().__init__(*arguments)
            self.force_of_before = self.memory.force

    state = RobotState.allocate(2)
    law = Kept(midway.flight.build_controller(midway.flight.laws["ctc"]).law.gain_values, 5e-4)
    for refused in (lambda: copy.deepcopy(law), law.save):
        with pytest.raises(TypeError, match=r"Kept\.force_of_before is a view of a record"):
            refused()
    for copied in COPIES.values():
        other = copied(state)
        other.joint_positions[1] = 3.0
        assert (other.block["joint_positions"][0, 1], state.joint_positions[1]) == (3.0, 0.0)
        with pytest.raises(TypeError, match="copy the object that owns its block"):
            copied(midway.controller.signals)
