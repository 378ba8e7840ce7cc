"""Recorded flights answered anew: the bag as it is read, the controller that it asks for, and what
is found of the answers.
"""

from __future__ import annotations

import csv
import json
import math
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from bags import entries_of, messages_in, rosbags_bag
from flights import planned, simulated, space_robot_here
from hypothesis import given, settings
from hypothesis import strategies as st

from space_robot.flight.replay.choice import ControllerChoice
from space_robot.flight.replay.recording import COMPARED, Recording
from space_robot.flight.replay.run import ReferenceStream, replay
from space_robot_msgs_py import topics
from space_robot_msgs_py.bag.folder import open_bag
from space_robot_msgs_py.bag.reader import read_flight
from space_robot_msgs_py.bag.recorder import BagRecorder
from space_robot_msgs_py.errors import InputError

STATES = (topics.JOINT_STATES, topics.BASE_STATE)
TICKS = 400


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    bag = tmp_path_factory.mktemp("recorded") / "bag"
    simulated(bag, duration=TICKS * 0.0005, controller="ctc")
    return bag


def copied(bag: Path, copy: Path, keeps: Callable[[str, int], bool], **flight: Any) -> Recording:
    """Another recorder's bag of those messages that it ``keeps``, by topic and number from 1."""
    recorder = BagRecorder(copy, flight, Recording(bag).timebase)
    counts = dict.fromkeys(topics.BY_NAME, 0)
    for name, data in messages_in(bag):
        counts[name] += 1
        if keeps(name, counts[name]):
            recorder.record(topics.BY_NAME[name], data, 1, counts[name])
    recorder.close()
    return Recording(copy)


def ticks_of(recording: Recording, *bounds: int) -> list[int]:
    return [state.tick for state in recording.states(STATES, *bounds)]


def test_states_and_references_come_as_recorded(bag: Path, tmp_path: Path) -> None:
    """Each state with both halves; references from the one on that covers the start."""
    recording = Recording(bag)
    assert (recording.is_whole, recording.unfinished, recording.damage) == (True, "", ())
    assert (recording.first_gap, recording.lost_commands) == (math.inf, 0)
    assert ticks_of(recording) == list(range(400))
    assert ticks_of(recording, 100, 300) == list(range(100, 300))
    recorded = [data for _, data in messages_in(bag, topics.BASE_STATE)]
    assert [state.messages[1] for state in recording.states(STATES)] == recorded
    lost = {("/joint_states", 11), ("/base/state", 21)}
    halves = copied(bag, tmp_path / "holes", lambda name, number: (name, number) not in lost)
    assert ticks_of(halves) == [tick for tick in range(400) if tick not in (10, 20)]
    for topic in (topics.REFERENCE_JOINTS, topics.REFERENCE_BASE):
        for start, ticks in ((0, [0, 100, 200, 300]), (250, [200, 300]), (10_000, [300])):
            assert [tick for tick, _ in recording.references(topic, start)] == ticks


def test_references_are_read_as_late_as_in_flight() -> None:
    """A ``goto`` at tick 150 overwrites what had been sent before it for later ticks."""
    sent = ((tick, str(tick).encode()) for tick in (0, 100, 200, 300, 150, 250, 350))
    read: list[int] = []
    stream = ReferenceStream(
        sent, lambda data: (int(data), np.empty(0)), lambda tick, _: read.append(tick)
    )
    for tick, expected in ((149, [0, 100]), (150, [0, 100, 200, 300, 150])):
        stream.feed(tick)
        assert read == expected


def test_what_the_recorder_missed_is_known(bag: Path, tmp_path: Path) -> None:
    """By what their sender says: where the controller died, ticks without an answer are none."""
    died = {"faults": ["kill_controller@0.05"], "restart_controller": True}
    missed = [("/command", number) for number in range(101, 131)]
    late = copied(bag, tmp_path / "late", lambda *message: message not in missed, **died)
    assert late.lost_commands == 30
    with pytest.raises(InputError, match="no messages on /reference/joints"):
        copied(bag, tmp_path / "bag", lambda name, number: "reference" not in name)


def cut_bag(bag: Path, part: float) -> Path:
    """A copy whose file ends after a part of its bytes."""
    cut = bag.with_name("cut")
    shutil.rmtree(cut, ignore_errors=True)
    shutil.copytree(bag, cut)
    (file,) = cut.glob("*.mcap")
    content = file.read_bytes()
    file.write_bytes(content[: int(part * len(content))])
    return cut


@settings(max_examples=8, deadline=None)
@given(st.floats(0.02, 1.0))
def test_what_is_cut_is_told_as_analyze_does_and_what_is_whole_is_sent(
    bag: Path, part: float
) -> None:
    """The states that are sent are those of ticks that are whole, byte by byte as recorded."""
    cut = cut_bag(bag, part)
    try:
        log = read_flight(cut)
    except InputError:
        with pytest.raises(InputError):
            Recording(cut)
        return
    recording = Recording(cut)
    assert (recording.unfinished, recording.damage) == (log.unfinished, log.damage)
    counts, all_counts = open_bag(cut).counts(), open_bag(bag).counts()
    names = [topic.full_name for topic in COMPARED]
    lost = any(counts.get(name, 0) < all_counts.get(name, 0) for name in names)
    assert recording.is_whole == (not log.unfinished and not lost)
    sent = {state.tick: state for state in recording.states(STATES)}
    assert list(sent) == np.flatnonzero(log.whole).tolist()
    every = {state.tick: state for state in Recording(bag).states(STATES)}
    assert all(state == every[tick] for tick, state in sent.items())
    missing = sorted(set(range(log.ticks)) - set(sent))
    if not recording.is_whole:
        assert recording.first_gap == (missing[0] if missing else log.ticks)


# The controller that it asks for


def described(**options: Any) -> dict[str, Any]:
    """A flight's description as a bag has it."""
    description: dict[str, Any] = json.loads(json.dumps(planned(**options).description))
    return description


def test_robot_and_gains_are_the_recorded_numbers(tmp_path: Path) -> None:
    """Whatever the files of their names say here, and without them."""
    flight = described(swaps=["0.1:ctc"])
    flight["scenario"]["gains"]["tde_stc"]["k_1"] = [7.0] * 9
    flight["robot_file"]["robot"]["base"]["mass"] = 1234.5
    choice = ControllerChoice(flight)
    assert choice.is_as_flown
    # by their numbers: the default gains of this law are the printed ones
    for controller, gains, is_as_flown in (
        ("tde_stc", "", True),
        ("", "printed", True),
        ("", "tuned", False),
        ("ctc", "", False),
    ):
        other = ControllerChoice(described(), controller, gains)
        assert other.is_as_flown is is_as_flown
    robot = choice.robot
    assert (robot.name, robot.mass[0], choice.law_name) == ("paper", 1234.5, "tde_stc")
    assert choice.swaps == ["0.1:ctc"]
    _, _, laws = choice.build_supervisor()
    assert laws["tde_stc"].gain_values["k_1"].tolist() == [7.0] * 9
    assert "ctc" in laws
    with pytest.raises(InputError, match="does not say which law was flown"):
        ControllerChoice({})


# Answered anew


def test_a_changed_gain_is_found_with_exit_code_1(bag: Path) -> None:
    gain = "controller.ctc.k_p=[9e3]"
    result = space_robot_here("replay", str(bag), "--set", gain, "--json")
    assert result.returncode == 1
    first = json.loads(result.stdout)["first_difference"]
    assert first["tick"] == 1  # at rest there is no error for a gain to act on
    assert {field["field"][:7] for field in first["fields"]} == {"effort["}
    for field in first["fields"]:
        assert field["recorded"] != field["replayed"]
        assert field["difference"] == field["replayed"] - field["recorded"]
    assert "differ from tick 1 (t = 0.0005 s) on" in result.stderr.splitlines()[-1]


def test_another_law_answers_a_bag_of_ros2_bag_record_and_is_not_judged(
    bag: Path, tmp_path: Path
) -> None:
    """It has no description: what flew is what /controller/law says."""
    plain = rosbags_bag(tmp_path / "bag", entries_of(bag), lambda writer: None)
    table, plot = tmp_path / "torques.csv", tmp_path / "torques.png"
    written = ("--csv", str(table), "--plot", str(plot))
    result = space_robot_here("replay", str(plain), "--controller", "tde_stc", *written)
    assert result.returncode == 0, result.stderr
    assert "open loop" in result.stdout
    rows = list(csv.DictReader(table.open()))
    assert [int(row["tick"]) for row in rows] == list(range(TICKS))
    torque = {
        which: np.array([float(row[f"joint1_{which}"]) for row in rows])
        for which in ("recorded", "replayed")
    }
    assert 0.0 < np.abs(torque["replayed"] - torque["recorded"]).max() < 1.0
    assert plot.stat().st_size > 10_000
    assert plot.with_suffix(".svg").exists()


def test_without_any_commands_a_flight_is_only_shown(bag: Path, tmp_path: Path) -> None:
    flight = json.loads(open_bag(bag).custom_data()["space_robot.flight"])
    copied(bag, tmp_path / "none", lambda name, number: name != "/command", **flight)
    done = replay(tmp_path / "none")
    assert done.has_passed
    assert not done.is_judged
    assert done.report()["played"] == TICKS


def test_a_part_is_compared_by_itself(bag: Path) -> None:
    """A law without memory is equal again once it has taken over from the applied torque."""
    part = replay(bag, start_s=0.05, end_s=0.15)
    assert part.comparison.ticks.tolist() == list(range(100, 300))
    assert part.comparison.equal[41:].all()  # the transfer lasts 20 ms
    assert not part.comparison.equal[1]


def test_an_unfinished_bag_is_compared_to_its_end_and_not_passed(bag: Path) -> None:
    cut = cut_bag(bag, 0.8)
    result, log = space_robot_here("replay", str(cut), "--json"), read_flight(cut)
    report = json.loads(result.stdout)
    (stretch,) = report["stretches"]
    assert (stretch["from_s"], stretch["equal"]) == (0.0, stretch["compared"])
    assert stretch["compared"] in range(log.ticks - 1, log.ticks + 1)
    assert not report["differs"]
    assert report["unfinished"] == log.unfinished != ""
    assert (report["passed"], report["whole"], result.returncode) == (False, False, 1)


def test_a_bag_without_its_robot_is_refused_in_one_line(tmp_path: Path) -> None:
    simulated(tmp_path / "flown", robot="seven_joint", duration=0.01)
    bag = rosbags_bag(tmp_path / "bag", entries_of(tmp_path / "flown"), lambda writer: None)
    with pytest.raises(InputError, match="which robot was flown, with 7 joints: name it with"):
        replay(bag)
