"""Two robots in one ROS domain, each in a namespace: each flies as if it were alone."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from flights import forked_space_robot, space_robot_here
from paths import CONFIG

from space_robot.flight.graph.domain import ros_domain
from space_robot.flight.plan import Flight, FlightPlan, resolve
from space_robot.flight.simulate import simulate
from space_robot_msgs_py import topics
from space_robot_msgs_py.bag.folder import open_bag
from space_robot_msgs_py.bag.reader import read_flight
from space_robot_msgs_py.errors import InputError
from space_robot_msgs_py.ros.locks import FileLock, domain_lock, node_lock
from space_robot_msgs_py.wire.definitions import decode

pytest.importorskip("rclpy")

NODES = {"recorder_node", "mission_node", "controller_node", "plant_node"}
COLUMNS = (
    "base_position",
    "quaternion",
    "base_velocity",
    "omega_base",
    "joint_positions",
    "joint_velocities",
    "passive_positions",
    "passive_velocities",
    "applied_torque",
    "reference_joints",
    "reference_base",
)
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


def test_both_fly_at_once_and_each_as_simulated(tmp_path: Path, free_domain: int) -> None:
    """One of them composed; their bags hold the topics' full names, and are read and replayed."""
    robots = {"/sat1": "paper", "/fleet/sat2": str(with_a_panel(tmp_path / "flexible"))}
    bags = {namespace: tmp_path / namespace.replace("/", "_") for namespace in robots}
    flights = {
        namespace: forked_space_robot(
            "fly",
            "--namespace",
            namespace,
            "--domain",
            str(free_domain),
            "--bag",
            str(bags[namespace]),
            "--duration",
            "0.3",
            "--robot",
            robot,
            "--json",
            *(["--composed"] if namespace == "/fleet/sat2" else ["--controller", "ctc"]),
        )
        for namespace, robot in robots.items()
    }
    told = {namespace: flight.communicate(timeout=300) for namespace, flight in flights.items()}
    assert {flight.returncode for flight in flights.values()} == {0}, told
    for namespace, (output, words) in told.items():
        assert f"ROS_DOMAIN_ID={free_domain} in namespace {namespace}, recording to" in words
        check_report(json.loads(output), namespace)
        check_names(bags[namespace], namespace)
    laws = {"/sat1": "ctc", "/fleet/sat2": "tde_stc"}
    for namespace, robot in robots.items():
        plan = FlightPlan(controller=laws[namespace], robot=robot, duration=0.3)
        here, flown = simulate(Flight(resolve(plan))), read_flight(bags[namespace])
        for column in COLUMNS:
            np.testing.assert_array_equal(getattr(flown, column), getattr(here, column), column)
        assert flown.laws == here.laws
    replayed = space_robot_here("replay", str(bags["/sat1"]), "--namespace", "sat1", "--json")
    assert replayed.returncode == 0, replayed.stderr  # each command equal to the last bit


def check_report(report: dict[str, Any], namespace: str) -> None:
    assert not any(report["lost"].values())
    assert report["graph"]["warnings"] == report["graph"]["failures"] == []
    assert set(report["graph"]["nodes"]) == NODES
    for node, topic in (("plant", "joint_states"), ("controller", "command")):
        sent = report["graph"]["nodes"][f"{node}_node"][f"sent {namespace}/{topic}"]
        assert int(sent) >= 600  # on a busy machine a state that nobody answers is sent again


def check_names(bag: Path, namespace: str) -> None:
    """Of topics, of the node in its messages, and of all joints, with and without motors."""
    own = {topic.recorded.in_namespace(namespace): topic.recorded for topic in topics.RECORDED}
    assert open_bag(bag).topics() == {name: topic.type for name, topic in own.items()}
    assert read_flight(bag).namespace == namespace
    first = {}
    for batch in open_bag(bag).batches():
        first.setdefault(own[batch.topic], batch.message(0))
    law = decode(first[topics.LAW], topics.LAW.type)
    assert law.node == f"{namespace}/controller_node"
    names = decode(first[topics.JOINT_STATES], topics.JOINT_STATES.type).name
    prefix = namespace.lstrip("/")
    frames = [(t.header.frame_id, t.child_frame_id) for t in transforms(first[topics.TF])]
    assert frames[:2] == [
        ("inertial", f"{prefix}/base_link"),
        (f"{prefix}/base_link", f"{prefix}/link1"),
    ]
    assert transforms(first[topics.TF_STATIC])[0].child_frame_id == f"{prefix}/tool"
    passive = ["panel"] if namespace == "/fleet/sat2" else []
    assert names == [*(f"joint{i}" for i in range(1, 7)), *passive]


def transforms(data: bytes) -> list[Any]:
    return list(decode(data, topics.TF.type).transforms)


def test_one_namespace_has_one_robot(free_domain: int) -> None:
    """Whoever started it: a command, or somebody a node by hand."""
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


def test_a_free_domain_has_no_robot_in_whatever_namespace(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("ROS_DOMAIN_ID", raising=False)
    with ros_domain(namespace="/sat1") as first, ros_domain() as second:
        assert first != second
