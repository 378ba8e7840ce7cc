"""Bags show the robot to viewers: where it truly is, seldom enough, whatever the flight."""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from flights import planned
from mcap.reader import make_reader
from numpy.typing import NDArray
from robots import PASSIVE_ROBOT
from rosbags.highlevel import AnyReader

from space_robot.flight.simulate import simulate
from space_robot_model.robot import Robot
from space_robot_model.robot.base_axes import base_axes
from space_robot_model.robot.frame_names import frame_names
from space_robot_model.robot.frames import body_frames
from space_robot_msgs_py import topics
from space_robot_msgs_py.bag.accounts import noted_accounts
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.bag.folder import open_bag
from space_robot_msgs_py.bag.reader import read_flight

Array = NDArray[np.float64]


class Shown(NamedTuple):
    """What a bag says to viewers, read by rosbags."""

    poses: dict[int, dict[str, tuple[str, Array, Array]]]
    """Parent, translation and rotation of each frame, by log time, ns."""
    tools: list[Any]
    descriptions: list[str]


def shown_by(bag: Path) -> Shown:
    shown = Shown({}, [], [])
    with AnyReader([bag]) as reader:
        for connection, log_ns, data in reader.messages():
            if connection.topic not in ("/tf", "/tf_static", "/robot_description"):
                continue
            message: Any = reader.deserialize(data, connection.msgtype)
            if connection.topic == "/robot_description":
                shown.descriptions.append(message.data)
            elif connection.topic == "/tf_static":
                shown.tools.append(message.transforms)
            else:
                for t in message.transforms:
                    stamp = t.header.stamp
                    assert stamp.sec * 10**9 + stamp.nanosec == log_ns
                    p, q = t.transform.translation, t.transform.rotation
                    pose = np.array([p.x, p.y, p.z]), np.array([q.w, q.x, q.y, q.z])
                    frames = shown.poses.setdefault(log_ns, {})
                    assert t.child_frame_id not in frames
                    frames[t.child_frame_id] = (t.header.frame_id, *pose)
    return shown


def assert_poses_are_true(shown: Shown, log: FlightLog, robot: Robot) -> None:
    """Along the chain from the inertial frame each body is where the kinematics have it."""
    names = frame_names(robot).bodies
    ticks = np.array([log.timebase.tick(log_ns) for log_ns in shown.poses])
    joints = np.column_stack((log.joint_positions, log.passive_positions))[ticks]
    frames = body_frames(robot, base_axes(log.quaternion[ticks].T), joints.T)
    for body, x, y, z, origin in frames:
        for k, told in enumerate(shown.poses.values()):
            position, turn, frame = np.zeros(3), np.eye(3), names[body]
            while frame != "inertial":
                frame, offset, rotation = told[frame]
                turned = np.array(base_axes(rotation[:, np.newaxis]))[:, :, 0].T
                position, turn = turned @ position + offset, turned @ turn
            there = log.base_position[ticks[k]] + origin[:, k]
            np.testing.assert_allclose(position, there, atol=1e-9)
            np.testing.assert_allclose(turn.T, [x[:, k], y[:, k], z[:, k]], atol=1e-9)


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
    assert list(shown.poses) == list(range(0, flight.timebase.stamp_ns(log.ticks), step_ns))
    assert len(shown.tools) == len(shown.descriptions) == 1
    assert [t.child_frame_id for t in shown.tools[0]] == list(frame_names(flight.robot).tools)
    assert_poses_are_true(shown, log, flight.robot)


def test_what_holds_for_the_flight_is_latched_and_no_row_of_a_log(tmp_path: Path) -> None:
    """The description names the frames of the transforms, so viewers find the links: read by our
    own reader of URDF, it is the robot again. Players are told to latch it, as rosbag2 writes it;
    the recorder's account of the flight has each topic."""
    bag = tmp_path / "bag"
    simulate(planned(duration=0.1, robot=PASSIVE_ROBOT), bag)
    shown = shown_by(bag)
    (tmp_path / "robot.urdf").write_text(shown.descriptions[0], "utf-8")
    read = frame_names(Robot.from_urdf(tmp_path / "robot.urdf"))
    assert set(shown.poses[0]) == set(read.bodies)
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
