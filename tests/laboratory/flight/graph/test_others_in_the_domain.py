"""Flights where others are: free domains, namespaces, and nodes of the user's own."""

from __future__ import annotations

import json
import socket
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import pytest
from flights import (
    PausedFlight,
    forked_space_robot,
    planned,
    ros_environment,
    simulated,
    space_robot_here,
    wait_for_nodes,
)
from forked import END_S, Forked
from matrix.scenarios import difference
from paths import ROOT

from space_robot.analysis import analyze
from space_robot.flight.flight_messages import check_bag_path
from space_robot.flight.graph import domain as domains
from space_robot.flight.graph import orchestrator
from space_robot.flight.graph.domain import is_quiet, ros_domain
from space_robot.processes import MODULES
from space_robot_msgs_py import topics
from space_robot_msgs_py.bag.folder import open_bag
from space_robot_msgs_py.bag.reader import read_flight
from space_robot_msgs_py.errors import FlightError, InputError
from space_robot_msgs_py.ros.locks import FileLock, domain_lock, node_lock
from space_robot_msgs_py.wire.definitions import decode

pytest.importorskip("rclpy")

FOREIGN = """
import sys
import time
import rclpy
from sensor_msgs.msg import JointState
rclpy.init()
node = rclpy.create_node("foreign")
node.create_publisher(JointState, sys.argv[1], 10)
print("ready", flush=True)
time.sleep(600)
"""


@contextmanager
def others(domain: int, *command: str) -> Iterator[Forked]:
    """A process of others in a domain, until the context ends: a program, or a module's."""
    environment = {**ros_environment(), "ROS_DOMAIN_ID": str(domain)}
    it = (
        Forked(command[0], command[1:], environment)
        if command[0] in MODULES.values()
        else Forked.of_command(command, environment)
    )
    try:
        yield it
    finally:
        it.kill()
        it.communicate(END_S)


def test_where_others_publish_or_nodes_are_no_flight_begins(
    tmp_path: Path, free_domain: int
) -> None:
    foreign = tmp_path / "foreign.py"
    foreign.write_text(FOREIGN)
    words = ("--duration", "0.2", "--domain", str(free_domain), "--bag", str(tmp_path / "bag"))
    with others(free_domain, str(foreign), "/command") as process:
        assert process.stdout
        assert process.stdout.readline() == "ready\n"
        result = space_robot_here("fly", *words)
        assert "/command is also published by /foreign" in result.stderr
    with others(free_domain, MODULES["mission"]) as process:
        wait_for_nodes(free_domain)
        taken = space_robot_here("fly", *words)
    (line,) = taken.stderr.splitlines()
    assert f"ROS domain {free_domain} is taken by mission_node (pid {process.pid})" in line
    assert (result.returncode, taken.returncode) == (2, 2)
    assert not (tmp_path / "bag").exists()


def test_a_bag_that_another_flight_was_quicker_to_make_stays(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It came between the look and the making; nothing of it is in its file yet."""
    bag = tmp_path / "bag"
    other = bag / "bag_0.mcap"

    def look(path: Path) -> None:
        check_bag_path(path)
        bag.mkdir()
        other.touch()
        monkeypatch.undo()

    monkeypatch.setattr(orchestrator, "check_bag_path", look)
    with pytest.raises(InputError, match="exists already"):
        orchestrator.fly(planned(duration=0.2), bag, analyze)
    assert other.exists()


# Who is in a domain, by the ports of this machine

RANGE, PEERS = "ROS_AUTOMATIC_DISCOVERY_RANGE", "ROS_STATIC_PEERS"


@pytest.fixture
def alone(free_domain: int, monkeypatch: pytest.MonkeyPatch) -> int:
    """A domain that is free, on this machine only."""
    monkeypatch.setenv(RANGE, "LOCALHOST")
    monkeypatch.delenv(PEERS, raising=False)
    monkeypatch.delenv("ROS_DOMAIN_ID", raising=False)
    return free_domain


@contextmanager
def taken(domain: int, port: int, family: int = socket.AF_INET) -> Iterator[None]:
    with socket.socket(family, socket.SOCK_DGRAM) as somebody:
        with suppress(OSError):  # a domain beside is in use
            somebody.bind(("", 7400 + 250 * domain + port))
        yield


@pytest.mark.parametrize("family", [socket.AF_INET, socket.AF_INET6])
@pytest.mark.parametrize(
    ("port", "is_somebody"), [(-1, False), (0, True), (10, True), (249, True), (250, False)]
)
def test_a_taken_port_of_the_domain_is_somebody(
    alone: int, port: int, is_somebody: bool, family: int
) -> None:
    assert is_quiet(alone)
    with taken(alone, port, family):
        assert is_quiet(alone) is not is_somebody
    assert is_quiet(alone)


def test_a_domain_with_any_taken_port_is_not_free(monkeypatch: pytest.MonkeyPatch) -> None:
    """A participant that outlives the first one of its flight has no port 10."""
    with ros_domain() as alone:
        pass
    monkeypatch.setattr(domains, "DOMAINS", range(alone, alone + 1))
    with taken(alone, 12), pytest.raises(FlightError, match=f"between {alone} and"), ros_domain():
        pass
    with ros_domain() as found:
        assert found == alone


@pytest.mark.parametrize(
    ("name", "value"), [(RANGE, "SUBNET"), (RANGE, "OFF"), (PEERS, "10.0.0.7")]
)
def test_with_other_machines_nobody_knows(
    alone: int, monkeypatch: pytest.MonkeyPatch, name: str, value: str
) -> None:
    monkeypatch.setenv(name, value)
    assert not is_quiet(alone)


# Robots in namespaces


def test_two_robots_fly_at_once_and_each_as_simulated(tmp_path: Path, free_domain: int) -> None:
    """One of them composed; their bags hold the topics' full names, and are read and replayed."""
    options = {"/sat1": {"controller": "ctc"}, "/fleet/sat2": {"robot": "flexible_panels"}}
    bags = {namespace: tmp_path / namespace.replace("/", "_") for namespace in options}
    flights = {}
    for namespace, given in options.items():
        words = [word for name, value in given.items() for word in (f"--{name}", value)]
        where = ("--namespace", namespace, "--domain", str(free_domain))
        how = () if namespace == "/sat1" else ("--composed",)
        flights[namespace] = forked_space_robot(
            *("fly", *where, *how, *words, "--duration", "0.1", "--json"),
            *("--bag", str(bags[namespace])),
        )
    told = {namespace: flight.communicate(timeout=300) for namespace, flight in flights.items()}
    assert {flight.returncode for flight in flights.values()} == {0}, told
    for namespace, (output, words) in told.items():
        assert f"ROS_DOMAIN_ID={free_domain} in namespace {namespace}, recording to" in words
        report = json.loads(output)
        assert not any(report["lost"].values())
        assert report["graph"]["warnings"] == report["graph"]["failures"] == []
        nodes = report["graph"]["nodes"]
        assert set(nodes) == {"recorder_node", "mission_node", "controller_node", "plant_node"}
        # on a busy machine a state that nobody answers is sent again
        assert int(nodes["plant_node"][f"sent {namespace}/joint_states"]) >= 200
        here, log = simulated(**options[namespace], duration=0.1), read_flight(bags[namespace])
        check_names(bags[namespace], namespace, [*here.joint_names, *here.passive_names])
        assert difference(log, here, {"telemetry"}) == ""
        assert log.laws == here.laws
    replayed = space_robot_here("replay", str(bags["/sat1"]), "--namespace", "sat1", "--json")
    assert replayed.returncode == 0, replayed.stderr  # each command equal to the last bit


def check_names(bag: Path, namespace: str, moving: Sequence[str]) -> None:
    """Of topics, of the node in its messages, of frames, and of joints, also without motors."""
    own = {topic.recorded.in_namespace(namespace): topic.recorded for topic in topics.RECORDED}
    assert open_bag(bag).topics() == {name: topic.type for name, topic in own.items()}
    assert read_flight(bag).namespace == namespace
    first: dict[topics.Topic, Any] = {}
    for batch in open_bag(bag).batches():
        topic = own[batch.topic]
        first.setdefault(topic, decode(batch.message(0), topic.type))
    assert first[topics.LAW].node == f"{namespace}/controller_node"
    prefix = namespace.lstrip("/")
    frames = [(t.header.frame_id, t.child_frame_id) for t in first[topics.TF].transforms]
    base = f"{prefix}/base_link"
    assert frames[0] == ("inertial", base)
    assert all(f"{parent}/".startswith(f"{prefix}/") for parent, _ in frames[1:])
    assert first[topics.TF_STATIC].transforms[0].child_frame_id.startswith(f"{prefix}/")
    assert {*first[topics.JOINT_STATES].name} == {*moving}


def test_one_namespace_has_one_robot(free_domain: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Whoever started it: a command, or somebody a node by hand. A free domain has none at all."""
    command = FileLock(domain_lock(free_domain, "/sat1"), "space-robot")
    node = FileLock(node_lock(free_domain, "/fleet/sat2/plant_node"), "plant_node")
    for namespace, who in (("/sat1", "space-robot"), ("/fleet/sat2", "plant_node")):
        taken = f"namespace {namespace} of ROS domain {free_domain} is taken by {who} "
        with pytest.raises(InputError, match=taken), ros_domain(free_domain, namespace):
            pass
    for namespace in ("/", "/fleet", "/sat2"):
        with ros_domain(free_domain, namespace) as domain:
            assert domain == free_domain
    command.release()
    node.release()
    monkeypatch.delenv("ROS_DOMAIN_ID", raising=False)
    with ros_domain(namespace="/sat1") as first, ros_domain() as second:
        assert first != second


# Nodes of the user's own

OWN_CONTROLLER = str(ROOT / "examples/own_controller.py")


def test_a_controller_and_a_mission_of_ones_own_fly(tmp_path: Path, free_domain: int) -> None:
    """The metrics are those of the example's law to the printed digits."""
    with others(free_domain, OWN_CONTROLLER) as own, others(free_domain, MODULES["mission"]):
        options = ("--duration", "0.1", "--json")
        result = space_robot_here(
            *("fly", "--without", "controller", "--without", "mission", *options),
            *("--domain", str(free_domain), "--bag", str(tmp_path / "bag")),
        )
        assert result.returncode == 0, result.stderr
        printed, errors = own.communicate(timeout=60)
    assert own.returncode == 0, errors
    assert printed.startswith("200 states answered")
    waits = "your controller (a node that publishes /command)"
    for said in (waits, "your controller is /own_controller", "your mission is /mission_node"):
        assert result.stderr.count(said) == 1
    report = json.loads(result.stdout)
    assert (report["controller"], report["ticks"]) == ("none", 200)
    assert not any(report["lost"].values())
    assert report["unanswered_ticks"] == 0
    law = json.loads(space_robot_here("simulate", "--controller", "pd", *options).stdout)
    for name, value in law["metrics"].items():
        if name.endswith(".rms_eq64"):
            assert report["metrics"][name] == pytest.approx(value, rel=1e-5), name
    replayed = space_robot_here("replay", str(tmp_path / "bag"))
    assert (replayed.returncode, "name the law" in replayed.stderr) == (2, True)


def test_one_that_dies_in_flight_ends_it_as_a_killed_controller_does(
    tmp_path: Path, free_domain: int
) -> None:
    """Here the controller of this project, started by hand."""
    words = ("--without", "controller", "--set", "plant.silence_timeout=0.5", "--json")
    with others(free_domain, MODULES["controller"]) as own:
        wait_for_nodes(free_domain)
        flight = PausedFlight(tmp_path / "bag", free_domain, *words)
        flight.sim("step", "--ticks", "100")
        flight.sim("resume")
        own.kill()
        code, output, errors = flight.end()
    assert code == 1, errors
    report = json.loads(output)
    assert (report["controller"], report["outcome"]) == ("tde_stc", "failed")
    assert "no command for 0.5 s (silence_timeout)" in report["reason"]
    assert "the controller is silent" in errors
    log = read_flight(flight.bag)
    assert log.ticks > 100
    assert not any(log.lost.values())


def test_one_that_never_comes_ends_the_flight_in_time(tmp_path: Path, free_domain: int) -> None:
    where = ("--domain", str(free_domain), "--join-timeout", "0.3")
    for node, missing in (("controller", "good command"), ("mission", "reference")):
        ended = space_robot_here("fly", "--without", node, *where, "--bag", str(tmp_path / node))
        assert ended.returncode == 1
        assert f"no {missing} for tick 0 within 0.3 s (join_timeout)" in ended.stderr
        assert ("publishers of /command" in ended.stderr) == (node == "controller")
    assert not (tmp_path / "controller").exists()
