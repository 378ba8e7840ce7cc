"""The recorder's loop without a graph: what it takes, in which turns, and what it leaves out."""

from __future__ import annotations

import json
import time
from collections import deque
from collections.abc import Iterator, Sequence
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from bags import read_accounts

from space_robot_msgs_py import topics
from space_robot_msgs_py.bag.recorder import RecorderNodeSettings
from space_robot_msgs_py.errors import FlightError, InputError
from space_robot_msgs_py.wire.definitions import jazzy
from space_robot_msgs_py.wire.telemetry import ClockCodec

pytest.importorskip("rclpy")

from space_robot_msgs_py import recorder_node
from space_robot_msgs_py.recorder_node import CHECK_PERIOD_S, REPORTS, TIMEOUT_S, TURN, RecorderLoop
from space_robot_msgs_py.ros.endpoints import Received
from space_robot_msgs_py.ros.loop import SENT, Level, Wait

OPTIONAL = [topic for topic in topics.RECORDED if topic.is_optional]
PERIOD_NS = 500_000


class Node:
    """A node without a graph: what it is sent is put into its queues."""

    def __init__(self) -> None:
        self.times_configured = 0
        self.queues: dict[topics.Topic, deque[Received]] = {}
        self.said: list[str] = []
        self.published: set[str] = set()
        self.looks = 0

    def log(self, text: str) -> None:
        self.said.append(text)

    def get_namespace(self) -> str:
        return "/sat1"

    def resolve_topic_name(self, name: str) -> str:
        return "/joints_of_mine" if name == topics.JOINT_STATES.name else f"/sat1/{name}"

    def count_publishers(self, name: str) -> int:
        self.looks += 1
        return int(name in self.published)

    def hear(self, topic: topics.Topic, data: bytes, sequence: int, sent_ns: int = 1) -> None:
        self.queues[topic].append(Received(data, sent_ns, sequence))

    def hear_clock(self, ticks: Sequence[int], sent_ns: int = 1) -> None:
        """Messages whose place among all of their publisher is that of their tick."""
        for tick in ticks:
            data = ClockCodec().encode(tick * PERIOD_NS)
            self.hear(topics.CLOCK, data, tick + 1, sent_ns)

    def hear_sent(self, name: str, count: int, sent_ns: int = 1) -> None:
        self.hear(topics.DIAGNOSTICS, report(f"{SENT}{name}", str(count)), 1, sent_ns)


class Subscription:
    def __init__(self, node: Node, topic: topics.Topic, group: object, depth: int = 0) -> None:
        self.topic, self._queue = topic, node.queues.setdefault(topic, deque())

    def take_with_info(self) -> Received | None:
        return self._queue.popleft() if self._queue else None


def report(*pairs: str) -> bytes:
    """A message of /diagnostics whose one status has these keys and values."""
    types = jazzy().types
    stamp = types["builtin_interfaces/msg/Time"](sec=0, nanosec=0)
    values = [
        types["diagnostic_msgs/msg/KeyValue"](key=key, value=value)
        for key, value in zip(pairs[::2], pairs[1::2], strict=True)
    ]
    status = types["diagnostic_msgs/msg/DiagnosticStatus"](
        level=0, name="node", message="nominal", hardware_id="", values=values
    )
    message = types[topics.DIAGNOSTICS.type](
        header=types["std_msgs/msg/Header"](stamp=stamp, frame_id=""), status=[status]
    )
    return bytes(jazzy().serialize_cdr(message, topics.DIAGNOSTICS.type))


@pytest.fixture
def node(monkeypatch: pytest.MonkeyPatch) -> Node:
    monkeypatch.setattr(recorder_node, "RawSubscription", Subscription)
    monkeypatch.setattr(recorder_node, "SILENCE_S", 0.03)
    return Node()


@pytest.fixture
def bag(tmp_path: Path) -> Path:
    return tmp_path / "bag"


@pytest.fixture
def loop(node: Any, bag: Path) -> Iterator[RecorderLoop]:
    loop = make(node, bag)
    yield loop
    loop._recorder.close()


def make(node: Any, bag: Path, **given: Any) -> RecorderLoop:
    return RecorderLoop(node, RecorderNodeSettings(bag=str(bag), drain_period=0.001, **given))


def rounds(loop: RecorderLoop, count: int = 1) -> list[Wait | None]:
    """Steps without those in which a chunk was ended instead."""
    loop._recorder._flush_at = time.monotonic() + 60.0
    return [loop.step() for _ in range(count)]


def account_of(bag: Path, topic: topics.Topic) -> dict[str, Any]:
    (account,) = (a for name, a in read_accounts(bag).items() if name.endswith(topic.name))
    return account


def test_what_a_node_says_it_sent_and_never_came_is_missing(
    loop: RecorderLoop, node: Node, bag: Path
) -> None:
    node.hear_clock([0, 1, 3])
    node.hear_sent("/sat1/clock", 7)
    assert rounds(loop) == [Wait(0.001, patience_s=TIMEOUT_S)]
    assert loop._recorder.is_behind
    loop.close()
    account = account_of(bag, topics.CLOCK)
    assert (account["received"], account["missing"]) == (3, 4)
    assert any(text.startswith("3 messages received, missing: {") for text in node.said)


def test_topics_have_turns_and_a_chunk_is_ended_in_a_step_of_its_own(
    loop: RecorderLoop, node: Node
) -> None:
    """A backlog of one holds up no other, and there is no rest before it is taken."""
    node.hear_clock(range(2 * TURN + 1))
    node.hear(topics.COMMAND, b"", 1)
    for _ in range(REPORTS + 2):
        node.hear_sent("/sat1/clock", 0)
    assert rounds(loop) == [None]
    assert not node.queues[topics.COMMAND]
    assert len(node.queues[topics.CLOCK]) == TURN + 1
    assert len(node.queues[topics.DIAGNOSTICS]) == 2
    loop._recorder._flush_at = 0.0
    assert loop.step() is not None
    assert len(node.queues[topics.CLOCK]) == TURN + 1
    busy, resting = rounds(loop, 2)
    assert busy is None
    assert resting is not None
    assert resting.inputs == ()
    assert loop._recorder.accounting["/clock"].received == 2 * TURN + 1


def test_what_was_sent_until_it_is_told_to_stop_is_taken_and_no_more(
    loop: RecorderLoop, node: Node, bag: Path
) -> None:
    now = time.time_ns()
    node.hear_clock([0, 1], now - 10**9)
    node.hear_clock([2], now + 10**12)
    loop._recorder._flush_at = time.monotonic() + 60.0
    loop.deactivate()
    assert loop._recorder._writer.open_bytes == 0, "the file grows no more"
    assert loop._recorder.accounting["/clock"].received == 2
    assert not node.queues[topics.CLOCK]
    until = loop._until_ns
    loop.deactivate()  # once more, as at the end of a node that was inactive
    assert loop._until_ns == until
    loop.close()
    assert account_of(bag, topics.CLOCK)["received"] == 2


@pytest.mark.parametrize(
    ("published", "behind", "waits"),
    [(False, 0, "not"), (True, 0, "for a silence"), (True, 5, "for the longest time")],
)
def test_it_waits_for_what_is_known_to_have_been_sent_but_not_for_ever(
    loop: RecorderLoop,
    node: Node,
    monkeypatch: pytest.MonkeyPatch,
    published: bool,
    behind: int,
    waits: str,
) -> None:
    clock = iter(range(1000, 10**9))
    monkeypatch.setattr(
        recorder_node,
        "time",
        SimpleNamespace(
            monotonic=lambda: float(next(clock)), time_ns=time.time_ns, sleep=lambda seconds: None
        ),
    )
    monkeypatch.setattr(recorder_node, "SILENCE_S", 100.0)
    monkeypatch.setattr(recorder_node, "DRAIN_S", 1000.0)
    node.hear_clock([0])
    if published:
        node.published.add("/sat1/clock")
    if behind:
        node.hear_sent("/sat1/clock", behind)
    loop.deactivate()
    seconds = next(clock) - 1000
    expected = {"not": 0, "for a silence": 100, "for the longest time": 1000}[waits]
    assert expected <= seconds < expected + 90


def test_what_is_sent_in_a_pause_is_left_out_and_told(
    loop: RecorderLoop, node: Node, bag: Path
) -> None:
    """Though it still waits when recording goes on; all that was sent later is recorded."""
    now = time.time_ns()
    loop.begin()
    node.hear_clock([0, 1], now)
    rounds(loop)
    loop.deactivate()
    paused = time.time_ns()
    node.hear_clock([2, 3, 4], paused)
    node.hear(topics.REFERENCE_JOINTS, b"", 1, paused)
    node.hear_sent("/sat1/clock", 99, paused)
    loop.begin()
    node.hear_clock([5, 6], time.time_ns())
    rounds(loop, 2)
    received = {name: counted.received for name, counted in loop._recorder.accounting.items()}
    assert received["/clock"] == 4
    assert not loop._recorder.is_behind, "a count of the pause is not heeded"
    # a trajectory sent in the pause may be of the time after it
    assert loop._recorder.accounting["/reference/joints"].invalid_stamps == 1
    loop.close()
    account = account_of(bag, topics.CLOCK)
    assert (account["while_inactive"], account["missing"]) == (3, 0)


def test_a_bag_that_cannot_be_written_is_told_once(loop: RecorderLoop, node: Node) -> None:
    rounds(loop)
    loop._recorder.failure = "No space left on device"
    rounds(loop, 3)
    said = "the bag is no longer written: No space left on device; the flight goes on"
    assert node.said.count(said) == 1
    health = loop.health()
    assert (health.mode, health.level) == ("not recording: No space left on device", Level.ERROR)
    with pytest.raises(FlightError, match="No space left"):
        loop.close()


def test_optional_topics_are_looked_for_now_and_then(loop: RecorderLoop, node: Node) -> None:
    rounds(loop)
    assert node.looks == len(OPTIONAL)
    node.published.add(f"/sat1/{topics.WHEELS_STATE.name}")
    for looks in (2 * len(OPTIONAL), 3 * len(OPTIONAL) - 1):  # one that is heard is not looked for
        time.sleep(CHECK_PERIOD_S)
        rounds(loop)
        assert node.looks == looks
        assert topics.WHEELS_STATE in node.queues


@pytest.mark.parametrize("text", ["", "{", "'a'"])
def test_a_flight_that_is_no_json_is_refused(node: Any, bag: Path, text: str) -> None:
    with pytest.raises(InputError, match=r"^recorder parameters: flight: not JSON \("):
        make(node, bag, flight=text)
    assert not bag.exists()


def test_the_plant_says_what_it_flies(loop: RecorderLoop, node: Node) -> None:
    text = jazzy().types[topics.PLANT_DESCRIPTION.type](data=json.dumps({"case": "3"}))
    data = bytes(jazzy().serialize_cdr(text, topics.PLANT_DESCRIPTION.type))
    for number, content in enumerate((b"", b"\0\1", data)):
        node.hear(topics.PLANT_DESCRIPTION, content, number + 1)
    rounds(loop, 3)
    assert loop._recorder._flight["case"] == "3"


def test_a_reset_puts_the_bag_of_before_aside(node: Any, bag: Path) -> None:
    make(node, bag).close()
    node.times_configured = 1
    make(node, bag).close()
    aside = bag.with_name("bag_before_reset_1")
    assert f"the bag of before the reset is now {aside}" in node.said
    assert sorted(bag.parent.iterdir()) == [bag, aside]
    assert f"recording the topics in /sat1 to {bag}" in node.said


def test_without_a_name_the_bag_is_called_after_the_time(
    node: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    node.times_configured = 1  # no bag of that name is in the way
    RecorderLoop(node, RecorderNodeSettings()).close()
    (made,) = tmp_path.iterdir()
    assert abs(time.mktime(time.strptime(made.name, "bag_%Y%m%d-%H%M%S")) - time.time()) < 60.0
