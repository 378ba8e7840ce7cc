"""Flights where others are: free domains, one flight in each, namespaces, bags, refusals."""

from __future__ import annotations

import json
import shutil
import socket
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from flights import (
    forked_space_robot,
    planned,
    ros_environment,
    simulated,
    space_robot_here,
    wait_for_nodes,
)
from paths import CONFIG

from space_robot.analysis import analyze
from space_robot.flight.bag_path import check_bag_path
from space_robot.flight.graph import domain as domains
from space_robot.flight.graph import orchestrator
from space_robot.flight.graph.domain import is_quiet, ros_domain
from space_robot.processes.node_modules import MODULES
from space_robot_msgs_py import topics
from space_robot_msgs_py.bag.folder import open_bag
from space_robot_msgs_py.bag.reader import read_flight
from space_robot_msgs_py.errors import FlightError, InputError
from space_robot_msgs_py.ros.locks import FileLock, domain_lock, node_lock
from space_robot_msgs_py.wire.definitions import decode

pytest.importorskip("rclpy")

FOREIGN = """
import sys
import rclpy
from sensor_msgs.msg import JointState
rclpy.init()
node = rclpy.create_node("foreign")
node.create_publisher(JointState, sys.argv[1], 10)
print("ready", flush=True)
sys.stdin.read()
"""


@contextmanager
def process(domain: int, *command: str) -> Iterator[subprocess.Popen[str]]:
    """A process of others in a domain, until the context ends."""
    with subprocess.Popen(
        [sys.executable, *command],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        env={**ros_environment(), "ROS_DOMAIN_ID": str(domain)},
    ) as it:
        try:
            yield it
        finally:
            it.kill()


def refused(domain: int, bag: Path) -> str:
    """Why a flight there is refused; nothing is left of it."""
    result = space_robot_here(
        "fly", "--duration", "0.2", "--domain", str(domain), "--bag", str(bag)
    )
    assert result.returncode == 2, result.stderr
    assert "what was flown" not in result.stderr
    assert not bag.exists()
    return result.stderr


def test_of_two_at_the_same_moment_one_flies(tmp_path: Path, free_domain: int) -> None:
    bags = [tmp_path / "one", tmp_path / "two"]
    flights = [
        forked_space_robot(
            "fly", "--duration", "0.2", "--domain", str(free_domain), "--bag", str(bag)
        )
        for bag in bags
    ]
    words = [flight.communicate(timeout=150)[1] for flight in flights]
    codes = [flight.returncode for flight in flights]
    assert sorted(codes) == [0, 2], words
    flown = codes.index(0)
    log = read_flight(bags[flown])
    assert log.ticks == 400
    assert not any(log.lost.values())
    (line,) = words[1 - flown].splitlines()
    pid = flights[flown].pid
    assert f"ROS domain {free_domain} is taken by space-robot (pid {pid})" in line
    assert not bags[1 - flown].exists()


def test_beside_a_node_started_by_hand(tmp_path: Path, free_domain: int) -> None:
    with process(free_domain, "-m", MODULES["mission"]) as node:
        wait_for_nodes(free_domain)
        (line,) = refused(free_domain, tmp_path / "bag").splitlines()
        assert f"ROS domain {free_domain} is taken by mission_node (pid {node.pid})" in line


def test_a_foreign_publisher_that_was_there_before(tmp_path: Path, free_domain: int) -> None:
    with process(free_domain, "-c", FOREIGN, "/command") as foreign:
        assert foreign.stdout
        assert foreign.stdout.readline() == "ready\n"
        words = refused(free_domain, tmp_path / "bag")
    assert "/command is also published by /foreign" in words


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


@pytest.mark.parametrize("port", [0, 12, 249])
def test_a_domain_with_any_taken_port_is_not_free(
    alone: int, port: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A participant that outlives the first one of its flight has no port 10."""
    monkeypatch.setattr(domains, "DOMAINS", range(alone, alone + 1))
    with taken(alone, port), pytest.raises(FlightError, match=f"between {alone} and"), ros_domain():
        pass
    with ros_domain() as found:
        assert found == alone


def test_no_domain_has_ports_that_linux_gives_to_any_program() -> None:
    assert 7400 + 250 * (domains.DOMAINS[-1] + 1) <= 32768


@pytest.mark.parametrize(
    ("name", "value"), [(RANGE, "SUBNET"), (RANGE, "OFF"), (PEERS, "10.0.0.7")]
)
def test_with_other_machines_nobody_knows(
    alone: int, monkeypatch: pytest.MonkeyPatch, name: str, value: str
) -> None:
    monkeypatch.setenv(name, value)
    assert not is_quiet(alone)


# Robots in namespaces

PANEL = {
    "name": "panel",
    "parent": "base",
    "mass": 8.0,
    "inertia": [1.0, 0.5, 1.2, 0.0, 0.0, 0.0],
    "com": [0.8, 0.0, 0.0],
    "passive": {"stiffness": 30.0, "damping": 0.1},
    "origin": {"xyz": [1.0, 0.0, 0.0]},
}


def with_a_panel(folder: Path) -> Path:
    """The paper's robot, its mission and its gains, with a panel on a hinge without a motor."""
    document = yaml.safe_load((CONFIG / "robots/paper.yaml").read_text("utf-8"))
    document["robot"]["links"].append(PANEL)
    shutil.copytree(CONFIG / "gains/paper", folder / "gains")
    shutil.copyfile(CONFIG / "missions/paper.yaml", folder / "mission.yaml")
    (folder / "robot.yaml").write_text(yaml.safe_dump(document))
    return folder


def test_two_robots_fly_at_once_and_each_as_simulated(tmp_path: Path, free_domain: int) -> None:
    """One of them composed; their bags hold the topics' full names, and are read and replayed."""
    options: dict[str, dict[str, Any]] = {
        "/sat1": {"controller": "ctc"},
        "/fleet/sat2": {"robot": str(with_a_panel(tmp_path / "flexible"))},
    }
    bags = {namespace: tmp_path / namespace.replace("/", "_") for namespace in options}
    flights = {}
    for namespace, given in options.items():
        words = [word for name, value in given.items() for word in (f"--{name}", value)]
        where = ("--namespace", namespace, "--domain", str(free_domain))
        how = () if namespace == "/sat1" else ("--composed",)
        flights[namespace] = forked_space_robot(
            *("fly", *where, *how, *words, "--duration", "0.2", "--json"),
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
        assert int(nodes["plant_node"][f"sent {namespace}/joint_states"]) >= 400
        check_names(bags[namespace], namespace)
        here, log = simulated(**options[namespace], duration=0.2), read_flight(bags[namespace])
        for name, column in here.columns.items():
            if name != "telemetry":  # a bag has that of some ticks
                np.testing.assert_array_equal(getattr(log, name), column, name)
        assert log.laws == here.laws
    replayed = space_robot_here("replay", str(bags["/sat1"]), "--namespace", "sat1", "--json")
    assert replayed.returncode == 0, replayed.stderr  # each command equal to the last bit


def check_names(bag: Path, namespace: str) -> None:
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
    assert frames[:2] == [("inertial", base), (base, f"{prefix}/link1")]
    assert first[topics.TF_STATIC].transforms[0].child_frame_id == f"{prefix}/tool"
    passive = ["panel"] if namespace == "/fleet/sat2" else []
    names = [*(f"joint{i}" for i in range(1, 7)), *passive]
    assert first[topics.JOINT_STATES].name == names


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
