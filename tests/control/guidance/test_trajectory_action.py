"""The action follow_joint_trajectory on a flight's graph, with control_msgs built here."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import ros_interfaces
from flights import COMMAND, ended, ros_environment, space_robot_here, wait_for_nodes

from space_robot_model.robot.find import find_robot
from space_robot_msgs_py.bag.reader import read_flight
from space_robot_msgs_py.ros.process import set_defaults

set_defaults()
pytest.importorskip("rclpy")
if not ros_interfaces.has_compilers():
    pytest.skip("no gcc and g++ here", allow_module_level=True)

from action_msgs.msg import GoalStatus  # noqa: E402
from builtin_interfaces.msg import Duration  # noqa: E402
from ground import Ground  # noqa: E402
from rclpy.action import ActionClient  # noqa: E402
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint  # noqa: E402

pytestmark = pytest.mark.docs  # to build the package takes longer than to fly
Array = np.ndarray[Any, np.dtype[np.float64]]
TIMEOUT_S = 240.0
NAMES = find_robot("paper").joint_names
HOME = np.radians([0.0, 120.0, 220.0, 0.0, -10.0, 0.0])
GOAL = np.radians([2.0, 118.0, 221.0, -2.0, -12.0, 1.0])


@pytest.fixture(scope="module")
def control_msgs(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """The folder with the package, which is on Python's path."""
    folder = tmp_path_factory.mktemp("interfaces")
    ros_interfaces.build(
        "control_msgs",
        ["builtin_interfaces", "geometry_msgs", "std_msgs", "trajectory_msgs"],
        folder,
    )
    sys.path.insert(0, str(folder))
    yield folder
    sys.path.remove(str(folder))
    for name in [name for name in sys.modules if name.split(".")[0] == "control_msgs"]:
        del sys.modules[name]


class Client(Ground):
    """A client of the action, in the flight's domain."""

    def __init__(self, domain: int) -> None:
        from control_msgs.action import FollowJointTrajectory

        super().__init__(domain)
        self.action, self.feedback = FollowJointTrajectory, list[Any]()
        name = "/mission_node/follow_joint_trajectory"
        self.client = ActionClient(self.node, FollowJointTrajectory, name)

    def send(self, seconds: int, goal: Array = GOAL, first: Array = HOME, **settings: Any) -> Any:
        """Send a goal, which begins with the present state as MoveIt's do; return its handle."""
        points = [
            JointTrajectoryPoint(positions=row.tolist(), time_from_start=Duration(sec=time))
            for time, row in {0: first, seconds: goal}.items()
        ]
        trajectory = JointTrajectory(joint_names=list(NAMES), points=points)
        request = self.action.Goal(trajectory=trajectory, **settings)
        return self.answer(self.client.send_goal_async(request, self.feedback.append))

    def end(self, goal: Any) -> tuple[int, int, str]:
        """Return status, code and text of a goal's end."""
        answer = self.answer(goal.get_result_async())
        return answer.status, answer.result.error_code, answer.result.error_string

    def answer(self, future: Any) -> Any:
        """Wait for an answer."""
        self._executor.spin_until_future_complete(future, TIMEOUT_S)
        assert future.done()
        return future.result()

    def spin(self) -> None:
        """Receive what comes next."""
        self._executor.spin_once(timeout_sec=TIMEOUT_S)

    def close(self) -> None:
        self.client.destroy()  # else the node stays as long
        super().close()


def sim(domain: int, *words: str) -> bool:
    return space_robot_here("sim", *words, "--domain", str(domain)).returncode == 0


@pytest.fixture
def flight(control_msgs: Path, free_domain: int, tmp_path: Path) -> Iterator[subprocess.Popen[str]]:
    """A paused flight of 7 s, some ticks after its start."""
    paths = [str(control_msgs), os.environ.get("PYTHONPATH", "")]
    options = ["--duration", "7", "--domain", str(free_domain), "--bag", str(tmp_path / "bag")]
    with (
        subprocess.Popen(
            [*COMMAND, "fly", "--paused", *options],
            env={**ros_environment(), "PYTHONPATH": os.pathsep.join(filter(None, paths))},
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        ) as process,
        ended(process),
    ):
        try:
            wait_for_nodes(free_domain)
            while not sim(free_domain, "step", "--ticks", "500"):
                assert process.poll() is None
            yield process
        finally:
            if process.poll() is None:
                process.send_signal(signal.SIGINT)
                process.communicate(timeout=TIMEOUT_S)


def test_goals_are_followed_superseded_and_cancelled(
    flight: subprocess.Popen[str], free_domain: int, tmp_path: Path
) -> None:
    with closing(Client(free_domain)) as client:
        from control_msgs.msg import JointTolerance

        assert client.client.wait_for_server(timeout_sec=TIMEOUT_S)
        unknown = JointTolerance(name="wrist", position=0.1)
        assert not client.send(1, goal_tolerance=[unknown]).accepted
        assert not client.send(0).accepted

        wide, near = (  # the law is 1.4 mrad off at the trajectory's end, and 1 mrad 0.2 s later
            [JointTolerance(name=name, position=size, velocity=0.1) for name in NAMES]
            for size in (1e-2, 1e-3)
        )
        followed = client.send(1, path_tolerance=wide, goal_tolerance=near)
        assert followed.accepted
        while not client.feedback:
            client.spin()
        desired = client.feedback[-1].feedback
        assert desired.joint_names == list(NAMES)
        assert len(desired.desired.positions) == len(NAMES)
        assert sim(free_domain, "step", "--ticks", "3500")
        result = client.action.Result
        expected = (GoalStatus.STATUS_SUCCEEDED, result.SUCCESSFUL, "")
        assert client.end(followed) == expected

        narrow = [JointTolerance(name=NAMES[1], position=1e-15)]
        missed = client.send(1, HOME, GOAL, path_tolerance=narrow)
        assert sim(free_domain, "step", "--ticks", "2500")
        status, code, text = client.end(missed)
        assert (status, code) == (GoalStatus.STATUS_ABORTED, result.PATH_TOLERANCE_VIOLATED)
        assert text.startswith("the position of joint 'joint2' is off by ")

        superseded, cancelled = client.send(2, HOME), client.send(4, GOAL + 0.1)
        expected = (GoalStatus.STATUS_ABORTED, result.INVALID_GOAL, "another motion took its place")
        assert client.end(superseded) == expected
        assert sim(free_domain, "step", "--ticks", "1500")
        client.answer(cancelled.cancel_goal_async())
        expected = (GoalStatus.STATUS_CANCELED, 0, "the reference is brought to rest")
        assert client.end(cancelled) == expected
    assert sim(free_domain, "resume")
    output = flight.communicate(timeout=TIMEOUT_S)[0]
    assert flight.returncode == 0, output
    assert "mission_node: refused a trajectory: unknown joint 'wrist' of goal_tolerance" in output
    assert "mission_node: a goal is aborted, the reference is brought to rest: the pos" in output
    reference = read_flight(tmp_path / "bag").reference_joints
    assert np.abs(reference[:, 0] - GOAL).max(axis=1).min() < 1e-12
    assert np.abs(reference[-1, 0] - (GOAL + 0.1)).min() > 1e-3  # of the cancelled one
    np.testing.assert_array_equal(reference[-1, 1], 0.0)
    assert np.abs(np.diff(reference[:, 1], axis=0)).max() < 1e-3
