"""A trajectory for a robot in flight, as MoveIt sends it, on the real graph of ROS 2 nodes.

The mission follows a `trajectory_msgs/JointTrajectory` on ``/joint_trajectory`` from where the
reference is, without a jump in position or rate; ``ros2 topic pub`` sends the same message. The
flight is paused at 0.25 s until then, so that it is the same flight every time.

    python examples/joint_trajectory.py

prints:

    joints at the end: 2.0 118.0 221.0 -2.0 -12.0 1.0 deg
    largest step of the reference: 0.0020 deg, of its rate 0.0064 deg/s
"""

from __future__ import annotations

import argparse
import signal
import subprocess
import time
from pathlib import Path

import numpy as np
import rclpy
from rclpy.context import Context
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from space_robot import load_bag
from space_robot_msgs_py.ros.process import set_defaults

GOAL = np.radians([2.0, 118.0, 221.0, -2.0, -12.0, 1.0])
NAMES = [f"joint{k}" for k in range(1, 7)]
DOMAIN = "61"


def send_trajectory() -> None:
    """Publish one point that is to be reached in a second."""
    context = Context()
    rclpy.init(context=context, domain_id=int(DOMAIN))
    node = rclpy.create_node("planner", context=context)
    publisher = node.create_publisher(JointTrajectory, "joint_trajectory", 1)
    while not publisher.get_subscription_count():
        time.sleep(0.05)
    point = JointTrajectoryPoint(positions=GOAL.tolist())
    point.time_from_start.sec = 1
    publisher.publish(JointTrajectory(joint_names=NAMES, points=[point]))
    publisher.wait_for_all_acked()
    context.shutdown()


def sim(*words: str) -> int:
    """Control the paused flight; return the exit code."""
    command = ["space-robot", "sim", *words, "--domain", DOMAIN]
    return subprocess.run(command, capture_output=True).returncode


def main(bag: Path) -> None:
    """Fly, send the trajectory, and read its effect from the bag."""
    command = ["space-robot", "fly", "--paused", "--duration", "3", "--domain", DOMAIN]
    command += ["--bag", str(bag)]
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as flight:
        try:
            while sim("step", "--ticks", "500"):  # not before all nodes are there
                time.sleep(0.1)
            send_trajectory()
            sim("resume")
        except BaseException:
            flight.send_signal(signal.SIGINT)
            raise
    joints = np.degrees(load_bag(bag).reference_joints)
    print(f"joints at the end: {' '.join(f'{angle:.1f}' for angle in joints[-1, 0])} deg")
    steps = np.abs(np.diff(joints[:, :2], axis=0)).max(axis=(0, 2))
    print(f"largest step of the reference: {steps[0]:.4f} deg, of its rate {steps[1]:.4f} deg/s")


if __name__ == "__main__":
    arguments = argparse.ArgumentParser(description="Send a trajectory to a flight.")
    arguments.add_argument("--bag", type=Path, default=Path("flights/trajectory"))
    set_defaults()
    main(arguments.parse_args().bag)
