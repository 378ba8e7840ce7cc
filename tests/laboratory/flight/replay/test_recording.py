"""A bag as a replay reads it, whole or damaged, and the controller it asks for."""

from __future__ import annotations

import math
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from flights import planned, simulated
from hypothesis import given, settings
from hypothesis import strategies as st
from rosbags.rosbag2 import StoragePlugin, Writer

from space_robot.flight.replay.choice import ControllerChoice
from space_robot.flight.replay.recording import COMPARED, Recording
from space_robot_control.controller.gains import build_laws, split_gains
from space_robot_control.controller.settings import ControllerNodeSettings
from space_robot_msgs_py import topics
from space_robot_msgs_py.bag.folder import open_bag
from space_robot_msgs_py.bag.reader import read_flight
from space_robot_msgs_py.bag.recorder import BagRecorder
from space_robot_msgs_py.config.files import named_file
from space_robot_msgs_py.config.validation import read_yaml
from space_robot_msgs_py.errors import InputError
from space_robot_msgs_py.wire.definitions import jazzy

STATES = (topics.JOINT_STATES, topics.BASE_STATE)


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("replay") / "bag"
    simulated(path, duration=0.2)
    return path


def copied(bag: Path, copy: Path, keeps: Callable[[str, int], bool], **flight: Any) -> Recording:
    """Another recorder's bag of those messages that it ``keeps``, by topic and number from 1."""
    recorder = BagRecorder(copy, flight, Recording(bag).timebase)
    counts = dict.fromkeys(topics.BY_NAME, 0)
    for name, data in open_bag(bag).messages(*topics.ALL):
        counts[name] += 1
        if keeps(name, counts[name]):
            sender = b"participant 0001"
            recorder.record(topics.BY_NAME[name], data, 1, sender, counts[name])
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
    recorded = [data for _, data in open_bag(bag).messages(topics.BASE_STATE)]
    assert [state.messages[1] for state in recording.states(STATES)] == recorded
    lost = {("/joint_states", 11), ("/base/state", 21)}
    halves = copied(bag, tmp_path / "holes", lambda name, number: (name, number) not in lost)
    assert ticks_of(halves) == [tick for tick in range(400) if tick not in (10, 20)]
    for topic in (topics.REFERENCE_JOINTS, topics.REFERENCE_BASE):
        for start, ticks in ((0, [0, 100, 200, 300]), (250, [200, 300]), (10_000, [300])):
            assert [r.tick for r in recording.references(topic, start)] == ticks


def test_commands_that_the_recorder_missed_are_known(bag: Path, tmp_path: Path) -> None:
    """By what their sender says: where the controller died, ticks without an answer are none."""
    died = {"faults": ["kill_controller@0.05"], "restart_controller": True}
    late = copied(
        bag, tmp_path / "late", lambda name, k: name != "/command" or not 100 < k <= 130, **died
    )
    assert late.lost_commands == 30


def test_topics_of_other_names_are_remapped(bag: Path, tmp_path: Path) -> None:
    with Writer(tmp_path / "bag", version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        store: dict[str, Any] = {"typestore": jazzy()}
        connections = {
            topic.full_name: writer.add_connection(f"/arm{topic.full_name}_1", topic.type, **store)
            for topic in topics.ALL
        }
        for number, (name, data) in enumerate(open_bag(bag).messages(*topics.ALL)):
            writer.write(connections[name], number, data)
    with pytest.raises(InputError, match=r"on /joint_states \(it has /arm/command_1, /arm/j"):
        Recording(tmp_path / "bag")
    remapped = Recording(tmp_path / "bag", {f"/arm{name}_1": name for name in topics.BY_NAME})
    here = Recording(bag)
    assert list(remapped.states(STATES)) == list(here.states(STATES))
    axes = planned().robot.axis_names
    np.testing.assert_array_equal(remapped.commands(axes).torque, here.commands(axes).torque)


def test_a_bag_without_references_is_refused(bag: Path, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no messages on /reference/joints"):
        copied(bag, tmp_path / "bag", lambda name, number: "reference" not in name)
    (tmp_path / "empty").mkdir()
    with pytest.raises(InputError, match="not a bag"):
        Recording(tmp_path / "empty")


@settings(max_examples=5, deadline=None)
@given(st.lists(st.floats(0.01, 1.0), max_size=4), st.one_of(st.just(1.0), st.floats(0.3, 1.0)))
def test_what_is_damaged_is_told_as_analyze_does_and_what_is_whole_is_sent(
    bag: Path, flips: list[float], cut: float
) -> None:
    """The states that are sent are those of ticks that are whole, byte by byte as recorded."""
    hurt = bag.with_name("hurt")
    shutil.rmtree(hurt, ignore_errors=True)
    shutil.copytree(bag, hurt)
    (file,) = hurt.glob("*.mcap")
    content = bytearray(file.read_bytes())
    for part in flips:
        content[int(part * (len(content) - 1))] ^= 0x10
    file.write_bytes(content[: int(cut * len(content))])
    try:
        log = read_flight(hurt)
    except InputError:
        with pytest.raises(InputError):
            Recording(hurt)
        return
    recording, whole = Recording(hurt), Recording(bag)
    assert (recording.unfinished, recording.damage) == (log.unfinished, log.damage)
    counts, all_counts = open_bag(hurt).counts(), open_bag(bag).counts()
    names = [topic.full_name for topic in COMPARED]
    lost = any(counts.get(name, 0) < all_counts.get(name, 0) for name in names)
    assert recording.is_whole == (not log.unfinished and not lost)
    sent = {state.tick: state for state in recording.states(STATES)}
    assert list(sent) == np.flatnonzero(log.whole).tolist()
    recorded = {state.tick: state for state in whole.states(STATES)}
    assert all(state == recorded[tick] for tick, state in sent.items())
    missing = sorted(set(range(log.ticks)) - set(sent))
    if not recording.is_whole:
        assert recording.first_gap == (missing[0] if missing else log.ticks)


# The controller that it asks for


def described(**options: Any) -> dict[str, Any]:
    """A flight's description with all a bag may hold."""
    flight = planned(**options)
    law = flight.controller.law
    return {
        **flight.description,
        "parameters": {"controller": flight.scenario.parameters["controller"]},
        "gains_used": {name: row.tolist() for name, row in law.gain_values.items()},
        "robot_file": read_yaml(named_file("robots", flight.scenario.options.robot)),
    }


def test_robot_and_gains_are_the_recorded_numbers(tmp_path: Path) -> None:
    """Whatever the files of their names say here, and without them."""
    flight = described(swaps=["0.1:ctc"])
    told = flight["parameters"]["controller"]
    told |= {"tde_stc.k_1": [7.0] * 9, "robot": "/else/where.yaml", "gains": "/else/gains"}
    flight["robot_file"]["robot"]["base"]["mass"] = 1234.5
    choice = ControllerChoice(flight, tmp_path)
    assert choice.is_as_flown
    assert (choice.robot.name, choice.robot.mass[0], choice.law_name) == (
        "paper",
        1234.5,
        "tde_stc",
    )
    assert choice.swaps == ["0.1:ctc"]
    own, gains = split_gains(choice.parameters)
    laws = build_laws(ControllerNodeSettings.resolve(own), 9, gains)
    assert laws["tde_stc"].gain_values["k_1"].tolist() == [7.0] * 9
    assert "ctc" in laws


@pytest.mark.parametrize(
    ("controller", "gains", "is_as_flown"),
    [
        ("", "", True),
        ("tde_stc", "", True),
        ("", "default", True),
        ("", "printed", True),
        ("", "tuned", False),
        ("ctc", "", False),
    ],
)
def test_law_and_gains_that_flew_are_recognised(
    tmp_path: Path, controller: str, gains: str, is_as_flown: bool
) -> None:
    """By their numbers: the default gains of this law are the printed ones."""
    choice = ControllerChoice(described(), tmp_path, controller, gains)
    assert choice.is_as_flown is is_as_flown


@pytest.mark.parametrize(
    ("flight", "options", "said"),
    [
        ({}, {}, "does not say which law was flown"),
        (None, {"controller": "pid"}, "unknown controller 'pid'"),
        (None, {"gains": "old"}, "unknown gain set 'old'"),
        (None, {"chosen": {"tde_stc.k_9": [1.0]}}, "unknown gain of tde_stc 'k_9'"),
        (None, {"chosen": {"pid.k": [1.0]}}, "unknown law 'pid' in controller parameters"),
        (None, {"chosen": {"tde_stc.h_bar": [-1.0]}}, "above 0"),
        (None, {"chosen": {"hold_tick": 1}}, "unknown key"),
    ],
)
def test_what_cannot_be_is_named(
    tmp_path: Path, flight: dict[str, Any] | None, options: dict[str, Any], said: str
) -> None:
    with pytest.raises(InputError, match=said):
        ControllerChoice(described() if flight is None else flight, tmp_path, **options)
