"""A graph that is paused, stepped and reset in flight: its bag is that of an undisturbed flight.

By the services of the plant's node, through `space-robot sim`.
"""

from __future__ import annotations

import json
import re
import signal
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from flights import Flown, Start, forked_space_robot, space_robot_here, wait_for_nodes
from forked import Forked

from space_robot.flight.graph import simulation_calls
from space_robot_msgs_py import topics
from space_robot_msgs_py.bag.folder import open_bag
from space_robot_msgs_py.bag.reader import read_flight
from space_robot_msgs_py.ros.process_environment import set_defaults
from space_robot_msgs_py.wire.cdr import header_stamp_ns
from space_robot_msgs_py.wire.definitions import decode

if TYPE_CHECKING:
    from ground import Ground

set_defaults()
pytest.importorskip("rclpy")

from space_robot_msgs_py.ros.endpoints import PolledCallbackGroup, RawSubscription  # noqa: E402

SHORT = ("--duration", "0.2")
IMPATIENT = (
    "--set",
    "plant.silence_timeout=0.5",
    "--set",
    "controller.state_timeout=0.5",
    "--set",
    "controller.reference_timeout=0.5",
)
LONGER_THAN_ANY_WATCHDOG_S = 3.0
"""Also than the one of a controller that is started again when it seems to hang."""
TIMEOUT_S = 60.0
SAME = (
    topics.JOINT_STATES,
    topics.BASE_STATE,
    topics.COMMAND,
    topics.CLOCK,
    topics.TELEMETRY,
    topics.LAW,
)


def assert_same_messages(bag: Path, other: Path) -> None:
    for topic in SAME:
        here, there = ([data for _, data in open_bag(b).messages(topic)] for b in (bag, other))
        assert here == there, topic.full_name
        assert here, topic.full_name


@contextmanager
def flying(domain: int, *options: str) -> Iterator[Forked]:
    """``fly --json`` in a domain, begun paused; ended if it is left before its end."""
    process = forked_space_robot("fly", "--paused", "--domain", str(domain), *options, "--json")
    try:
        wait_for_nodes(domain)
        yield process
    finally:
        process.send_signal(signal.SIGINT)
        process.communicate(timeout=TIMEOUT_S)


def sim(domain: int, *words: str) -> str:
    """``space-robot sim``, as soon as the plant is active; what it says."""
    until = time.monotonic() + TIMEOUT_S
    while True:
        result = space_robot_here("sim", *words, "--domain", str(domain))
        if result.returncode == 0:
            return result.stdout.strip()
        is_early = "is a graph flying" in result.stderr or "is not active" in result.stderr
        assert is_early, result.stderr
        assert time.monotonic() < until, result.stderr


def test_pauses_and_steps_leave_no_trace(
    fly: Callable[..., Flown], free_domain: int, tmp_path: Path
) -> None:
    bag = tmp_path / "bag"
    options = (*SHORT, *IMPATIENT, "--composed")
    with flying(free_domain, *options, "--bag", str(bag)) as process:
        assert sim(free_domain, "step") == "stepped to tick 1 (0.0005 s)"
        assert sim(free_domain, "step", "--ticks", "7") == "stepped to tick 8 (0.0040 s)"
        assert sim(free_domain, "step", "--ticks", "92") == "stepped to tick 100 (0.0500 s)"
        assert sim(free_domain, "pause") == "already paused at tick 100 (0.0500 s)"
        time.sleep(LONGER_THAN_ANY_WATCHDOG_S)
        assert sim(free_domain, "resume") == "goes on at tick 100 (0.0500 s)"
        output, errors = process.communicate(timeout=TIMEOUT_S)
    assert process.returncode == 0, errors
    report = json.loads(output)
    assert report["graph"]["events"] == [], "a pause is no silence"
    assert (report["graph"]["failures"], report["graph"]["warnings"]) == ([], [])
    assert report["graph"]["nodes"]["plant_node"]["missed_deadlines"] == "0"
    assert_same_messages(bag, fly(*SHORT, "--composed").bag)


def test_after_a_reset_the_flight_is_a_fresh_one(
    fly: Callable[..., Flown], free_domain: int, tmp_path: Path
) -> None:
    """In four processes, after ticks in which arm, controller and mission have come somewhere."""
    bag = tmp_path / "bag"
    with flying(free_domain, *SHORT, "--bag", str(bag)) as process:
        sim(free_domain, "step", "--ticks", "150")
        assert sim(free_domain, "reset") == "reset, paused at tick 0 (0.0000 s)"
        assert sim(free_domain, "resume") == "goes on at tick 0 (0.0000 s)"
        output, errors = process.communicate(timeout=TIMEOUT_S)
    assert process.returncode == 0, errors
    report = json.loads(output)
    assert (report["ticks"], report["graph"]["failures"]) == (400, [])
    assert report["graph"]["events"] == []
    assert not any(report["lost"].values())
    assert_same_messages(bag, fly(*SHORT, "--composed").bag)
    before = read_flight(tmp_path / "bag_before_reset_1")
    assert before.ticks == 151, "ticks 0 to 150 have been measured and answered"
    assert not any(before.lost.values())


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGQUIT])
def test_a_signal_ends_a_paused_flight_that_who_joins_late_sees(
    free_domain: int, tmp_path: Path, number: signal.Signals
) -> None:
    """Tick 45 has no message of its own on /clock and /markers: shown is the clock of tick 40."""
    from ground import Ground

    bag, heard = tmp_path / "bag", {}
    viewed = (topics.CLOCK, topics.JOINT_STATES, topics.MARKERS)
    with flying(free_domain, *SHORT, "--composed", "--bag", str(bag)) as process:
        sim(free_domain, "step", "--ticks", "45")
        viewer = Ground(free_domain)
        inputs = {t: RawSubscription(viewer.node, t, PolledCallbackGroup()) for t in viewed}

        def hears_all() -> bool:
            heard.update({t: d for t in viewed if (d := inputs[t].take()) is not None})
            return len(heard) == len(viewed)

        viewer.until(hears_all, "messages while the plant is paused")
        viewer.close()
        process.send_signal(number)
        _, errors = process.communicate(timeout=TIMEOUT_S)
    assert process.returncode == 128 + number, errors
    log = read_flight(bag)
    assert log.ticks == 46, "ticks 0 to 45 have been measured and answered"
    assert not any(log.lost.values())
    assert header_stamp_ns(heard[topics.CLOCK]) == 40 * 500_000
    joints = decode(heard[topics.JOINT_STATES], topics.JOINT_STATES.type)
    assert joints.header.stamp.nanosec == 45 * 500_000
    assert list(joints.position) == log.joint_positions[45].tolist()


def test_by_the_wall_clock_a_pause_is_no_lost_time(start: Start, ground: Ground) -> None:
    from std_srvs.srv import Trigger

    plant = start("plant", realtime="true", ticks=1000, paused="true")
    start("mission")
    start("controller", reference_timeout=0.0)

    def call(service: str) -> str:
        return str(ground.call(Trigger, f"/plant_node/{service}", Trigger.Request()).message)

    ground.until(lambda: ground.monitor.modes.get("plant_node") == "paused", "paused")
    time.sleep(LONGER_THAN_ANY_WATCHDOG_S)
    assert call("step") == "stepped to tick 1 (0.0005 s)"
    time.sleep(LONGER_THAN_ANY_WATCHDOG_S)
    assert call("resume") == "goes on at tick 1 (0.0005 s)"
    output, _ = plant.communicate(timeout=TIMEOUT_S)
    assert plant.returncode == 0, output
    assert "flew 0.5000 s" in output
    lost = re.search(r"([0-9.]+) s behind the wall clock$", output, re.MULTILINE)
    assert lost is None or float(lost[1]) < LONGER_THAN_ANY_WATCHDOG_S, output


def test_a_step_that_the_end_of_the_flight_cuts_short_is_told(
    free_domain: int, tmp_path: Path
) -> None:
    options = ("--duration", "0.05", "--composed", "--bag", str(tmp_path / "bag"))
    with flying(free_domain, *options) as process:
        sim(free_domain, "step")
        result = space_robot_here("sim", "step", "--ticks", "500", "--domain", str(free_domain))
        output, errors = process.communicate(timeout=TIMEOUT_S)
    assert process.returncode == 0, errors
    assert json.loads(output)["ticks"] == 100
    assert result.returncode == 1
    (line,) = result.stderr.splitlines()
    assert "the step ended at tick 100 of 501" in line


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("step", "--ticks", "0"), "--ticks 0: 1 to 10000000000 were expected"),
        (("step", "--ticks", "-3"), "--ticks -3: 1 to 10000000000 were expected"),
        (("pause", "--namespace", "9"), "is not a namespace"),
        (("pause",), "no service /plant_node/pause in ROS domain"),
    ],
)
def test_what_cannot_be_is_refused_in_one_line(
    words: tuple[str, ...], said: str, free_domain: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(simulation_calls, "FIND_S", 0.2)  # there is nothing to be found
    result = space_robot_here("sim", *words, "--domain", str(free_domain))
    assert (result.returncode, result.stdout) == (2, "")
    (line,) = result.stderr.splitlines()
    assert said in line


def test_a_plant_that_runs_cannot_be_stepped(start: Start, domain: int) -> None:
    start("plant")
    until = time.monotonic() + TIMEOUT_S
    while time.monotonic() < until:
        result = space_robot_here("sim", "step", "--domain", str(domain))
        if "is a graph flying" not in result.stderr and "is not active" not in result.stderr:
            break
    assert result.returncode == 1
    (line,) = result.stderr.splitlines()
    assert "plant_node cannot step: it is not paused" in line
