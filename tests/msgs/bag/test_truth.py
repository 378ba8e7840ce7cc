"""The true states beside the measured ones, through a bag."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from bags import messages_of, read_accounts

from space_robot.analysis import analyze
from space_robot.flight.plan import Flight, FlightPlan, resolve
from space_robot.flight.simulate import simulate
from space_robot_msgs_py import topics
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.bag.reader import read_flight
from space_robot_msgs_py.bag.recorder import BagRecorder
from space_robot_msgs_py.samples import STATE_FIELDS
from space_robot_msgs_py.topics import Topic
from space_robot_msgs_py.wire.cdr import header_stamp_ns

NOISE = ["noise_attitude@0.01:1e-5", "noise_gyro@0-0.1:1e-6", "noise_joint_position@0:1e-5"]
FAULTS = [*NOISE, "torque_scale@0.05:joints=0.998"]
TICKS = 400


@pytest.fixture(scope="module")
def flown(tmp_path_factory: pytest.TempPathFactory) -> tuple[FlightLog, Path]:
    bag = tmp_path_factory.mktemp("truth") / "bag"
    plan = FlightPlan(faults=FAULTS, duration=TICKS * 0.0005, case="2")
    return simulate(Flight(resolve(plan)), bag), bag


def recorded_anew(bag: Path, folder: Path, keep: Callable[[Topic, int], bool]) -> FlightLog:
    """The flight of some of a bag's messages, by topic and stamp in ticks."""
    flight = Flight(resolve(FlightPlan(faults=FAULTS, duration=TICKS * 0.0005, case="2")))
    recorder = BagRecorder(folder, flight.description, flight.timebase)
    for topic, data in messages_of(bag):
        if not topic.has_stamp or keep(topic, header_stamp_ns(data) // 500_000):
            recorder.record(topic, data)
    recorder.close()
    return read_flight(folder)


def test_sensors_that_tell_the_truth_need_no_second_word(tmp_path: Path) -> None:
    """Nor is a bag without it incomplete."""
    log = simulate(Flight(resolve(FlightPlan(duration=0.02))), tmp_path / "bag")
    recorded = read_flight(tmp_path / "bag")
    for one in (log, recorded):
        assert one.measured is None
        assert one.assumed_error is None
        assert one.as_measured() is one
    assert recorded.lost == {topic.full_name: 0 for topic in topics.ALL}
    for topic in topics.TRUTH:
        account = read_accounts(tmp_path / "bag")[topic.full_name]
        assert (account["received"], account["missing"]) == (0, 0)
    assert not recorded.damage
    report = analyze(recorded)
    assert report["navigation_error"] is None
    assert "navigation_error" not in report["unavailable"]
    assert not report["truth_recorded"]


def test_half_a_truth_is_none(flown: tuple[FlightLog, Path], tmp_path: Path) -> None:
    log = recorded_anew(flown[1], tmp_path / "bag", lambda t, _: t is not topics.TRUTH_BASE)
    assert log.measured is None
    assert flown[0].measured is not None
    np.testing.assert_array_equal(log.quaternion, flown[0].measured.quaternion)
    assert any("only /truth/joints is there" in text for text in log.damage)


def test_a_truth_that_is_missing_is_a_loss(flown: tuple[FlightLog, Path], tmp_path: Path) -> None:
    log = recorded_anew(
        flown[1], tmp_path / "bag", lambda t, tick: t is not topics.TRUTH_BASE or tick != 60
    )
    assert log.lost["/truth/base"] == 1
    assert np.flatnonzero(~log.whole).tolist() == [*range(60, 80)]
    assert log.damage


def test_states_kept_back_are_filled_in_beside_a_whole_truth(
    flown: tuple[FlightLog, Path], tmp_path: Path
) -> None:
    """With what was told last: the truth has no gap."""
    kept_back = (20, 21, 100, TICKS - 1)
    sensed = (topics.JOINT_STATES, topics.BASE_STATE)
    log = recorded_anew(
        flown[1], tmp_path / "bag", lambda t, tick: t not in sensed or tick not in kept_back
    )
    original = flown[0]
    assert log.filled == len(kept_back)
    assert log.ticks == TICKS
    assert log.whole.all()
    assert log.measured is not None
    assert original.measured is not None
    for name in STATE_FIELDS:
        np.testing.assert_array_equal(getattr(log, name), getattr(original, name), name)
        told = getattr(original.measured, name).copy()
        for tick in kept_back:
            told[tick] = told[tick - 1]
        np.testing.assert_array_equal(getattr(log.measured, name), told, name)
    assert analyze(log)["rms"] == analyze(original)["rms"]
