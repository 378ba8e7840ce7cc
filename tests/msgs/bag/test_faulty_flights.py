"""Flights where something failed, or sensors told no truth: no more is shown than there was."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from bags import FLIGHT, TIMEBASE, Recorded, messages_of, read_accounts, record

from space_robot.analysis import analyze
from space_robot.analysis.words import with_statistic
from space_robot.flight.plan import Flight, Scenario, resolve
from space_robot.flight.simulate import simulate
from space_robot_msgs_py import topics
from space_robot_msgs_py.bag.flight_log import REFERENCE, FlightLog
from space_robot_msgs_py.bag.mcap_storage import McapStorage
from space_robot_msgs_py.bag.reader import fill_gaps, read_flight, timebase_of
from space_robot_msgs_py.bag.recorder import BagRecorder
from space_robot_msgs_py.samples import STATE_FIELDS
from space_robot_msgs_py.wire.cdr import header_stamp_ns
from space_robot_msgs_py.wire.telemetry import ClockCodec

KEPT_BACK = (30, 31, 150, 250, 251, 252)
"""Ticks whose state a fault keeps back."""
NO_ANSWER = (60, 61, 299)
SENSED = (topics.JOINT_STATES, topics.BASE_STATE)


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Recorded:
    return record(tmp_path_factory.mktemp("whole") / "bag")


def _faulty(
    recorded: Recorded, folder: Path, drop: Callable[[topics.Topic, int], bool] | None = None
) -> Path:
    """The same flight with states kept back and answers missing, in chunks of 100 ticks.

    Messages that ``drop`` names are lost on their way, by their publisher's count.
    """
    flight = {**FLIGHT, "faults": ["drop_state@0-1:0.1"]}
    recorder, sent = BagRecorder(folder, flight, TIMEBASE), Counter[topics.Topic]()
    for topic, data in messages_of(recorded.folder):
        if topic is topics.REFERENCE_JOINTS and sent[topic]:
            recorder.flush()
        tick = header_stamp_ns(data) // TIMEBASE.period_ns
        if topic in (*SENSED, topics.COMMAND) and tick in KEPT_BACK:
            continue
        if topic is topics.COMMAND and tick in NO_ANSWER:
            continue
        sent[topic] += 1
        if drop is None:
            recorder.record(topic, data)
        elif not drop(topic, tick):
            recorder.record(topic, data, 0, sent[topic])
    recorder.close()
    return folder


def test_states_kept_back_are_filled_with_the_one_before(
    recorded: Recorded, tmp_path: Path
) -> None:
    log = read_flight(_faulty(recorded, tmp_path / "bag"))
    assert not any(log.lost.values())
    assert log.unanswered == len(KEPT_BACK) + len(NO_ANSWER)
    assert log.filled == len(KEPT_BACK)
    assert log.whole.all()
    before = np.arange(log.ticks)
    for tick in KEPT_BACK:
        before[tick] = before[tick - 1]
    np.testing.assert_array_equal(log.joint_positions, recorded.log.joint_positions[before])
    np.testing.assert_array_equal(log.reference_base, recorded.log.reference_base)


def test_nothing_is_filled_where_the_recorder_lost_states(
    recorded: Recorded, tmp_path: Path
) -> None:
    """By the publisher's count: one that was sent, and none of those that were kept back."""
    bag = _faulty(recorded, tmp_path / "bag", lambda topic, tick: topic in SENSED and tick == 200)
    log = read_flight(bag)
    assert log.lost == {topic.full_name: int(topic in SENSED) for topic in topics.ALL}
    assert log.filled == 0
    assert np.flatnonzero(~log.whole).tolist() == sorted((*KEPT_BACK, 200))


def test_a_filled_reference_is_at_rest() -> None:
    log = FlightLog.allocate(6, ("a", "b"), TIMEBASE)
    for name in (*STATE_FIELDS, *REFERENCE):
        column = getattr(log, name)
        column[:] = np.arange(1.0, column.size + 1.0).reshape(column.shape)
    joints, base = log.reference_joints.copy(), log.reference_base.copy()
    log.reference_joints[2:4] = log.reference_base[2:4] = np.nan
    fill_gaps(log)
    joints[2:4, 0], joints[2:4, 1:] = joints[1, 0], 0.0
    base[2:4, :4], base[2:4, 4:] = base[1, :4], 0.0
    np.testing.assert_array_equal(log.reference_joints, joints)
    np.testing.assert_array_equal(log.reference_base, base)


@pytest.mark.parametrize(
    ("steps", "flight", "period_ns", "is_told"),
    [
        ([500_000] * 5, {}, 500_000, False),
        ([1_000_000] * 5, {}, 1_000_000, True),  # flown with a multiple
        ([1_000_000] * 5, {"faults": ["drop_state@0-1"]}, 500_000, False),  # each other kept back
        ([750_000] * 5, {"faults": ["drop_state@0-1"]}, 750_000, True),
        ([250_000] * 5, {"realtime": True}, 250_000, True),
        ([500_000, 1_000_000, 500_000], {}, 500_000, False),
        ([], {}, 500_000, False),
    ],
)
def test_the_period_described_is_believed_if_the_stamps_allow(
    steps: Sequence[int], flight: dict[str, Any], period_ns: int, is_told: bool
) -> None:
    stamps = np.cumsum([0, *steps]).tolist()
    timebase, doubt = timebase_of(stamps, {"period": 0.0005, **flight})
    assert (timebase.period_ns, bool(doubt)) == (period_ns, is_told)


def test_bad_stamps_between_good_ones_are_kept_at_the_time_of_the_last_good_one(
    tmp_path: Path,
) -> None:
    """In log time a bag rises, whatever was in its messages; and no good one is left out."""
    recorder, codec, expected = BagRecorder(tmp_path / "bag", {}, TIMEBASE), ClockCodec(), []
    for tick in range(0, 400, 20):
        good_ns = tick * TIMEBASE.period_ns
        bad = (10**6 * TIMEBASE.period_ns, good_ns + 123, 10**7 * TIMEBASE.period_ns)
        for stamp_ns in (good_ns, *(bad[: tick // 20 % 4])):
            recorder.record(topics.CLOCK, codec.encode(stamp_ns))
            expected.append((stamp_ns, good_ns))
    recorder.close()
    (batch,) = McapStorage(tmp_path / "bag" / "bag_0.mcap").batches()
    assert list(zip(batch.stamps.tolist(), batch.log_ns.tolist(), strict=True)) == expected
    counted = recorder.accounting[topics.CLOCK.full_name]
    assert (counted.received, counted.invalid_stamps) == (20, len(expected) - 20)
    assert recorder.lost[topics.CLOCK.full_name] == 0


# The true states beside the measured ones

NOISE = ["noise_attitude@0.01:1e-5", "noise_gyro@0-0.1:1e-6", "noise_joint_position@0:1e-5"]
FAULTS = [*NOISE, "torque_scale@0.05:joints=0.998"]


@pytest.fixture(scope="module")
def flown(tmp_path_factory: pytest.TempPathFactory) -> tuple[FlightLog, Path]:
    bag = tmp_path_factory.mktemp("truth") / "bag"
    plan = Scenario(faults=FAULTS, duration=0.2, case="2")
    return simulate(Flight(resolve(plan)), bag), bag


def recorded_anew(bag: Path, folder: Path, keep: Callable[[topics.Topic, int], bool]) -> FlightLog:
    """The flight of some of a bag's messages, by topic and stamp in ticks."""
    flight = Flight(resolve(Scenario(faults=FAULTS, duration=0.2, case="2")))
    recorder = BagRecorder(folder, flight.description, flight.timebase)
    for topic, data in messages_of(bag):
        if not topic.has_stamp or keep(topic, header_stamp_ns(data) // TIMEBASE.period_ns):
            recorder.record(topic, data)
    recorder.close()
    return read_flight(folder)


def test_sensors_that_tell_the_truth_need_no_second_word(tmp_path: Path) -> None:
    """Nor is a bag without it incomplete."""
    log = simulate(Flight(resolve(Scenario(duration=0.02))), tmp_path / "bag")
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
    assert "navigation" not in {**report["metrics"], **report["unavailable"]}
    assert not report["truth_recorded"]


def rms_of(log: FlightLog) -> dict[str, float]:
    return with_statistic(analyze(log)["metrics"], "rms_eq64")


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
    kept_back = (20, 21, 100, 399)
    log = recorded_anew(
        flown[1], tmp_path / "bag", lambda t, tick: t not in SENSED or tick not in kept_back
    )
    original = flown[0]
    assert log.filled == len(kept_back)
    assert log.ticks == 400
    assert log.whole.all()
    assert log.measured is not None
    assert original.measured is not None
    for name in STATE_FIELDS:
        np.testing.assert_array_equal(getattr(log, name), getattr(original, name), name)
        told = getattr(original.measured, name).copy()
        for tick in kept_back:
            told[tick] = told[tick - 1]
        np.testing.assert_array_equal(getattr(log.measured, name), told, name)
    assert rms_of(log) == rms_of(original)
