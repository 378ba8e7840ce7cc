"""Bags show the robot to viewers: where it truly is, seldom enough, whatever the flight."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest
from flights import planned
from mcap.reader import make_reader
from robots import PASSIVE_ROBOT
from rosbags.highlevel import AnyReader

from space_robot.flight.simulate import simulate
from space_robot_model.robot import Robot
from space_robot_model.robot.frame_names import frame_names
from space_robot_model.robot.poses import RobotPoses
from space_robot_msgs_py import topics
from space_robot_msgs_py.bag.accounts import noted_accounts
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.bag.folder import open_bag
from space_robot_msgs_py.bag.reader import read_flight


def shown_by(bag: Path) -> dict[str, list[tuple[int, Any]]]:
    """Messages to viewers with their log times, ns, read by rosbags."""
    shown: dict[str, list[tuple[int, Any]]] = defaultdict(list)
    with AnyReader([bag]) as reader:
        for connection, log_ns, data in reader.messages():
            if connection.topic in ("/tf", "/tf_static", "/robot_description"):
                message = reader.deserialize(data, connection.msgtype)
                shown[connection.topic].append((log_ns, message))
    return shown


def assert_poses_are_true(
    transforms: Sequence[Any], log_ns: int, log: FlightLog, poses: RobotPoses
) -> None:
    state = log.state(log.timebase.tick(log_ns))
    for transform, frame, pose in zip(transforms, poses.frames, poses.at(state), strict=True):
        assert (transform.header.frame_id, transform.child_frame_id) == tuple(frame)
        stamp = transform.header.stamp
        assert stamp.sec * 10**9 + stamp.nanosec == log_ns
        t, q = transform.transform.translation, transform.transform.rotation
        assert [t.x, t.y, t.z, q.x, q.y, q.z, q.w] == pose.tolist()


NOISY = ["noise_joint_position@0:1e-3", "drop_state@0:0.1"]


@pytest.mark.parametrize(
    ("options", "ticks_apart"),
    [
        ({"duration": 0.2, "case": "3"}, 20),
        ({"duration": 0.105, "period": 0.0007, "robot": PASSIVE_ROBOT, "faults": NOISY}, 15),
    ],
    ids=["paper", "passive"],
)
def test_bags_show_where_the_robot_truly_is(
    options: dict[str, Any], ticks_apart: int, tmp_path: Path
) -> None:
    """At most 100 times a second, from the first tick on; what does not change once."""
    flight = planned(**options)
    log = simulate(flight, tmp_path / "bag")
    shown, step_ns = shown_by(tmp_path / "bag"), ticks_apart * flight.timebase.period_ns
    assert step_ns >= 10_000_000 > step_ns - flight.timebase.period_ns
    stamps = range(0, flight.timebase.stamp_ns(log.ticks), step_ns)
    assert [log_ns for log_ns, _ in shown["/tf"]] == list(stamps)
    poses = RobotPoses(flight.robot)
    for log_ns, message in shown["/tf"]:
        assert_poses_are_true(message.transforms, log_ns, log, poses)
    ((_, tools),) = shown["/tf_static"]
    assert [t.child_frame_id for t in tools.transforms] == list(frame_names(flight.robot).tools)
    assert len(shown["/robot_description"]) == 1


def test_what_holds_for_the_flight_is_latched_and_no_row_of_a_log(tmp_path: Path) -> None:
    """The description names the frames of the transforms, so viewers find the links: read by our
    own reader of URDF, it is the robot again. Players are told to latch it, as rosbag2 writes it;
    the recorder's account of the flight has each topic."""
    bag = tmp_path / "bag"
    simulate(planned(duration=0.1, robot=PASSIVE_ROBOT), bag)
    shown = shown_by(bag)
    (_, description), (_, poses) = shown["/robot_description"][0], shown["/tf"][0]
    (tmp_path / "robot.urdf").write_text(description.data, "utf-8")
    read = frame_names(Robot.from_urdf(tmp_path / "robot.urdf"))
    assert {t.child_frame_id for t in poses.transforms} == set(read.bodies)
    assert set(read_flight(bag).lost) == {t.full_name for t in topics.ALL}
    accounts = noted_accounts(open_bag(bag).custom_data())
    counts = {name: (accounts[name].received, accounts[name].missing) for name in accounts}
    assert counts["/tf"] == (10, 0)
    assert counts["/tf_static"] == counts["/robot_description"] == (1, 0)
    (file,) = bag.glob("*.mcap")
    with file.open("rb") as stream:
        summary = make_reader(stream).get_summary()
    assert summary is not None
    offered = {c.topic: c.metadata["offered_qos_profiles"] for c in summary.channels.values()}
    latched = {name for name, profile in offered.items() if "transient_local" in profile}
    assert latched == {"/tf_static", "/robot_description", "/controller/law"}
    assert offered["/tf_static"].count("depth: 1\n") == 1
