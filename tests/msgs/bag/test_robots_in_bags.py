"""Bags of robots in namespaces: the one that is meant is read, under whatever names it was."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from bags import (
    FLIGHT,
    TIMEBASE,
    Entry,
    Recorded,
    assert_same_flight,
    entries_of,
    mcap_of,
    messages_of,
    record,
    within,
)

from space_robot import load_bag
from space_robot_msgs_py import topics
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.bag.folder import open_bag
from space_robot_msgs_py.bag.reader import read_flight
from space_robot_msgs_py.bag.recorder import BagRecorder
from space_robot_msgs_py.config.namespace import full_namespace
from space_robot_msgs_py.errors import InputError


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Recorded:
    return record(tmp_path_factory.mktemp("whole") / "bag", ticks=60, ticks_a_chunk=30)


@pytest.fixture(scope="module")
def entries(recorded: Recorded) -> list[Entry]:
    return entries_of(recorded.folder)


def recorded_as(
    folder: Path, recorded: Recorded, namespace: str, names: dict[str, str] | None = None
) -> Path:
    """The same messages once more, by our recorder in a namespace."""
    recorder = BagRecorder(folder, FLIGHT, TIMEBASE, names=names, namespace=namespace)
    for topic, data in messages_of(recorded.folder):
        recorder.record(topic, data)
    recorder.close()
    return folder


def test_a_bag_holds_full_names_and_is_read_all_the_same(
    recorded: Recorded, tmp_path: Path
) -> None:
    bag = recorded_as(tmp_path / "bag", recorded, "/fleet/sat1")
    assert set(open_bag(bag).topics()) == {
        t.recorded.in_namespace("/fleet/sat1") for t in topics.RECORDED
    }
    log = load_bag(bag)
    assert_same_flight(log, recorded.log)
    assert (log.namespace, recorded.log.namespace) == ("/fleet/sat1", "/")
    assert log.lost == recorded.log.lost


def test_a_recorder_without_a_namespace_writes_the_same_bytes(
    recorded: Recorded, tmp_path: Path
) -> None:
    names = {topic.name: topic.full_name for topic in topics.ALL}
    files = [
        next(recorded_as(tmp_path / f"{i}" / "bag", recorded, "/", given).glob("*.mcap"))
        for i, given in enumerate((None, names))
    ]
    assert files[0].read_bytes() == files[1].read_bytes()


def test_topics_that_were_remapped_are_found_by_what_the_recorder_noted(
    recorded: Recorded, tmp_path: Path
) -> None:
    names = {topic.name: topic.in_namespace("/sat1") for topic in topics.ALL}
    names |= {"joint_states": "/arm/measured", "clock": "/clock"}
    bag = recorded_as(tmp_path / "bag", recorded, "/sat1", names)
    log = read_flight(bag)
    assert_same_flight(log, recorded.log)
    assert log.namespace == "/sat1"
    other = read_flight(bag, {"/sat1/command": "/command"})  # beside what was noted
    assert_same_flight(other, recorded.log)


def test_of_several_robots_one_is_to_be_chosen(
    recorded: Recorded, entries: list[Entry], tmp_path: Path
) -> None:
    """As `ros2 bag record -a` takes them, in one bag."""
    other = [entry for entry in entries if entry[0] != "/command"]
    both = sorted([*within("/sat1", entries), *within("/sat2", other)], key=lambda e: e[2])
    bag = mcap_of(tmp_path / "x.mcap", both)
    told = "robots of 2 namespaces, /sat1, /sat2: choose one (--namespace)"
    with pytest.raises(InputError, match=re.escape(told)):
        read_flight(bag)
    assert_same_flight(read_flight(bag, namespace="sat1"), recorded.log)
    second = read_flight(bag, namespace="/sat2/")
    assert (second.commanded_torque, second.namespace) == (None, "/sat2")
    with pytest.raises(InputError, match="no robot in namespace /sat3; it has /sat1, /sat2"):
        read_flight(bag, namespace="sat3")


def test_a_robot_in_the_root_namespace_and_another(
    recorded: Recorded, entries: list[Entry], tmp_path: Path
) -> None:
    bag = mcap_of(tmp_path / "x.mcap", [*entries, *within("/sat1", entries)])
    with pytest.raises(InputError, match="robots of 2 namespaces, /, /sat1"):
        read_flight(bag)
    assert_same_flight(read_flight(bag, namespace="/"), recorded.log)


def test_topics_alike_do_not_make_a_robot(
    recorded: Recorded, entries: list[Entry], tmp_path: Path
) -> None:
    """Joint states of another machine, and a topic whose type is another."""
    arm = [e for e in within("/arm", entries) if e[0].endswith("joint_states")]
    wrong = [(f"/x{n}", "std_msgs/msg/String", stamp, d) for n, _, stamp, d in entries]
    found: FlightLog = read_flight(mcap_of(tmp_path / "x.mcap", [*arm, *wrong, *entries]))
    assert_same_flight(found, recorded.log)
    with pytest.raises(InputError, match=r"no messages on /base/state .*it has /arm/joint_states"):
        read_flight(mcap_of(tmp_path / "y.mcap", arm))


def test_namespaces_are_names_of_ros() -> None:
    assert [full_namespace(text) for text in ("", "/", "sat1", "/a/b_2/")] == [
        "/",
        "/",
        "/sat1",
        "/a/b_2",
    ]
    for text in ("1sat", "a b", "sat-1", "a//b", "a__b", "~x", "{node}"):
        with pytest.raises(InputError, match="not starting with a digit"):
            full_namespace(text)
