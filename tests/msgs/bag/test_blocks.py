"""Flights and their bags, and the laws that flew."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from space_robot.analysis import analyze
from space_robot.analysis.analysed_log import excerpt
from space_robot.analysis.estimate_error import HBar, estimate_errors, recorded_h_bar
from space_robot.flight.plan import Flight, Scenario, resolve
from space_robot.flight.replay.run import RecordedLaws
from space_robot.flight.simulate import simulate
from space_robot_msgs_py.bag.flight_log import REFERENCE, FlightLog
from space_robot_msgs_py.bag.law_history import as_data, in_words, same, within
from space_robot_msgs_py.bag.reader import read_flight
from space_robot_msgs_py.samples import STATE_FIELDS, LawInForce, Timebase, in_order

COLUMNS = (*STATE_FIELDS, *REFERENCE, "commanded_torque")


PLAN = Scenario.model_validate(
    {
        "duration": 0.3,
        "case": "3",
        "swaps": ["0.0755:ctc", "0.15:tde_stc"],
        "command_latency_ticks": 2,
        "faults": ["noise_attitude@0.01:1e-5", "torque_scale@0.05:joints=0.998"],
    }
)


def test_a_flight_in_memory_in_files_and_from_its_bag_is_the_same(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """To the last bit, log and report; a log in files leaves none behind."""
    flown = simulate(Flight(resolve(PLAN)))
    monkeypatch.setattr("space_robot.flight.flown_log.MAPPED_FROM", 1000)
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    log = simulate(Flight(resolve(PLAN)), tmp_path / "bag")
    assert isinstance(log.quaternion, np.memmap)
    assert isinstance(log.reference_joints, np.memmap)
    assert isinstance(log.assumed_error, np.memmap)
    assert [path.name for path in tmp_path.iterdir()] == ["bag"]
    read = read_flight(tmp_path / "bag")
    monkeypatch.setattr("space_robot_msgs_py.bag.rows.FILES_FROM", 1000)
    read_into_files = read_flight(tmp_path / "bag")
    assert isinstance(read_into_files.reference_joints, np.memmap)
    assert [path.name for path in tmp_path.iterdir()] == ["bag"]
    for one in (log, read, read_into_files):
        assert one.measured is not None
        assert flown.measured is not None
        for name in COLUMNS:
            np.testing.assert_array_equal(getattr(one, name), getattr(flown, name), name)
        for name in STATE_FIELDS:
            measured = getattr(flown.measured, name)
            np.testing.assert_array_equal(getattr(one.measured, name), measured, name)
        np.testing.assert_array_equal(one.assumed_error, flown.assumed_error)
        assert one.laws == flown.laws
    np.testing.assert_array_equal(log.telemetry, flown.telemetry)
    assert analyze(log) == analyze(flown) == analyze(read) == analyze(read_into_files)


TIMEBASE = Timebase(500_000)


def law(tick: int, name: str, is_first: bool = False, **gains: float) -> LawInForce:
    return LawInForce(tick, name, {gain: (value,) for gain, value in gains.items()}, is_first)


LAWS = (
    law(0, "tde_stc", is_first=True, k_1=1.0, k_2=2.0),
    law(2469, "tde_tsmc", k_1=3.0),
    law(4000, "tde_tsmc", k_1=4.0),
    law(5000, "tde_stc", k_1=1.0, k_2=2.5),
    law(6000, "tde_stc", is_first=True, k_1=1.0, k_2=2.0),
)


def test_in_words_every_change_is_told_with_its_time() -> None:
    assert in_words(as_data(LAWS, TIMEBASE)) == (
        "tde_stc -> tde_tsmc at 1.2345 s (other k_1 at 2.0000 s) -> tde_stc at 2.5000 s "
        "(other k_2) and 1 more"
    )
    begun_again = (LAWS[0], LAWS[0]._replace(tick=9))
    assert in_words(as_data(begun_again, TIMEBASE)) == "tde_stc (begun again at 0.0045 s)"
    assert in_words([]) == ""


def test_a_part_of_a_flight_begins_with_the_law_in_force_there() -> None:
    assert within(LAWS, 0, 10_000) == LAWS
    assert within(LAWS, 2469, 4000) == LAWS[1:2]
    assert within(LAWS, 2468, 4001) == LAWS[:3]
    assert within(LAWS[1:], 0, 2469) == ()


def test_of_two_laws_at_one_tick_the_last_has_answered_it() -> None:
    crashed, flown = law(7, "ctc", k_p=1.0), law(7, "ctc", is_first=True, k_p=2.0)
    assert in_order([LAWS[2], crashed, flown, LAWS[0]]) == (LAWS[0], flown, LAWS[2])


def test_same_is_to_the_last_bit() -> None:
    assert same(law(1, "ctc", k_p=0.0), law(2, "ctc", k_p=0.0))
    assert not same(law(1, "ctc", k_p=0.0), law(1, "ctc", k_p=-0.0))
    assert not same(law(1, "ctc", k_p=1.0), law(1, "ctc", k_d=1.0))
    assert not same(law(1, "ctc", k_p=1.0), law(1, "pid", k_p=1.0))


@pytest.mark.parametrize(
    ("states", "done"),
    [
        (
            [0, 1, 2469, 4000, 5000, 6000],
            ["tde_stc", "tde_tsmc", "tde_tsmc", "tde_stc", "again", "tde_stc"],
        ),
        ([2470, 4500], ["tde_tsmc", "tde_tsmc"]),
        ([5999, 7000], ["tde_stc", "again", "tde_stc"]),
        ([6001], ["tde_stc"]),
        ([1, 5999], ["tde_stc", "tde_stc"]),
    ],
)
def test_laws_are_put_in_force_before_their_states(states: list[int], done: list[str]) -> None:
    """Of several between two states the last; a controller that began again begins again."""
    told: list[str] = []
    laws = RecordedLaws(LAWS, lambda law: told.append(law.name), lambda: told.append("again"))
    for tick in states:
        laws.before(tick)
    assert told == done


@pytest.fixture(scope="module")
def swapped() -> FlightLog:
    """TDE-STC, then CTC, then TDE-SMC, whose h_bar is halved in the record."""
    return simulate(Flight(resolve(Scenario(duration=0.3, swaps=["0.1:ctc", "0.2:tde_smc"]))))


def test_the_report_has_all_laws_that_flew(swapped: FlightLog) -> None:
    report = analyze(swapped)
    assert [(law["tick"], law["t_s"], law["controller"]) for law in report["laws"]] == [
        (0, 0.0, "tde_stc"),
        (200, 0.1, "ctc"),
        (400, 0.2, "tde_smc"),
    ]
    assert set(report["laws"][1]["gains"]) == {"k_p", "k_d"}
    part = analyze(excerpt(swapped, 0.15, 0.25))
    assert part["controller"] == "ctc"
    assert [law["controller"] for law in part["laws"]] == ["ctc", "tde_smc"]


def test_the_estimates_error_is_taken_with_the_h_bar_in_force(swapped: FlightLog) -> None:
    """As under one law alone where that is in force, left out under CTC."""
    halved = {
        **swapped.laws[2].gains,
        "h_bar": tuple(0.5 * h for h in swapped.laws[2].gains["h_bar"]),
    }
    log = replace(swapped, laws=(*swapped.laws[:2], swapped.laws[2]._replace(gains=halved)))

    def errors(h_bar: HBar) -> np.ndarray:
        return estimate_errors(log, h_bar, 0.3)(0, log.ticks)

    alone = [errors(lambda _, law=law: np.array(law.gains["h_bar"])) for law in log.laws[::2]]
    expected = np.vstack([alone[0][:200], np.full((200, 9), np.nan), alone[1][400:]])
    np.testing.assert_array_equal(errors(recorded_h_bar), expected)


def test_where_no_law_has_an_estimate_there_is_no_error_of_it(swapped: FlightLog) -> None:
    report = analyze(excerpt(swapped, 0.1, 0.2))
    why = "ctc has no time-delay estimate with a constant h_bar"
    assert report["unavailable"]["estimate_error"] == why
    assert analyze(swapped)["metrics"]["estimate_error_base.rms"] > 0.0
