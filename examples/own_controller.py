"""A controller of your own on the ROS graph: a plain rclpy node flies the plant.

`space-robot fly --without controller` starts plant, mission and recorder, and waits for the node.
This one has a PD law, with the gains of the shipped law ``pd``. It answers each state with torques
on ``/command`` that have the state's stamp. In two terminals, in any order:

    space-robot fly --without controller --duration 1 --domain 62 --bag flights/own
    ROS_DOMAIN_ID=62 python examples/own_controller.py

prints in the second:

    2000 states answered; error at the last one: joints 3.8e-06 rad, attitude 2.0e-07 rad
"""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
import rclpy
from rclpy.node import Node
from sensor_msgs.msg import JointState, MultiDOFJointState
from trajectory_msgs.msg import JointTrajectory, MultiDOFJointTrajectory

STATE = {"joint_states": JointState, "base/state": MultiDOFJointState}
REFERENCE = {"reference/joints": JointTrajectory, "reference/base": MultiDOFJointTrajectory}
DEPTH = 10_000  # of queues: the recorder may be some thousand commands behind
# stiffness and damping about the base's axes (N m/rad, N m s/rad), then of joint1 to joint6
K_P = np.array([4.975e6, 2.6e6, 2.0675e6, 251e3, 850e3, 728e3, 19.9e3, 20.9e3, 4.62e3])
K_D = np.array([99.5e3, 52e3, 41.25e3, 5.02e3, 17e3, 14.6e3, 399.0, 419.0, 92.3])


def nanoseconds(time: Any) -> int:
    """Return a stamp, or a duration, as a whole number, by which ticks are equal or not."""
    return int(time.sec * 1_000_000_000 + time.nanosec)


def rotation(m: Any, d: Any) -> Any:
    """Return the small rotation from a measured to a desired quaternion, rad, on base axes."""
    m, d = (np.array([q.w, q.x, q.y, q.z]) for q in (m, d))
    return 2.0 * np.sign(m @ d) * (m[0] * d[1:] - d[0] * m[1:] - np.cross(m[1:], d[1:]))


class OwnController(Node):
    """A node that answers each state once both its parts and its reference have come."""

    def __init__(self) -> None:
        super().__init__("own_controller")
        self.parts: dict[int, dict[str, Any]] = {}
        self.stamp, self.answered, self.error = -1, 0, np.zeros(9)
        self.command = self.create_publisher(JointState, "command", DEPTH)
        for topic, kind in STATE.items():
            self.create_subscription(kind, topic, partial(self.take_state, topic), DEPTH)
        for topic, kind in REFERENCE.items():
            self.create_subscription(kind, topic, partial(self.take_reference, topic), DEPTH)

    def take_reference(self, topic: str, message: Any) -> None:
        """Keep the points of a reference by their stamps; it comes up to 0.5 s ahead."""
        start = nanoseconds(message.header.stamp)
        for point in message.points:
            self.take(start + nanoseconds(point.time_from_start), topic, point)

    def take_state(self, topic: str, message: Any) -> None:
        """Take one part of a state, again if the plant had no answer for 0.2 s."""
        self.take(nanoseconds(message.header.stamp), topic, message)

    def take(self, stamp: int, topic: str, content: Any) -> None:
        """Keep what has come for a stamp; answer when it is complete."""
        parts = self.parts.setdefault(stamp, {})
        parts[topic] = content
        if len(parts) == len(STATE) + len(REFERENCE):
            self.answer(stamp, *(parts[name] for name in (*STATE, *REFERENCE)))

    def answer(self, stamp: int, joints: Any, base: Any, desired: Any, desired_base: Any) -> None:
        """Publish the torques for a state."""
        error = rotation(base.transforms[0].rotation, desired_base.transforms[0].rotation)
        self.error = np.append(error, np.subtract(desired.positions, joints.position))
        wanted, omega = desired_base.velocities[0].angular, base.twist[0].angular
        turn = [wanted.x - omega.x, wanted.y - omega.y, wanted.z - omega.z]
        rate = np.append(turn, np.subtract(desired.velocities, joints.velocity))
        command = JointState(name=["base_x", "base_y", "base_z", *joints.name])
        command.header.stamp = joints.header.stamp
        command.effort = (K_P * self.error + K_D * rate).tolist()
        self.command.publish(command)
        if stamp != self.stamp:
            self.parts.pop(self.stamp, None)
            self.stamp, self.answered = stamp, self.answered + 1


rclpy.init()
node = OwnController()
while not node.answered or node.count_publishers("joint_states"):
    rclpy.spin_once(node, timeout_sec=0.1)
base, joints = abs(node.error[:3]).max(), abs(node.error[3:]).max()
print(f"{node.answered} states answered; error at the last one: ", end="")
print(f"joints {joints:.1e} rad, attitude {base:.1e} rad")
