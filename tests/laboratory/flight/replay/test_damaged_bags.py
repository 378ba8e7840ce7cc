"""Bags cut off and with bytes changed: told as `analyze` tells them, and never passed."""

from __future__ import annotations

import json
import math
import shutil
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from flights import space_robot_here
from hypothesis import given, settings
from hypothesis import strategies as st

from space_robot.flight.plan import Flight, FlightPlan, resolve
from space_robot.flight.replay.commands import Form, ReplayedCommands
from space_robot.flight.replay.comparison import Comparison
from space_robot.flight.replay.recording import COMPARED, Recording
from space_robot.flight.simulate import simulate
from space_robot_msgs_py import topics
from space_robot_msgs_py.bag.folder import open_bag
from space_robot_msgs_py.bag.reader import read_flight
from space_robot_msgs_py.errors import InputError

STATES = (topics.JOINT_STATES, topics.BASE_STATE)
TICKS = 900


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("whole") / "bag"
    simulate(Flight(resolve(FlightPlan(controller="ctc", duration=TICKS * 0.0005))), path)
    return path


def hurt(bag: Path, name: str, flips: list[float], cut: float = 1.0) -> Path:
    """Return a copy with a byte changed at each of these parts of its file, and cut off there."""
    copied = bag.with_name(name)
    shutil.rmtree(copied, ignore_errors=True)
    shutil.copytree(bag, copied)
    file = next(copied.glob("*.mcap"))
    content = bytearray(file.read_bytes())
    for part in flips:
        content[int(part * (len(content) - 1))] ^= 0x10
    file.write_bytes(content[: int(cut * len(content))])
    return copied


def test_a_whole_bag_is_whole(bag: Path) -> None:
    recording = Recording(bag)
    assert (recording.is_whole, recording.unfinished, recording.damage) == (True, "", ())
    assert recording.first_gap == math.inf


@settings(max_examples=8, deadline=None)
@given(st.lists(st.floats(0.01, 1.0), max_size=4), st.one_of(st.just(1.0), st.floats(0.3, 1.0)))
def test_what_is_damaged_is_told_as_analyze_does_and_what_is_whole_is_sent(
    bag: Path, flips: list[float], cut: float
) -> None:
    """The states that are sent are those of ticks that are whole, byte by byte as recorded."""
    copied = hurt(bag, "hurt", flips, cut)
    try:
        log = read_flight(copied)
    except InputError:
        with pytest.raises(InputError):
            Recording(copied)
        return
    recording, whole = Recording(copied), Recording(bag)
    assert (recording.unfinished, recording.damage) == (log.unfinished, log.damage)
    counts = open_bag(copied).counts()
    lost = any(counts.get(t.full_name, 0) < n for t, n in count_compared(bag).items())
    assert recording.is_whole == (not log.unfinished and not lost)
    sent = {state.tick: state for state in recording.states(STATES)}
    assert list(sent) == np.flatnonzero(log.whole).tolist()
    recorded = {state.tick: state for state in whole.states(STATES)}
    assert all(state == recorded[tick] for tick, state in sent.items())
    missing = sorted(set(range(log.ticks)) - set(sent))
    if not recording.is_whole:
        assert recording.first_gap == (missing[0] if missing else log.ticks)


def count_compared(bag: Path) -> dict[topics.Topic, int]:
    counts = open_bag(bag).counts()
    return {topic: counts.get(topic.full_name, 0) for topic in COMPARED}


@given(
    st.sets(st.integers(0, 60), min_size=1),
    st.sets(st.integers(0, 60)),
    st.sets(st.integers(0, 60)),
)
def test_stretches_are_runs_of_ticks(
    recorded: set[int], replayed: set[int], other: set[int]
) -> None:
    """Together they are all that was compared; none touches another."""

    def commands(ticks: set[int], are_other: bool) -> ReplayedCommands:
        torque = np.array([[float(are_other and tick in other)] for tick in sorted(ticks)])
        return ReplayedCommands(
            np.array(sorted(ticks), dtype=np.int64),
            torque.reshape(-1, 1),
            np.zeros(len(ticks), dtype=np.intp),
            [Form("", "")],
            0,
        )

    compared = Comparison(
        ("base_x",), np.arange(61), commands(recorded, False), commands(replayed, True)
    )
    covered = [set(range(s.first, s.last + 1)) for s in compared.stretches]
    assert set().union(*covered) == recorded & replayed
    assert all(before.last + 1 < after.first for before, after in pairwise(compared.stretches))
    assert [s.equal for s in compared.stretches] == [len(ticks - other) for ticks in covered]


def test_a_damaged_bag_is_compared_stretch_by_stretch_and_not_passed(bag: Path) -> None:
    """Before the gap every bit is equal; after it from when CTC has taken over, 20 ms later."""
    pytest.importorskip("rclpy")
    copied = hurt(bag, "gap", [0.5])
    result = space_robot_here("replay", str(copied), "--json")
    report = json.loads(result.stdout)
    before, after = report["stretches"]
    whole = read_flight(copied).whole
    edges = np.flatnonzero(np.diff(whole.astype(int)))
    for s, tick in ((before["to_s"], edges[0]), (after["from_s"], edges[1] + 1)):
        assert s == pytest.approx(0.0005 * tick, abs=0.001)  # a tick's command may be lost alone
    assert (before["from_s"], before["equal"]) == (0.0, before["compared"])
    assert after["equal"] == after["compared"] - 40
    assert not report["differs"]
    assert report["first_gap_s"] == pytest.approx(0.0005 * (edges[0] + 1))
    assert tuple(report["damage"]) == read_flight(copied).damage
    assert (report["passed"], report["whole"], result.returncode) == (False, False, 1)


def test_a_cut_bag_is_not_passed_though_all_that_is_left_is_equal(bag: Path) -> None:
    pytest.importorskip("rclpy")
    result = space_robot_here("replay", str(hurt(bag, "cut", [], 0.5)), "--json")
    report = json.loads(result.stdout)
    assert 100 < report["compared"] == report["equal"] < TICKS
    assert report["unfinished"] == read_flight(bag.with_name("cut")).unfinished
    assert (report["identical"], report["passed"], result.returncode) == (True, False, 1)
