"""The log of a bench: that of a whole flight, whatever was restored, copied and commanded."""

from __future__ import annotations

import copy
import json
import pickle
from pathlib import Path

import numpy as np
import pytest
from bags import messages_of
from click.testing import CliRunner
from hypothesis import given, settings
from hypothesis import strategies as st
from test_bench_steps import RICH

from space_robot import Bench, FlownFlight, Scenario, load_bag
from space_robot.cli.main import cli
from space_robot.flight.replay.choice import ControllerChoice
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.errors import InputError

PLAIN = Scenario(controller=None, sensors="fine", duration=0.1)


def bits(log: FlightLog) -> dict[str, bytes]:
    columns = {name: column.tobytes() for name, column in log.columns.items()}
    if log.measured is not None:
        columns |= {f"measured {k}": v.tobytes() for k, v in log.measured.columns.items()}
    return columns


def assert_same(one: FlownFlight, other: FlownFlight) -> None:
    assert bits(one.log) == bits(other.log)
    assert (one.log.flight, one.log.laws) == (other.log.flight, other.log.laws)
    assert (one.outcome, one.reason, one.ended_at_s) == (
        other.outcome,
        other.reason,
        other.ended_at_s,
    )
    assert one.log.unanswered == other.log.unanswered


def flown_by_law(scenario: Scenario) -> FlownFlight:
    bench = scenario.bench()
    while not bench.done:
        bench.step()
    return bench.flown()


@pytest.mark.parametrize(
    "scenario",
    [
        RICH,
        Scenario(duration=0.05),
        Scenario(controller="ctc", sensors="coarse", seed=3, duration=0.05),
        Scenario(controller=lambda signals: np.full(9, 1e7)),  # diverges
    ],
    ids=["rich", "plain", "coarse", "diverged"],
)
def test_under_its_own_law_the_flight_is_that_of_the_scenario(scenario: Scenario) -> None:
    own, whole = flown_by_law(scenario), scenario.fly()
    assert_same(own, whole)
    assert own.metrics == whole.metrics
    assert own.table.equals(whole.table)


@pytest.mark.filterwarnings("ignore:start")
def test_a_flight_without_an_answer_ends_as_that_of_the_scenario() -> None:
    """The law has no command for a base that has turned by 180 degrees."""
    turned = {"plant": {"initial_quaternion": [0.0, 1.0, 0.0, 0.0]}}
    scenario = Scenario(controller="ctc", duration=0.05, parameters=turned)
    assert_same(flown_by_law(scenario), scenario.fly())


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
        truths.append(straight.truth.copy())
        straight.step(torque)
    log = bench.log()
    assert bits(log) == bits(straight.log())
    assert log.ticks == len(torques)
    assert log.commanded_torque is not None
    np.testing.assert_array_equal(log.commanded_torque, torques)
    for row, truth in enumerate(truths):
        assert log.quaternion[row].tobytes() == truth.quaternion.tobytes()
        assert log.joint_velocities[row].tobytes() == truth.joint_velocities.tobytes()
    assert log.flight["parameters"]["plant"]["fault_seed"] == seed


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
    np.testing.assert_array_equal(log.quaternion, flight.log.quaternion)
    np.testing.assert_array_equal(log.commanded_torque, flight.log.commanded_torque)
    np.testing.assert_array_equal(log.actuator_commands, flight.log.actuator_commands)
    for command in ("analyze", "view"):
        more = ["--json"] if command == "analyze" else ["--out", str(tmp_path / "page.html")]
        result = CliRunner().invoke(cli, [command, str(tmp_path / "bag"), *more])
        assert result.exit_code == 0, (command, result.output, result.exception)
        if command == "analyze":
            rms = json.loads(result.stdout)["rms"]["mean_axis"]
            assert rms == pytest.approx(flight.report()["rms"]["mean_axis"])


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
    assert bench.flown().metrics["attitude"] > 0.0


@pytest.mark.parametrize("scenario", [RICH, Scenario(duration=0.05)], ids=["rich", "plain"])
def test_a_saved_flight_has_the_messages_of_a_recorded_one(
    scenario: Scenario, tmp_path: Path
) -> None:
    scenario.fly(tmp_path / "recorded")
    flight = flown_by_law(scenario)
    assert flight.save(tmp_path / "saved") == flight.bag
    one, other = (list(messages_of(tmp_path / name)) for name in ("recorded", "saved"))
    assert one == other
    with pytest.raises(InputError, match="exists already"):
        flight.save(tmp_path / "saved")


def test_copies_go_on_with_the_log() -> None:
    bench = PLAIN.bench()
    for tick in range(300):
        if tick == 100:
            others = [copy.deepcopy(bench), pickle.loads(pickle.dumps(bench))]
        bench.step(np.full(9, 0.01 * np.sin(tick))) if not bench.done else None
    for other in others:
        assert isinstance(other, Bench)
        for tick in range(100, 200):
            other.step(np.full(9, 0.01 * np.sin(tick)))
        assert bits(other.log()) == bits(bench.log())


def test_what_was_not_recorded_is_told() -> None:
    bench, silent = PLAIN.bench(), PLAIN.bench(record=False)
    with pytest.raises(InputError, match="no tick has been flown yet"):
        bench.log()
    silent.step(np.zeros(9))
    with pytest.raises(InputError, match=r"was not recorded \(record=False\)"):
        silent.flown()
    bench.restore(silent.save())
    with pytest.raises(InputError, match="or a snapshot restored that was not"):
        bench.log()
    other = PLAIN.replace(case="3").bench()
    for _ in range(5):
        other.step(np.ones(9))
    bench.restore(other.save()._replace(scenario=bench.save().scenario))
    bench.step(np.ones(9))
    with pytest.raises(InputError, match="lead to another state: the plant was changed"):
        bench.log()
    bench.reset()
    bench.step(np.ones(9))
    assert bench.log() is bench.log()


def test_flights_whose_messages_failed_are_not_saved(tmp_path: Path) -> None:
    flight = Scenario(faults=["drop_state@0.01-0.02:0.5"], duration=0.03).fly()
    with pytest.raises(InputError, match="messages of this flight failed"):
        flight.save(tmp_path / "bag")


def test_a_replay_needs_a_law_by_name(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"no law flew: .* name the law that shall answer"):
        ControllerChoice({"controller": "none"}, tmp_path)
    assert ControllerChoice({"controller": "none"}, tmp_path, "ctc").law_name == "ctc"
